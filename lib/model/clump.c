/* Clump: strands close in on their operator guide towards the tip (Chang et al. 2025, Appendix A).
 *   a'_j = 1 - exp(-a v_j),  x~_j = (1 - a'_j) x_j + a'_j g_j, vertex by vertex. */
#include "model/arc.h"
#include "model/kernel.h"
#include "model/vec.h"

enum { PROFILE };

LANES_INLINE void clump_vertices(const struct kernel_inputs *in, const lanes *restrict x, const lanes *restrict at,
                                 lanes *restrict y)
{
    vec root[3] = {vec_load(in->root[0]), vec_load(in->root[1]), vec_load(in->root[2])};
    vec rate = -LOG2_E * in->parameter[PROFILE] * vec_inverse(vec_load(at[in->m - 1]));
    vec_copy_root(x, y);
    for (uint32_t j = 1; j < in->m; j++) {
        const lanes *p = x + 3 * j, *g = in->guide + 3 * j;
        lanes *q = y + 3 * j;
        vec a = 1.0f - vec_exp2(rate * vec_load(at[j]));
        vec px = vec_load(p[0]), py = vec_load(p[1]), pz = vec_load(p[2]);
        vec_store(q[0], px + a * (vec_load(g[0]) - root[0] - px));
        vec_store(q[1], py + a * (vec_load(g[1]) - root[1] - py));
        vec_store(q[2], pz + a * (vec_load(g[2]) - root[2] - pz));
    }
}

LANES_INLINE void clump_forward(const struct kernel_inputs *in, struct bundle x, struct bundle y, lanes *scratch)
{
    (void)scratch;
    clump_vertices(in, (const lanes *)x.points, (const lanes *)x.at, y.points);
    if (y.at)
        vec_measure(in->m, (const lanes *)y.points, y.at);
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
