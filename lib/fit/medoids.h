/* K-medoids: k of n rows such that the sum of the distances of all rows to the nearest is small. */
#ifndef FIT_MEDOIDS_H
#define FIT_MEDOIDS_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/random.h"

/* Seeding like k-means++, then passes of eager swaps (FasterPAM, Schubert and Rousseeuw 2021): a pass
 * tries every row as a medoid in place of the one whose loss hurts least, at O(n) each, and takes
 * every improvement. Ends where a whole pass finds none, or after max_passes.
 * x         [n][d]
 * k         1..n
 * medoids   [k] ascending, all different
 * before    mean distance to the nearest medoid after seeding; after: at the end; may be NULL
 * memory    4 n^2 bytes for the distances
 * threads   same bits for any pool */
GROOM_MUST_CHECK groom_status medoids_choose(const float *x, uint32_t n, uint32_t d, uint32_t k, uint32_t max_passes,
                                             struct groom_random_key key, const struct groom_context *context,
                                             uint32_t *medoids, double *before, double *after,
                                             struct groom_diag *diag);

#endif
