/* Frizz: noise along each strand (Chang et al. 2025, Appendix A; the noise itself: model/noise.h).
 *   chi_j = omega s_j + 10 u (s_j: arc length),  x~_j = x_j + alpha/2 epsilon(chi_j), not at the root. */
#include "model/arc.h"
#include "model/kernel.h"
#include "model/noise.h"

enum { FREQUENCY, AMPLITUDE };

#define RANDOM_SHIFT 10.0f

LANES_INLINE float place_in_noise(float frequency, float at, float u)
{
    return at_most(frequency * at, MANY_TURNS) + RANDOM_SHIFT * u;
}

LANES_INLINE void frizz_forward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict y,
                                lanes *restrict scratch)
{
    uint32_t m = in->m;
    const float offset[3] = NOISE_OFFSETS;
    lanes *ell = scratch, *at = scratch + m, inverse;
    float frequency = in->parameter[FREQUENCY], half = 0.5f * in->parameter[AMPLITUDE];
    arc_measure(m, x, ell, at, inverse);
    for (int c = 0; c < 3; c++) {
        FOR_LANES(l) y[c][l] = x[c][l];
        for (uint32_t j = 1; j < m; j++)
            FOR_LANES(l)
            {
                float chi = place_in_noise(frequency, at[j][l], in->random[0][l]);
                y[3 * j + c][l] = x[3 * j + c][l] + half * noise_epsilon(chi + offset[c]);
            }
    }
}

LANES_INLINE void frizz_backward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,
                                 struct kernel_adjoints *adjoints, lanes *restrict scratch)
{
    uint32_t m = in->m;
    const float offset[3] = NOISE_OFFSETS;
    lanes *ell = scratch, *at = scratch + m, *d_chi = scratch + 2 * m, inverse;
    lanes d_frequency = {0}, d_half = {0}, d_shift = {0};
    float frequency = in->parameter[FREQUENCY], half = 0.5f * in->parameter[AMPLITUDE];
    arc_measure(m, x, ell, at, inverse);
    for (uint32_t j = 0; j < m; j++)
        FOR_LANES(l) d_chi[j][l] = 0.0f;
    for (int c = 0; c < 3; c++)
        for (uint32_t j = 1; j < m; j++)
            FOR_LANES(l)
            {
                float chi = place_in_noise(frequency, at[j][l], in->random[0][l]), epsilon;
                float slope = noise_epsilon_slope(chi + offset[c], &epsilon), dy = d[3 * j + c][l];
                d_half[l] += dy * epsilon;
                d_chi[j][l] += half * dy * slope;
            }
    for (uint32_t j = 1; j < m; j++)
        FOR_LANES(l)
        {
            d_frequency[l] += d_chi[j][l] * at[j][l];
            d_shift[l] += d_chi[j][l];
            d_chi[j][l] *= frequency; /* now the adjoint of at */
        }
    FOR_LANES(l)
    {
        adjoints->parameter[FREQUENCY][l] = d_frequency[l];
        adjoints->parameter[AMPLITUDE][l] = 0.5f * d_half[l];
        adjoints->random[0][l] = RANDOM_SHIFT * d_shift[l];
    }
    arc_backward(m, x, ell, d_chi, NULL, d);
}

KERNEL_TABLE(frizz)
