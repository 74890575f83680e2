/* How far apart two sets of strands are as distributions (Chang et al. 2025, Eqs. 11 and 12). */
#ifndef QUALITY_LOSS_WASSERSTEIN_H
#define QUALITY_LOSS_WASSERSTEIN_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/random.h"

/* The sliced Wasserstein loss of Eq. 11, divided by n so that it does not depend on how many rows are
 * looked at: both sets are projected onto random unit vectors, each set's projections are sorted, and
 * the squared differences are averaged.
 * a, b          [n][d]; the order of the rows does not matter
 * n_directions  0: d, as the paper has it
 * key           of the directions; a direction is a function of (key, its index, d)
 * returns       GROOM_OK, GROOM_ENOMEM
 * threads       same bits for any pool */
GROOM_MUST_CHECK groom_status loss_wasserstein(const float *a, const float *b, uint32_t n, uint32_t d,
                                               uint32_t n_directions, struct groom_random_key key,
                                               const struct groom_context *context, double *loss,
                                               struct groom_diag *diag);

/* The direction of Eq. 11 of this index: a unit vector [d]. */
void loss_wasserstein_direction(struct groom_random_key key, uint32_t index, uint32_t d, float *direction);

/* Eq. 12 and its two terms: total = spectra + lambda_e segments. */
struct loss_shape {
    double spectra, segments, total;
};

/* The strand shape loss between two sets of strands: on magnitudes of the one-sided Fourier transform
 * of the m-1 segments of each coordinate, and on the segments themselves.
 * a, b   [n][m][3]
 * unit   lengths are divided by it: the size of 10 cm, the unit that the paper's weights fit */
GROOM_MUST_CHECK groom_status loss_shape(const float (*a)[3], const float (*b)[3], uint32_t n, uint32_t m, double unit,
                                         double lambda_e, struct groom_random_key key,
                                         const struct groom_context *context, struct loss_shape *loss,
                                         struct groom_diag *diag);

/* The features of Eq. 12: segments [n][3][m-1] over `unit`, coordinate by coordinate, and the magnitudes
 * [n][3][(m-1)/2 + 1] of their transforms. */
GROOM_MUST_CHECK groom_status loss_shape_features(const float (*points)[3], uint32_t n, uint32_t m, double unit,
                                                  float *segments, float *magnitudes,
                                                  const struct groom_context *context, struct groom_diag *diag);

#endif
