/* The k nearest points of the plane, exact, by a uniform grid. The model keeps its own so that it
 * depends on no library (it is also compiled for the browser). */
#ifndef MODEL_UV_GRID_H
#define MODEL_UV_GRID_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

struct uv_grid {
    const float (*points)[2]; /* borrowed */
    uint32_t n_points;
    uint32_t side;            /* cells along each axis */
    double origin[2], cell[2];
    uint32_t *first;          /* [side * side + 1] */
    uint32_t *index;          /* [n_points] points by cell, ascending within a cell */
    const struct groom_allocator *allocator;
};

/* points   [n][2] finite, borrowed until finish; n at least 1
 * returns  GROOM_OK or GROOM_ENOMEM, with nothing to finish */
GROOM_MUST_CHECK groom_status uv_grid_init(struct uv_grid *grid, const float (*points)[2], uint32_t n,
                                           const struct groom_allocator *allocator);
void uv_grid_finish(struct uv_grid *grid); /* takes a zeroed grid */

/* The k nearest points (k <= n_points) that are not `except` (UINT32_MAX: all may be), nearest first,
 * equal distances by lower index; fewer where there are fewer.
 * returns  how many */
uint32_t uv_grid_nearest(const struct uv_grid *grid, const float query[2], uint32_t k, uint32_t except,
                         uint32_t *index, double *squared);

#endif
