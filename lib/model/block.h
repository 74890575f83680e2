/* Between strands in rows (each its own array) and strands in lanes (a block, side by side). */
#ifndef MODEL_BLOCK_H
#define MODEL_BLOCK_H

#include "groom/groom.h"
#include "model/lanes.h"

/* Which strands stand in the lanes. Lanes from n on repeat the last strand. */
struct block {
    uint32_t n;
    uint32_t strand[LANES];
};

/* strand: the n strands, 1..LANES. */
struct block block_of(const uint32_t *strand, uint32_t n);

/* Eq. 3 relative to the root: sum over k of weight (guide_j - guide_1).
 * relative  [n_g][3m] guides relative to their roots; those of the block's strands are looked at
 * factor    what each lane's strand is scaled by on the way, or NULL
 * x         [3m] */
void block_instance(const struct groom *groom, const float *relative, const struct block *block, const float *factor,
                    lanes *x);

/* Rows [n] side by side.
 * subtract  one 3-vector of each lane, taken from each of its points, or NULL */
void block_from_rows(const float *const row[LANES], const float *const subtract[LANES], uint32_t n,
                     lanes *restrict x);

/* The first n_rows lanes back to rows [n].
 * add      likewise, or NULL */
void block_to_rows(const lanes *restrict x, const float *const add[LANES], uint32_t n, float *const row[LANES],
                   uint32_t n_rows);

#endif
