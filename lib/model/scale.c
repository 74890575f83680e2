/* Scale: each strand longer or shorter about its root (Chang et al. 2025, Appendix A).
 *   x~_j = x_1 + (1 + eta u)(x_j - x_1); the root is the origin of a block's points. */
#include "model/kernel.h"
#include "model/vec.h"

enum { RANDOM_SCALE };

void scale_factor(const struct kernel_inputs *in, float *factor)
{
    FOR_LANES(l) factor[l] = 1.0f + in->parameter[RANDOM_SCALE] * in->random[0][l];
}

LANES_INLINE void scale_lines(uint32_t n, vec factor, const lanes *restrict x, lanes *restrict y)
{
    for (uint32_t i = 0; i < n; i++)
        vec_store(y[i], factor * vec_load(x[i]));
}

/* Measured anew, for the same bits as where strands are scaled before they are measured (plan_load_scaled). */
LANES_INLINE void scale_forward(const struct kernel_inputs *in, struct bundle x, struct bundle y, lanes *scratch)
{
    lanes factor;
    (void)scratch;
    scale_factor(in, factor);
    scale_lines(3 * in->m, vec_load(factor), (const lanes *)x.points, y.points);
    if (y.at)
        vec_measure(in->m, (const lanes *)y.points, y.at);
}

LANES_INLINE void scale_backward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,
                                 struct kernel_adjoints *adjoints, lanes *restrict scratch)
{
    (void)scratch;
    lanes factor, d_factor = {0};
    FOR_LANES(l) factor[l] = 1.0f + in->parameter[RANDOM_SCALE] * in->random[0][l];
    for (uint32_t i = 0; i < 3 * in->m; i++)
        FOR_LANES(l)
        {
            d_factor[l] += d[i][l] * x[i][l];
            d[i][l] *= factor[l];
        }
    FOR_LANES(l)
    {
        adjoints->parameter[RANDOM_SCALE][l] = d_factor[l] * in->random[0][l];
        adjoints->random[0][l] = d_factor[l] * in->parameter[RANDOM_SCALE];
    }
}

KERNEL_TABLE(scale)
