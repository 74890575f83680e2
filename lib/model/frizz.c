/* Frizz: noise along each strand (Chang et al. 2025, Appendix A; the noise itself: model/noise.h).
 *   chi_j = omega s_j + 10 u (s_j: arc length),  x~_j = x_j + alpha/2 epsilon(chi_j), not at the root. */
#include "model/arc.h"
#include "model/kernel.h"
#include "model/noise.h"
#include "model/vec.h"

enum { FREQUENCY, AMPLITUDE };

#define RANDOM_SHIFT 10.0f

LANES_INLINE float place_in_noise(float frequency, float at, float u)
{
    return at_most(frequency * at, MANY_TURNS) + RANDOM_SHIFT * u;
}

/* chi grows from the root on, so that the root and the tip tell for all. */
LANES_INLINE int all_cells_known(const float *restrict u, const float *restrict length, float frequency)
{
    int known = 1;
    for (int l = 0; l < LANES; l++)
        known &= u[l] >= 0.0f && noise_is_near(place_in_noise(frequency, length[l], u[l]));
    return known;
}

/* Vertices beyond the root. */
LANES_INLINE void frizz_vertices(const struct kernel_inputs *in, const float *table, const lanes *restrict x,
                                 const lanes *restrict at, lanes *restrict y)
{
    const float offset[3] = NOISE_OFFSETS;
    float frequency = in->parameter[FREQUENCY], half = 0.5f * in->parameter[AMPLITUDE];
    vec shift = RANDOM_SHIFT * vec_load(in->random[0]);
    for (uint32_t j = 1; j < in->m; j++) {
        vec chi = vec_at_most(frequency * vec_load(at[j]), MANY_TURNS) + shift;
        for (uint32_t c = 0; c < 3; c++)
            vec_store(y[3 * j + c], vec_load(x[3 * j + c]) + half * vec_epsilon(table, chi + offset[c]));
    }
}

LANES_INLINE void frizz_forward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict y,
                                lanes *restrict scratch)
{
    lanes *at = scratch;
    vec_arc(in->m, x, at);
    vec_copy_root(x, y);
    if (NOISE_LOOKED_UP && all_cells_known(in->random[0], at[in->m - 1], in->parameter[FREQUENCY]))
        frizz_vertices(in, in->noise, x, at, y);
    else
        frizz_vertices(in, NULL, x, at, y);
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

void noise_fill(float gradient[NOISE_CELLS + 1])
{
    for (uint32_t i = 0; i <= NOISE_CELLS; i++)
        gradient[i] = noise_gradient(i * NOISE_STEP);
}

KERNEL_TABLE(frizz)
