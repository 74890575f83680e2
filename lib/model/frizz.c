/* Frizz: noise along each strand (Chang et al. 2025, Appendix A; the noise itself: model/noise.h).
 *   chi_j = omega s_j + 10 u (s_j: arc length),  x~_j = x_j + alpha/2 epsilon(chi_j), not at the root.
 * epsilon's coordinates are along the groom's axes. */
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
LANES_INLINE int all_near(const float *restrict u, const float *restrict length, float frequency)
{
    int near = 1;
    for (int l = 0; l < LANES; l++)
        near &= u[l] >= 0.0f && place_in_noise(frequency, length[l], u[l]) < (float)NOISE_NEAR;
    return near;
}

/* Where chi lies in the table. */
struct noise_place {
    const float (*cubic[LANES])[QUAD];
    vec f; /* in the piece */
};

LANES_INLINE struct noise_place noise_place_of(const float (*table)[QUAD], vec chi)
{
    struct noise_place place;
    ivec piece;
    vec pieces = (float)NOISE_PIECES * chi;
    place.f = pieces - vec_floor(pieces, &piece);
    piece *= (int)sizeof *table; /* bytes, for all lanes at once */
#define CUBIC(l) place.cubic[l] = (const float(*)[QUAD])((const char *)table + piece[l])
    CUBIC(0), CUBIC(1), CUBIC(2), CUBIC(3), CUBIC(4), CUBIC(5), CUBIC(6), CUBIC(7); /* no loop: registers */
#undef CUBIC
    return place;
}

LANES_INLINE vec noise_cubic(const struct noise_place *place, uint32_t skip)
{
    vec c[QUAD], f = place->f;
    vec_fours(place->cubic, skip, c);
    return c[0] + f * (c[1] + f * (c[2] + f * c[3]));
}

/* x~ = x + alpha/2 (what the axes make of epsilon). */
LANES_INLINE void shift_vertex(const float (*axes)[3], float half, const vec epsilon[3], const lanes *restrict p, lanes *restrict q)
{
    for (int c = 0; c < 3; c++) {
        vec shift = axes ? axes[0][c] * epsilon[0] + axes[1][c] * epsilon[1] + axes[2][c] * epsilon[2] : epsilon[c];
        vec_store(q[c], vec_load(p[c]) + half * shift);
    }
}

/* All vertices are near. */
LANES_INLINE void frizz_near(const struct kernel_inputs *in, const lanes *restrict x, const lanes *restrict at,
                             lanes *restrict y)
{
    float frequency = in->parameter[FREQUENCY], half = 0.5f * in->parameter[AMPLITUDE];
    vec shift = RANDOM_SHIFT * vec_load(in->random[0]);
    for (uint32_t j = 1; j < in->m; j++) {
        struct noise_place place = noise_place_of(in->noise, frequency * vec_load(at[j]) + shift);
        const vec epsilon[3] = {noise_cubic(&place, 0), noise_cubic(&place, NOISE_OFFSET_Y), noise_cubic(&place, NOISE_OFFSET_Z)};
        shift_vertex(in->axes, half, epsilon, x + 3 * j, y + 3 * j);
    }
}

/* The same where some are not: those get epsilon itself. */
LANES_INLINE void frizz_far(const struct kernel_inputs *in, const lanes *restrict x, const lanes *restrict at,
                            lanes *restrict y)
{
    const float offset[3] = NOISE_OFFSETS;
    const uint32_t skip[3] = {0, NOISE_OFFSET_Y, NOISE_OFFSET_Z};
    float frequency = in->parameter[FREQUENCY], half = 0.5f * in->parameter[AMPLITUDE];
    vec shift = RANDOM_SHIFT * vec_load(in->random[0]);
    for (uint32_t j = 1; j < in->m; j++) {
        vec chi = vec_at_most(frequency * vec_load(at[j]), MANY_TURNS) + shift;
        ivec near = (chi >= 0.0f) & (chi < (float)NOISE_NEAR);
        struct noise_place place = noise_place_of(in->noise, (vec)((ivec)chi & near));
        vec epsilon[3];
        for (uint32_t c = 0; c < 3; c++)
            epsilon[c] = vec_choose(near, noise_cubic(&place, skip[c]), vec_epsilon(chi + offset[c]));
        shift_vertex(in->axes, half, epsilon, x + 3 * j, y + 3 * j);
    }
}

LANES_INLINE void frizz_forward(const struct kernel_inputs *in, struct bundle x, struct bundle y, lanes *scratch)
{
    const lanes *points = (const lanes *)x.points, *at = (const lanes *)x.at;
    (void)scratch;
    vec_copy_root(points, y.points);
    if (all_near(in->random[0], at[in->m - 1], in->parameter[FREQUENCY]))
        frizz_near(in, points, at, y.points);
    else
        frizz_far(in, points, at, y.points);
    if (y.at)
        vec_measure(in->m, (const lanes *)y.points, y.at);
}

/* The adjoint of what noise does along axis `a`; d [3] of a vertex. */
LANES_INLINE void adjoint_along(const float (*axes)[3], int a, const lanes *restrict d, float *restrict along)
{
    if (!axes) {
        FOR_LANES(l) along[l] = d[a][l];
        return;
    }
    FOR_LANES(l) along[l] = axes[a][0] * d[0][l] + axes[a][1] * d[1][l] + axes[a][2] * d[2][l];
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
        for (uint32_t j = 1; j < m; j++) {
            lanes dy;
            adjoint_along(in->axes, c, d + 3 * j, dy);
            FOR_LANES(l)
            {
                float chi = place_in_noise(frequency, at[j][l], in->random[0][l]), epsilon;
                float slope = noise_epsilon_slope(chi + offset[c], &epsilon);
                d_half[l] += dy[l] * epsilon;
                d_chi[j][l] += half * dy[l] * slope;
            }
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
