/* One retargeting under way: what groom_retarget_run does, in its order.
 *
 * Positions on the target are floats relative to its centre; positions of the source are floats relative to
 * the source's. Only differences of the two kinds meet. */
#ifndef RETARGET_JOB_H
#define RETARGET_JOB_H

#include "retarget/batches.h"
#include "retarget/field.h"
#include "retarget/source.h"

/* How far each part of a run brings it, of 1. */
#define TRANSFERRED 0.05
#define COUNTED 0.1
#define ADAPTED 0.9
#define CLEARED 0.98

/* What the initial transfer tells of a strand. */
enum standing {
    STANDING_STAYS = 1,      /* it is where it was and keeps the clearance: nothing moves it */
    STANDING_IN_CONFLICT = 2, /* something of it is inside or too near */
    STANDING_SHORT = 4        /* by the last pass: shorter than the clearance, which it cannot keep */
};

struct job {
    const struct groom_retarget_source *source;
    const struct groom_retarget_target *target;
    const struct groom_retarget_options *options;
    const struct groom_context *context;
    const struct groom_allocator *allocator;
    double centre[3];            /* of the target's body */
    struct groom_bvh *bvh;       /* of the target's body */
    struct field field;
    float (*hat)[3];             /* [n_vertices] p-hat of Eq. 4, relative to the centre */
    uint8_t *standing;           /* [n_strands] enum standing, as bits */
    float (*shift)[3];           /* [n_strands] how far a hairline edit moved each root; NULL: there is none */
    struct groom_retarget_report *report;
    float progress_from, progress_to;
};

groom_status job_init(struct job *job, const struct groom_retarget_source *source,
                      const struct groom_retarget_target *target, const struct groom_retarget_options *options,
                      const struct groom_context *context, struct groom_retarget_report *report, struct groom_diag *diag);
void job_finish(struct job *job); /* takes one whose other members are 0, but for source and allocator */
/* Both scales, or all strands together, from hat. result [n_vertices] relative to the centre. */
groom_status job_adapt(struct job *job, float (*result)[3], struct groom_diag *diag);

/* --- the initial transfer (transfer.c): Eqs. 3 to 6 ------------------------------- */

/* p-tilde of one particle on the target, in metres. */
void transfer_anchor(const struct job *job, uint32_t vertex, double out[3]);
/* The same of a root. Strands grow out of the surface: a root that a capture or a modeller buried goes to where its
 * ray leaves the body, else its first segment could not get out either. */
void transfer_root(const struct job *job, uint32_t vertex, double out[3]);
/* hat, of all strands; shift where the target has roots of its own. */
groom_status transfer_all(struct job *job, struct groom_diag *diag);

/* gamma of Eq. 20: arc is the length along the source's strand from the root, travel the root's. 1 where it stayed. */
double adaptive_weight(double arc, double travel, double sigma);

/* --- the fine scale (fine.c): Section 5 --------------------------------------------- */

/* guide_moved [guide particles]: the guides' result less their source, each relative to its own centre. */

/* result [n_vertices]: of the strands that are no guides, relative to the centre. */
groom_status fine_solve(struct job *job, const float (*guide_moved)[3], float (*result)[3],
                        struct groom_retarget_energy *energy, struct groom_diag *diag);
/* Energies of the strands that are no guides, at positions `at`. */
groom_status fine_energy(struct job *job, const float (*guide_moved)[3], const float (*at)[3],
                         struct groom_retarget_energy *energy, struct groom_diag *diag);

/* --- the coarse scale and the global mode: strands that pull on each other ------------- */

/* Strands that are adapted together. */
struct coupled {
    uint32_t n_strands, n;
    const uint32_t *first;       /* [n_strands + 1] */
    const uint8_t *standing;     /* [n_strands] enum standing; or NULL: all may move */
    const uint32_t *order;       /* [n_strands] those that grow near each other are near in it */
    const float (*rest)[3];      /* [n] p-bar relative to the source's centre */
    const float (*hat)[3];       /* [n] p-hat */
    const float *gamma;          /* [n] Eq. 20, or NULL: 1 */
    const struct graph *graph;
    float (*p)[3];               /* [n] in: where they start; out: adapted */
};

/* order of hair's first and rest (order.c) */
groom_status coupled_order(const struct coupled *hair, uint32_t *order, const struct groom_allocator *allocator,
                           struct groom_diag *diag);
/* Section 4.6 to the letter (coupled.c): so many iterations, each with the lengths of segments held, to the last
 * digits. What a reference is compared with. */
groom_status coupled_solve(struct job *job, const struct coupled *hair, uint32_t iterations, uint32_t *n_iterations,
                           struct groom_retarget_step *history, struct groom_diag *diag);
/* Down to where a step moves less than the tolerance, lengths as they are (descent.c). An iteration is a step. */
groom_status descent_solve(struct job *job, const struct coupled *hair, uint32_t iterations, uint32_t *n_iterations,
                           struct groom_retarget_step *history, struct groom_diag *diag);
groom_status coupled_energy(struct job *job, const struct coupled *hair, const float (*at)[3],
                            struct groom_retarget_energy *energy, struct groom_diag *diag);

/* --- contact (contact.c) ---------------------------------------------------------------- */

/* The half-space of Eq. 13 at a particle: n . (x - at) >= height is outside with the clearance. */
struct plane {
    double normal[3], height;
};

/* The half-space at p (relative to the centre): normal . d >= height for a movement d from p. Returns the distance
 * from the surface, 0 where p is inside. */
double contact_plane(const struct job *job, const float p[3], struct plane *plane);
/* How far p is from the body at least (field_away). */
float contact_away(const struct job *job, const float p[3]);

/* --- the exact last pass (clearance.c) --------------------------------------------------- */

/* Moves what is too near out of the body; roots stay. A strand shorter than the clearance stands up from its root, with
 * its length kept. points [n_vertices] in metres; left: what could not be moved out. */
groom_status clearance_apply(struct job *job, float (*points)[3], struct groom_retarget_inside *left, struct groom_diag *diag);
/* Counts what is inside and notes which strands that is of. points are as they were. */
groom_status clearance_count(struct job *job, float (*points)[3], struct groom_retarget_inside *inside, struct groom_diag *diag);

#endif
