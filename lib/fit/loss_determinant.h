/* How alike neighbouring strands are, by determinants (Chang et al. 2025, Eqs. 13-18). */
#ifndef FIT_LOSS_DETERMINANT_H
#define FIT_LOSS_DETERMINANT_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/random.h"

/* The kernels have ranks far below their size and determinants that round to below 0: all is done with
 * K + epsilon I. The loss hardly depends on epsilon (notes on the fit: 1e-6 .. 1e-1). */
#define DETERMINANT_EPSILON 1e-4

/* A kernel of n strands [n][m][3], its lower triangle filled. Lengths are divided by `unit` first. */
typedef void determinant_kernel(const float (*points)[3], uint32_t n, uint32_t m, double unit, double sigma,
                                double *kernel);
/* Eqs. 14, 15: exp(-(l_a - l_b)^2 / sigma) */
determinant_kernel determinant_scale_kernel;
/* Eqs. 16, 17: exp(-CD / sigma), where CD is the mean distance of vertices over that of the roots. 1 on
 * the diagonal; roots closer than 1e-4 units count as that far apart. */
determinant_kernel determinant_clump_kernel;

/* log det(K + epsilon I) of a kernel [n][n] with ones on its diagonal, by Cholesky; the kernel is spoilt.
 * Where that is not positive definite (Eq. 17 is no metric, so Eq. 16 need not be) with the least power of
 * ten times epsilon that is. -INFINITY for a kernel that is not finite. */
double determinant_log(double *kernel, uint32_t n);

/* The same, and (K + epsilon I)^-1 in full, for its slope. inverse [n][n]; not set where the answer is -INFINITY */
double determinant_log_inverse(double *kernel, uint32_t n, double *inverse);

/* The mean over batches of the squared difference of log-determinants (Eqs. 13, 18).
 * a, b     [n_batches][n][m][3]
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status loss_determinant(const float (*a)[3], const float (*b)[3], uint32_t n_batches, uint32_t n,
                                               uint32_t m, double unit, double sigma, determinant_kernel *kernel,
                                               const struct groom_context *context, double *loss,
                                               struct groom_diag *diag);

struct groom_neighbours;

/* The batches of Section 5.5: strands drawn at random, each with those nearest to it on the scalp.
 * root_uv  [n_strands][2]
 * n        strands of a batch, at most n_strands
 * strand   [n_batches][n] out */
GROOM_MUST_CHECK groom_status determinant_batches(const float (*root_uv)[2], uint32_t n_strands, uint32_t n_batches,
                                                  uint32_t n, struct groom_random_key key,
                                                  const struct groom_context *context, uint32_t *strand,
                                                  struct groom_diag *diag);
/* Likewise, where many are drawn: of an index of the roots that stays. index  of the first batch's random number */
GROOM_MUST_CHECK groom_status determinant_draw(const struct groom_neighbours *neighbours, const float (*root_uv)[2],
                                               uint32_t n_strands, uint32_t index, uint32_t n_batches, uint32_t n,
                                               struct groom_random_key key, const struct groom_context *context,
                                               uint32_t *strand, struct groom_diag *diag);

#endif
