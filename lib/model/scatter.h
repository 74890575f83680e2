/* Adding up the strands' adjoints on their guides, with any number of threads and the same bits.
 *
 * Strands are visited in waves. The first step of a wave works on strands in parallel and leaves one
 * row of adjoints a strand in these buffers; the second works on guides in parallel, and each adds the
 * rows of its strands in the order of the visit. So memory does not grow with the number of guides or
 * threads, and no sum depends on who was faster. */
#ifndef MODEL_SCATTER_H
#define MODEL_SCATTER_H

#include "groom/groom.h"
#include "model/plan.h"

#define WAVE 1024 /* strands; a multiple of GROOM_GRADIENT_PIECE */

struct scatter {
    const struct plan *plan;
    float *instance;   /* [WAVE][3m] adjoint of guide - its root, times the weight still to come; [0] is
                        * the root's share, minus the sum of the others */
    float *guide;      /* [WAVE][3m] adjoint of the operator guide's vertices; where the chain clumps */
    float *frame;      /* [WAVE][FRAME_WIDTH * m]; where it curls */
    float *axis;       /* [WAVE][AXIS_WIDTH]; where it bends */

    float *d_frame;    /* [n_gop][FRAME_WIDTH * m] sums so far */
    float *d_axis;     /* [n_gop][AXIS_WIDTH] */

    uint32_t *guide_first;          /* [n_g + 1] a wave's rows by guide */
    struct scatter_entry {
        const float *row;
        float weight;
    } *entry;                       /* [WAVE * (k + 1)] */
    uint32_t *operator_first;       /* [n_gop + 1] a wave's strands by operator guide */
    uint32_t *member;               /* [WAVE] */
    const struct groom_allocator *allocator;
};

/* returns  GROOM_OK or GROOM_ENOMEM, with nothing to finish */
GROOM_MUST_CHECK groom_status scatter_init(struct scatter *scatter, const struct plan *plan,
                                           const struct groom_context *context);
void scatter_finish(struct scatter *scatter); /* takes a zeroed one */

/* Second step: the wave's n strands are strand[0..n-1]; adds to d_guides [n_g * m]. */
void scatter_wave(struct scatter *scatter, const uint32_t *strand, uint32_t n, float (*d_guides)[3],
                  const struct groom_context *context);

/* After the last wave: what came through the frames of the operator guides. */
void scatter_frames(struct scatter *scatter, float (*d_guides)[3], const struct groom_context *context);

#endif
