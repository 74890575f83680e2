/* The mesh bilateral gradient filter of guides, for the paper's own method (Chang et al. 2025, Eq. 9, after
 * Chang et al. 2024). */
#ifndef FIT_GRADIENT_FILTER_H
#define FIT_GRADIENT_FILTER_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

/* D of Eq. 9 as one matrix, its rows summing to 1:
 *     D_ab ~ (I + lambda L)^-1_ab  sum_q exp(-|d_a - q|^2 / (2 sigma_phi^2)) exp(-|d_b - q|^2 / (2 sigma_d^2)),
 * with L the unweighted Laplacian of the Delaunay triangulation of the roots, d the guides' directions at the
 * root, and q 32 directions spread over the sphere: what guides of one direction have to say is spread over
 * the scalp (sigma_d), and each guide listens to the directions near its own (sigma_phi).
 * uv, direction  [n][2], [n][3] unit
 * filter         [n][n] out
 * returns        GROOM_OK, GROOM_ENOMEM, what groom_triangulation_create answers
 * threads        same bits for any pool */
struct gradient_filter_widths { double lambda, sigma_d, sigma_phi; };
GROOM_MUST_CHECK groom_status gradient_filter(const float (*uv)[2], const float (*direction)[3], uint32_t n,
                                              struct gradient_filter_widths widths, float *filter,
                                              const struct groom_context *context, struct groom_diag *diag);

/* out = filter rows: [n][n] times [n][width] */
void gradient_filter_apply(const float *filter, const float *rows, uint32_t n, uint32_t width, float *out,
                           const struct groom_context *context);

#endif
