/* Which segments of a set of strands are near a place: a grid of small cells in blocks, of which only those
 * that hold something are stored. */
#ifndef QUALITY_SEGMENT_GRID_H
#define QUALITY_SEGMENT_GRID_H

#include "quality/set.h"

/* A piece of a strand: middle - half .. middle + half, root to tip. */
struct grid_segment {
    float middle[3], half[3];
    float inverse; /* 1 / |half| */
};

struct segment_grid {
    float origin[3], cell;       /* metres */
    float widest;                /* side of the box */
    uint32_t n_across[3];        /* blocks */
    uint32_t *block_of;          /* [blocks of the box] index among those stored, or UINT32_MAX */
    uint32_t n_blocks;
    uint32_t (*place_of)[3];     /* [n_blocks] where each stands */
    uint32_t *first;             /* [n_blocks * 512 + 1] of each cell's segments */
    struct grid_segment *segments;
    float longest_half;          /* of a segment: longer ones were cut */
    const struct groom_allocator *allocator;
};

/* Segments without length are left out; the set has some with. Finish it in any case.
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ETOOBIG */
GROOM_MUST_CHECK groom_status segment_grid_init(struct segment_grid *grid, const struct quality_set *set,
                                                const struct groom_context *context, struct groom_diag *diag);
void segment_grid_finish(struct segment_grid *grid);

/* Squared distance of the nearest point on any segment, and the cosine between that segment and direction. */
void segment_grid_nearest(const struct segment_grid *grid, const struct quality_place *place, float *squared, float *cosine);

/* Whether some segment comes within each distance whose angle to the place's direction has at least this cosine.
 * The tolerances grow: what passes one passes those after it.
 * found  [n] out */
void segment_grid_matches(const struct segment_grid *grid, const struct quality_place *place, const float *distance,
                          const float *cosine, uint32_t n, int *found);

#endif
