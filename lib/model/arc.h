/* Arc length along the strands of a block, and its adjoint. Bodies for the kernels. */
#ifndef MODEL_ARC_H
#define MODEL_ARC_H

#include "model/lanes.h"

/* ell[j], j < m-1: length of segment j; at[j], j < m: arc length from the root to vertex j;
 * inverse: 1 / length of the strand, 0 where it has none. */
LANES_INLINE void arc_measure(uint32_t m, const lanes *restrict x, lanes *restrict ell, lanes *restrict at,
                              float *restrict inverse)
{
    FOR_LANES(l) at[0][l] = 0.0f;
    for (uint32_t j = 0; j + 1 < m; j++) {
        const lanes *p = x + 3 * j;
        FOR_LANES(l)
        {
            float ex = p[3][l] - p[0][l], ey = p[4][l] - p[1][l], ez = p[5][l] - p[2][l];
            float length = sqrtf(ex * ex + ey * ey + ez * ez);
            ell[j][l] = length;
            at[j + 1][l] = at[j][l] + length;
        }
    }
    FOR_LANES(l) inverse[l] = lane_inverse(at[m - 1][l]);
}

/* Add to d (adjoint of x) what comes through the arc lengths.
 * d_at   [m] adjoint of at
 * d_ell  [m-1] adjoint of the segment lengths themselves, or NULL */
LANES_INLINE void arc_backward(uint32_t m, const lanes *restrict x, const lanes *restrict ell,
                               const lanes *restrict d_at, const lanes *restrict d_ell, lanes *restrict d)
{
    lanes sum = {0}; /* of d_at from here to the tip: each of those arc lengths holds this segment */
    for (uint32_t j = m - 1; j-- > 0;) {
        const lanes *p = x + 3 * j;
        lanes *dp = d + 3 * j;
        FOR_LANES(l)
        {
            sum[l] += d_at[j + 1][l];
            float d_length = d_ell ? sum[l] + d_ell[j][l] : sum[l];
            float scale = d_length * lane_inverse(ell[j][l]);
            float gx = scale * (p[3][l] - p[0][l]), gy = scale * (p[4][l] - p[1][l]), gz = scale * (p[5][l] - p[2][l]);
            dp[3][l] += gx;
            dp[4][l] += gy;
            dp[5][l] += gz;
            dp[0][l] -= gx;
            dp[1][l] -= gy;
            dp[2][l] -= gz;
        }
    }
}

#endif
