/* Clump: strands close in on their operator guide towards the tip (Chang et al. 2025, Appendix A).
 *   a'_j = 1 - exp(-a v_j),  x~_j = (1 - a'_j) x_j + a'_j g_j, vertex by vertex. */
#include "model/arc.h"
#include "model/kernel.h"
#include "model/vec.h"

enum { PROFILE };

LANES_INLINE void clump_forward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict y,
                                lanes *restrict scratch)
{
    lanes *at = scratch;
    vec inverse = vec_arc(in->m, x, at);
    vec root[3] = {vec_load(in->root[0]), vec_load(in->root[1]), vec_load(in->root[2])};
    float rate = -LOG2_E * in->parameter[PROFILE];
    for (uint32_t j = 0; j < in->m; j++) {
        vec a = 1.0f - vec_exp2(rate * (vec_load(at[j]) * inverse));
        for (uint32_t c = 0; c < 3; c++) {
            uint32_t i = 3 * j + c;
            vec p = vec_load(x[i]), g = vec_load(in->guide[i]) - root[c];
            vec_store(y[i], p + a * (g - p));
        }
    }
}

LANES_INLINE void clump_backward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,
                                 struct kernel_adjoints *adjoints, lanes *restrict scratch)
{
    uint32_t m = in->m;
    lanes *ell = scratch, *at = scratch + m, *d_at = scratch + 2 * m, inverse, d_length = {0}, d_profile = {0};
    float profile = in->parameter[PROFILE], rate = -LOG2_E * profile;
    arc_measure(m, x, ell, at, inverse);
    for (uint32_t j = 0; j < m; j++) {
        const lanes *p = x + 3 * j, *g = in->guide + 3 * j;
        lanes *dp = d + 3 * j, *dg = adjoints->guide + 3 * j;
        FOR_LANES(l)
        {
            float v = at[j][l] * inverse[l], rest = lane_exp2(rate * v), a = 1.0f - rest;
            float dx = dp[0][l], dy = dp[1][l], dz = dp[2][l];
            float gx = g[0][l] - in->root[0][l], gy = g[1][l] - in->root[1][l], gz = g[2][l] - in->root[2][l];
            float d_a = dx * (gx - p[0][l]) + dy * (gy - p[1][l]) + dz * (gz - p[2][l]);
            float d_v = d_a * rest * profile;
            d_profile[l] += d_a * rest * v;
            d_at[j][l] = d_v * inverse[l];
            d_length[l] -= d_v * v * inverse[l];
            dg[0][l] += a * dx;
            dg[1][l] += a * dy;
            dg[2][l] += a * dz;
            dp[0][l] = dx - a * dx;
            dp[1][l] = dy - a * dy;
            dp[2][l] = dz - a * dz;
        }
    }
    FOR_LANES(l)
    {
        d_at[m - 1][l] += d_length[l];
        adjoints->parameter[PROFILE][l] = d_profile[l];
    }
    arc_backward(m, x, ell, d_at, NULL, d);
}

KERNEL_TABLE(clump)
