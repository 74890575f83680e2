/* The parts of the generator, in the order in which it uses them. */
#ifndef SAMPLE_PARTS_H
#define SAMPLE_PARTS_H

#include "groom/groom.h"
#include "groom/mesh.h"
#include "groom/random.h"
#include "groom/sample.h"
#include "groom/spatial.h"
#include "groom/strands.h"

/* Streams of random numbers; the operators of the truth use streams below these. */
enum sample_stream { STREAM_GUIDE = 0x5a000001, STREAM_DEFECT, STREAM_PATCH, STREAM_NOISE };

/* --- styles (styles.c) -------------------------------------------------------- */

struct sample_operator {
    groom_operator_type type;
    float parameter[GROOM_OPERATOR_MAX_PARAMETERS];
};

/* How hair of a style grows and what the operators make of it. Lengths in metres. */
struct sample_style {
    uint32_t n_strands, n_guides, n_operator_guides;
    double length;       /* of the longest guides */
    double length_low;   /* of those at the lower edge of the scalp, over `length` */
    double cut;          /* hair ends this far below the middle of the head; 0: where its length ends */
    double lift;         /* share of the scalp's normal in the direction at the root */
    double comb_side, comb_front, comb_up; /* what else is in it: away from the parting, to the face, up */
    double gravity;      /* how fast the direction turns down: radians per metre, at most */
    double parting;      /* x of the parting; NAN without one */
    double layer;        /* how far from the head hair comes to lie, at its tip */
    uint32_t n_operators;
    struct sample_operator operators[GROOM_OPERATOR_COUNT];
};

const struct sample_style *sample_style_of(groom_sample_style style);

/* --- the head (head.c) ---------------------------------------------------------- */

extern const double sample_head_centre[3];

/* The head is the set of points centre + t direction, 0 <= t <= radius(direction); direction of unit length. */
double sample_head_radius(const double direction[3]);
/* Whether hair grows there: not on the face, at the ears or on the neck. `height` (may be NULL): 0 at
 * the lower edge of the scalp .. 1 at the crown. */
int sample_head_is_scalp(const double direction[3], double *height);
/* The outward normal of the surface. */
void sample_head_normal(const double direction[3], double normal[3]);
groom_status sample_head_create(const struct groom_context *context, struct groom_mesh **head,
                                struct groom_diag *diag);
/* n points spread evenly over the scalp, the same first ones for any n. `offset` starts another such row. */
void sample_head_roots(uint32_t n, double offset, float (*roots)[3]);

/* --- the groom (guides.c, truth.c) ------------------------------------------------- */

/* A strand that grows from root as the style says, resampled to m points.
 * fine  [SAMPLE_FINE + 1] scratch */
#define SAMPLE_FINE 400
void sample_guide_grow(const struct sample_style *style, uint64_t seed, uint32_t index, const float root[3],
                       uint32_t m, float (*fine)[3], float (*points)[3]);

groom_status sample_truth_create(const struct groom_sample_options *options, const struct groom_mesh *head,
                                 const struct groom_context *context, struct groom **truth,
                                 struct groom_diag *diag);

/* --- the capture (capture.c) --------------------------------------------------------- */

/* capture    the truth's strands with the defects of the options
 * strand_of  [capture->n_strands] from the context's allocator */
groom_status sample_capture_create(const struct groom_sample_options *options, const struct groom *truth,
                                   const struct groom_context *context, struct groom_strands **capture,
                                   uint32_t **strand_of, struct groom_diag *diag);

#endif
