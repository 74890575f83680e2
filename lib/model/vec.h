/* A block's line as one vector of the compiler's own type: what forward kernels are written in, for loops
 * over lanes keep a loop where the block is as wide as the processor's vectors. Element by element and in
 * the same order as the functions of model/lanes.h: the same bits (tested). */
#ifndef MODEL_VEC_H
#define MODEL_VEC_H

#include "model/noise.h"
#include "model/quad.h"

#ifdef __wasm_simd128__
#include <wasm_simd128.h>
#endif

typedef float vec __attribute__((vector_size(4 * LANES)));
typedef int32_t ivec __attribute__((vector_size(4 * LANES)));
typedef uint32_t uvec __attribute__((vector_size(4 * LANES)));

LANES_INLINE vec vec_load(const float *from)
{
    vec v;
    memcpy(&v, from, sizeof v);
    return v;
}

LANES_INLINE void vec_store(float *to, vec v) { memcpy(to, &v, sizeof v); }

LANES_INLINE vec vec_of(float f) { return (vec){0} + f; }

LANES_INLINE vec vec_choose(ivec where, vec a, vec b) { return (vec)(((ivec)a & where) | ((ivec)b & ~where)); }

#ifdef __wasm_simd128__

/* What has an instruction of its own there, and no operator in C. */
#define VEC_BY_QUADS(name, expression)                                                                               \
    LANES_INLINE vec name(vec x, float limit)                                                                        \
    {                                                                                                                \
        v128_t q[LANES / QUAD], bound = wasm_f32x4_splat(limit);                                                     \
        (void)bound;                                                                                                 \
        memcpy(q, &x, sizeof x);                                                                                     \
        for (int i = 0; i < LANES / QUAD; i++)                                                                       \
            q[i] = expression;                                                                                       \
        memcpy(&x, q, sizeof x);                                                                                     \
        return x;                                                                                                    \
    }
VEC_BY_QUADS(vec_at_most, wasm_f32x4_pmin(bound, q[i]))
VEC_BY_QUADS(vec_at_least, wasm_f32x4_pmax(bound, q[i]))
VEC_BY_QUADS(vec_root, wasm_f32x4_sqrt(q[i]))
VEC_BY_QUADS(vec_below, wasm_f32x4_floor(q[i]))

LANES_INLINE vec vec_sqrt(vec x) { return vec_root(x, 0); }

/* The largest whole number up to t, |t| below 2^22, and that number as an integer. */
LANES_INLINE vec vec_floor(vec t, ivec *whole)
{
    vec below = vec_below(t, 0);
    *whole = (ivec)(below + ROUNDER) - bits_of(ROUNDER);
    return below;
}

#else

LANES_INLINE vec vec_at_most(vec x, float limit) { return vec_choose(x < limit, x, vec_of(limit)); }

LANES_INLINE vec vec_at_least(vec x, float limit) { return vec_choose(x > limit, x, vec_of(limit)); }

LANES_INLINE vec vec_sqrt(vec x)
{
    for (int l = 0; l < LANES; l++)
        x[l] = sqrtf(x[l]);
    return x;
}

LANES_INLINE vec vec_floor(vec t, ivec *whole)
{
    vec rounded = t + ROUNDER, near = rounded - ROUNDER;
    ivec back = t < near; /* -1 or 0 */
    *whole = (ivec)rounded - bits_of(ROUNDER) + back;
    return near - (vec)(back & bits_of(1.0f));
}

#endif

LANES_INLINE vec vec_two(const float *first, const float *second)
{
    return __builtin_shufflevector(quad_load(first), quad_load(second), 0, 1, 2, 3, 4, 5, 6, 7);
}

/* Rows of four floats, one a lane, `skip` rows further: side by side, number k of each in c[k]. */
LANES_INLINE void vec_fours(const float (*const row[LANES])[QUAD], uint32_t skip, vec c[QUAD])
{
    vec q = vec_two(row[0][skip], row[4][skip]), r = vec_two(row[1][skip], row[5][skip]);
    vec s = vec_two(row[2][skip], row[6][skip]), t = vec_two(row[3][skip], row[7][skip]);
    vec qr = __builtin_shufflevector(q, r, 0, 8, 1, 9, 4, 12, 5, 13);
    vec qr_high = __builtin_shufflevector(q, r, 2, 10, 3, 11, 6, 14, 7, 15);
    vec st = __builtin_shufflevector(s, t, 0, 8, 1, 9, 4, 12, 5, 13);
    vec st_high = __builtin_shufflevector(s, t, 2, 10, 3, 11, 6, 14, 7, 15);
    c[0] = __builtin_shufflevector(qr, st, 0, 1, 8, 9, 4, 5, 12, 13);
    c[1] = __builtin_shufflevector(qr, st, 2, 3, 10, 11, 6, 7, 14, 15);
    c[2] = __builtin_shufflevector(qr_high, st_high, 0, 1, 8, 9, 4, 5, 12, 13);
    c[3] = __builtin_shufflevector(qr_high, st_high, 2, 3, 10, 11, 6, 7, 14, 15);
}

/* --- the functions of model/lanes.h and model/noise.h ---------------------------------------- */

LANES_INLINE vec vec_inverse(vec x)
{
    ivec is_length = x > NO_LENGTH;
    return (vec)((ivec)(1.0f / vec_choose(is_length, x, vec_of(1.0f))) & is_length);
}

/* 2^x for x from -126 to 127. */
LANES_INLINE vec vec_exp2_near(vec x)
{
    vec rounded = x + ROUNDER, r = x - (rounded - ROUNDER), z = r * r;
    return (vec)((uvec)EXP2_POLYNOMIAL(r, z) + ((uvec)rounded << 23)); /* as in lanes.h: the rounder's own bits leave */
}

LANES_INLINE vec vec_exp2(vec x) { return vec_exp2_near(vec_at_least(x, -126.0f)); }

/* zeta' in two steps, of which the first serves all operators on the same strands:
 * fallen[j] = e^(-10 v_j), then 1 / (1 + e^(10 start) fallen). */
LANES_INLINE void vec_fall(uint32_t m, const lanes *restrict at, lanes *restrict fallen)
{
    vec slope = (-START_STEEPNESS * LOG2_E) * vec_inverse(vec_load(at[m - 1]));
    for (uint32_t j = 0; j < m; j++)
        vec_store(fallen[j], vec_exp2_near(slope * vec_load(at[j])));
}

LANES_INLINE vec vec_begun(float rise, vec fallen) { return 1.0f / (1.0f + rise * fallen); }

/* Of pi halves, |halves| up to 1/2; then up to twice MANY_TURNS. */
LANES_INLINE void vec_sincos_near(vec halves, vec *sine, vec *cosine)
{
    vec z = halves * halves;
    *sine = SINE_POLYNOMIAL(halves, z);
    *cosine = COSINE_POLYNOMIAL(z);
}

LANES_INLINE void vec_sincos_halves(vec halves, vec *sine, vec *cosine)
{
    vec rounded = halves + ROUNDER;
    ivec sign = (ivec)((uvec)rounded << 31);
    vec_sincos_near(halves - (rounded - ROUNDER), sine, cosine);
    *sine = (vec)((ivec)*sine ^ sign);
    *cosine = (vec)((ivec)*cosine ^ sign);
}

LANES_INLINE vec vec_noise_gradient(ivec stepped)
{
    uvec h = (uvec)stepped;
    h = (h ^ h >> 15) * 0x85ebca77u;
    vec size = __builtin_convertvector((ivec)(h >> 8 & 0x7fffffu), vec) * (0.71875f * 0x1p-23f) + 0.28125f;
    return (vec)((ivec)size ^ (ivec)(h & 0x80000000u));
}

LANES_INLINE vec vec_noise(vec t)
{
    ivec cell;
    vec f = t - vec_floor(t, &cell);
    ivec stepped = (ivec)((uvec)cell * NOISE_STEP);
    vec a = vec_noise_gradient(stepped) * f, b = vec_noise_gradient((ivec)((uvec)stepped + NOISE_STEP)) * (f - 1.0f);
    return a + NOISE_FADE(f) * (b - a);
}

LANES_INLINE vec vec_epsilon(vec t)
{
    vec coarse = vec_noise(t), fine = vec_noise(2.0f * t);
    return NOISE_OCTAVES(coarse, fine);
}

/* --- arc length --------------------------------------------------------------------------------- */

/* at[j], j < m: arc length from the root to vertex j. */
LANES_INLINE void vec_measure(uint32_t m, const lanes *restrict x, lanes *restrict at)
{
    vec px = vec_load(x[0]), py = vec_load(x[1]), pz = vec_load(x[2]), length = {0};
    vec_store(at[0], length);
    for (uint32_t j = 1; j < m; j++) {
        vec qx = vec_load(x[3 * j]), qy = vec_load(x[3 * j + 1]), qz = vec_load(x[3 * j + 2]);
        vec ex = qx - px, ey = qy - py, ez = qz - pz;
        length += vec_sqrt(ex * ex + ey * ey + ez * ez);
        vec_store(at[j], length);
        px = qx, py = qy, pz = qz;
    }
}

LANES_INLINE void vec_copy_root(const lanes *restrict x, lanes *restrict y)
{
    for (int c = 0; c < 3; c++)
        vec_store(y[c], vec_load(x[c]));
}

#endif
