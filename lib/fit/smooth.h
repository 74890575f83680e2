/* Smoothing of polylines by the heat equation (Chang et al. 2025, Eq. 6). */
#ifndef FIT_SMOOTH_H
#define FIT_SMOOTH_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

/* n_steps implicit steps (I + lambda L) x' = x on each polyline; its first n_fixed vertices
 * (1 at least: the root) and the tip are kept, bit for bit.
 *
 * Between fixed ends the interior of L is diagonal in sines, with eigenvalues 2 - 2 cos(pi k / (f + 1)),
 * and the straight line between the ends is what all steps lead to. So all steps together are one
 * f x f matrix on the difference from that line:
 *     x' = line + S diag((1 + lambda mu_k)^-n_steps) S (x - line)
 * points    [n][m][3], in place; m at least 2
 * returns   GROOM_OK, GROOM_ENOMEM: the points are as before
 * threads   same bits for any pool */
GROOM_MUST_CHECK groom_status smooth_polylines(float (*points)[3], uint32_t n, uint32_t m, uint32_t n_fixed,
                                               double lambda, uint32_t n_steps, const struct groom_context *context,
                                               struct groom_diag *diag);

#endif
