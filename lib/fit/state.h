/* What a fit holds, and what a stage is. */
#ifndef FIT_STATE_H
#define FIT_STATE_H

#include <stdint.h>

#include "groom/fit.h"
#include "groom/scalp.h"
#include "groom/spatial.h"

/* What draws to estimate uses this seed in place of the options', which decides a groom's random numbers alone:
 * how well a fit goes is no lottery. (The paper's own gradient steps go by the options'.) */
#define FIT_OWN_SEED 1u

/* What is known of the axes that hair was made along: nothing yet; they are the file's; these by quarter turns; they are near
 * the frame; they are the frame, as strands tell. */
enum fit_axes { AXES_UNKNOWN, AXES_GIVEN, AXES_QUARTER, AXES_NEAR, AXES_FOUND };

struct groom_fit {
    const struct groom_allocator *allocator;
    struct groom_fit_options options;
    uint64_t inputs; /* checksum of strands, head and options */

    /* --- the target: a function of the inputs, made again by groom_fit_create ---------------- */
    uint32_t n, m;
    struct groom_bvh *bvh;     /* of the head; NULL without one */
    struct groom_scalp *scalp; /* the chart of the roots */
    float (*roots)[3];         /* [n] metres, on the scalp where the strand reaches it */
    float (*root_uv)[2];       /* [n] */
    float (*target)[3];        /* [n * m] (position - centre) / scale */
    struct head_plane *head_plane; /* [n * head_planes_of(m)] the head beside the target (head_planes.h); NULL without one */
    float centre[3];           /* of all points, metres */
    float scale;               /* metres: root mean square distance of all points from the centre */
    float ordinary;            /* size of this scalp over that of an ordinary one: 1 for real hair in metres */
    double own[3][3];          /* rows: axes that turn with the hair (canonical.h) */
    struct {                   /* every strand of the capture, where cameras see some only (unseen.h); else 0 */
        uint32_t n;
        uint32_t *seen;        /* [groom_fit.n] which those of the target are, rising; room for n */
        float (*roots)[3], (*root_uv)[2]; /* [n] */
    } all;

    /* --- what the stages have made so far: all of it is in a checkpoint ------------------------ */
    uint32_t stage, phase, iteration; /* where the next step goes on; stage = count: done */
    uint32_t n_guides;                /* 0 until clusters are seeded */
    float (*centroids)[3];            /* [n_guides * m] of clusters, not smoothed, in the target's frame */
    uint32_t *cluster_of;             /* [n] */
    double frame[3][3];               /* rows: axes along which operators are matched (axes.h); the hair's own to begin with */
    uint32_t axes;                    /* enum fit_axes: what is known of them */
    uint32_t axes_looks;              /* how often they were looked for: once roughly, and once more */
    struct groom *groom;              /* NULL until there are guides */
    uint32_t n_moments;               /* of a gradient descent under way: see fit/adam.h; 0: there is none */
    float *moments;                   /* [n_moments] */
    struct groom_fit_report report;
};

struct fit_stage {
    const char *name;
    /* The next bounded piece of work. It moves phase and iteration on, and sets *ended with the last
     * one. Where it fails, the fit stands as before. */
    groom_status (*step)(struct groom_fit *fit, int *ended, const struct groom_context *context,
                         struct groom_diag *diag);
    double (*fraction)(const struct groom_fit *fit); /* 0..1 of the stage */
    /* Whether phase and iteration go with what else the state holds: for one that was read. */
    int (*sound)(const struct groom_fit *fit);
    double weight; /* its share of the time of a fit */
};

/* The stages of this library, in order: X(name, its share of the time of a fit). Each has a file
 * <name>.c with <name>_step, <name>_fraction and <name>_sound. A new stage is one line here and that
 * file. */
#define FIT_STAGE_LIST(X)                                                                                    \
    X(initialize, 1.0)                                                                                       \
    X(instance_weights, 0.3)                                                                                 \
    X(guides, 0.7)                                                                                               \
    X(operators, 1.5)                                                                                        \
    X(randoms, 5.0)

enum {
#define FIT_STAGE_INDEX(name, weight) FIT_STAGE_##name,
    FIT_STAGE_LIST(FIT_STAGE_INDEX)
#undef FIT_STAGE_INDEX
    FIT_N_STAGES
};

extern const struct fit_stage fit_stages[FIT_N_STAGES];
int fit_has_stage(const char *name);

#define FIT_STAGE_DECLARE(name, weight)                                                                      \
    groom_status name##_step(struct groom_fit *fit, int *ended, const struct groom_context *context,          \
                             struct groom_diag *diag);                                                        \
    double name##_fraction(const struct groom_fit *fit);                                                      \
    int name##_sound(const struct groom_fit *fit);
FIT_STAGE_LIST(FIT_STAGE_DECLARE)
#undef FIT_STAGE_DECLARE

/* The last phase of stages that move strands: operator guides for the next strands from `iteration`
 * on, out of the head; *ended with the last ones (assign_step.c). */
groom_status assign_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                         struct groom_diag *diag);

/* Fills n .. ordinary, and the report's counts of joined and detached strands. */
groom_status target_create(struct groom_fit *fit, const struct groom_strands *strands,
                           const struct groom_mesh *head, const struct groom_context *context,
                           struct groom_diag *diag);

/* report.c */
void report_note(struct groom_fit_report *report, const char *format, ...) __attribute__((format(printf, 2, 3)));
void report_loss(struct groom_fit_report *report, const char *stage, const char *name, double before, double after);
/* A loss of a stage in progress, streamed: its first value stands in both columns, later ones in the second. */
void report_progress(struct groom_fit_report *report, const char *stage, const char *name, double value,
                     uint64_t iteration, const struct groom_context *context);

#endif
