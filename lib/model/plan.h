/* What one evaluation needs to know beforehand: which operators take part, and the frames of the
 * operator guides that its strands use. Read-only while the strands are worked on. */
#ifndef MODEL_PLAN_H
#define MODEL_PLAN_H

#include "groom/groom.h"
#include "model/block.h"
#include "model/kernel.h"

struct plan {
    const struct groom *groom;
    const float (*axes)[3]; /* [3] of the groom; NULL: those of space */
    enum kernel_variant variant;
    uint32_t n_active;      /* enabled operators */
    uint32_t *active;       /* [n_active] their indices, in the order of the chain */
    int bends, curls, clumps, frizzes;
    float *relative;        /* [n_g][3m] guides relative to their roots, where the groom has no base */
    float *frame;           /* [n_gop][FRAME_WIDTH * m] where it curls */
    float *axis;            /* [n_gop][AXIS_WIDTH] where it bends */
    const float (*noise)[4]; /* [NOISE_TABLE] where it frizzes */
    const struct groom_allocator *allocator;
};

/* A plan for all strands knows all guides, so that strands may be given others while it lasts; any plan knows those operator
 * guides alone that its strands had when it was made.
 * strand   [count], or NULL: the strands from `first` on
 * returns  GROOM_OK or GROOM_ENOMEM, with nothing to finish */
GROOM_MUST_CHECK groom_status plan_init(struct plan *plan, const struct groom *groom, const uint32_t *strand,
                                        uint32_t first, uint32_t count, enum kernel_variant variant,
                                        const struct groom_context *context);
void plan_finish(struct plan *plan);

/* One thread's memory for one block. */
struct workspace {
    uint32_t m, n_states;
    float *rows;              /* [LANES][3m]; where the groom has a base */
    lanes *state;             /* [n_states][5m] the block before and after operators: workspace_state */
    lanes *guide;             /* [3m]; with frame and axis, as in kernel_inputs */
    lanes *frame;             /* [FRAME_WIDTH * m] */
    lanes *axis;              /* [AXIS_WIDTH] */
    lanes root[3];            /* roots of the strands in the lanes */
    uint32_t loaded[LANES];   /* whose guide, frame and axis stand in the lanes, one above the number of the operator
                               * guide: neighbouring blocks mostly share it */
    lanes *scratch;           /* [KERNEL_SCRATCH(m)] */
    lanes *memory;            /* all of it */
    size_t n_memory;
};

GROOM_MUST_CHECK groom_status workspace_init(struct workspace *workspace, uint32_t m, uint32_t n_states,
                                             const struct groom_allocator *allocator);
void workspace_finish(struct workspace *workspace, const struct groom_allocator *allocator); /* takes zeroes */

/* The points of state i, and room for what bundles carry with them. */
struct bundle workspace_state(const struct workspace *workspace, uint32_t i);

/* Instance the block into state 0, measure it and bring its operator guides into the lanes. */
void plan_load(const struct plan *plan, const struct block *block, struct workspace *workspace);
/* The same for those who do not ask for the states between: a scale that comes first is applied on the way, to the
 * same bits. returns the first active operator that is left */
uint32_t plan_load_scaled(const struct plan *plan, const struct block *block, struct workspace *workspace);

/* The kernels' view of the a-th active operator. */
struct kernel_inputs plan_inputs(const struct plan *plan, const struct block *block,
                                 const struct workspace *workspace, uint32_t a);

/* y = operator(x), the a-th active one. The last one's are not measured. */
void plan_apply(const struct plan *plan, const struct block *block, struct workspace *workspace, uint32_t a,
                struct bundle x, struct bundle y);

/* Roots of the strands in the lanes, for block_from_rows and block_to_rows. */
void plan_roots(const struct plan *plan, const struct block *block, const float *root[LANES]);

#endif
