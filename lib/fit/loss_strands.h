/* How far strands are from their targets, one by one (Chang et al. 2025, Eq. 19). */
#ifndef FIT_LOSS_STRANDS_H
#define FIT_LOSS_STRANDS_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

/* Means over strands. With unit directions d_j of the m-1 segments:
 *   spectra    sum over coordinates and waves of (|F d| - |F d^|)^2, one-sided, not normalised
 *   direction  1 - the mean over segments of <d_j, d^_j>
 *   length     (l - l^)^2 in units
 *   total      spectra + lambda_d direction + lambda_l length
 *   vertex     the mean distance of vertices in metres: no part of Eq. 19 */
struct loss_strands { double total, spectra, direction, length, vertex; };

/* a, b     [n][m][3] metres, m vertices at equal steps of arc length
 * unit     lengths are divided by it: 10 cm, the unit that the paper's weights fit
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status loss_strands(const float (*a)[3], const float (*b)[3], uint32_t n, uint32_t m, double unit,
                                           double lambda_d, double lambda_l, const struct groom_context *context,
                                           struct loss_strands *loss, struct groom_diag *diag);

#endif
