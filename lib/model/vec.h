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

/* table[index] and table[index + 1] of each lane: eight bytes a lane. */
LANES_INLINE void vec_pairs(const float *restrict table, ivec index, vec *restrict low, vec *restrict high)
{
    lanes even, odd;
    for (int l = 0; l < LANES; l += QUAD) {
        quad a = quad_of_pairs(table + index[l], table + index[l + 1]);
        quad b = quad_of_pairs(table + index[l + 2], table + index[l + 3]);
        quad_store(even + l, __builtin_shufflevector(a, b, 0, 2, 4, 6));
        quad_store(odd + l, __builtin_shufflevector(a, b, 1, 3, 5, 7));
    }
    *low = vec_load(even);
    *high = vec_load(odd);
}

/* --- the functions of model/lanes.h and model/noise.h ---------------------------------------- */

LANES_INLINE vec vec_inverse(vec x)
{
    ivec is_length = x > NO_LENGTH;
    return (vec)((ivec)(1.0f / vec_choose(is_length, x, vec_of(1.0f))) & is_length);
}

LANES_INLINE vec vec_exp2(vec x)
{
    x = vec_at_least(x, -126.0f);
    vec rounded = x + ROUNDER, r = x - (rounded - ROUNDER), z = r * r;
    return (vec)((ivec)EXP2_POLYNOMIAL(r, z) + (ivec)((uvec)rounded << 23));
}

LANES_INLINE vec vec_begun(vec v, float start)
{
    return 1.0f / (1.0f + vec_exp2((START_STEEPNESS * LOG2_E) * (start - v)));
}

LANES_INLINE void vec_sincos_turns(vec turns, vec *sine, vec *cosine)
{
    vec halves = turns * 2.0f, rounded = halves + ROUNDER;
    vec r = halves - (rounded - ROUNDER), z = r * r;
    ivec sign = (ivec)((uvec)rounded << 31);
    *sine = (vec)((ivec)SINE_POLYNOMIAL(r, z) ^ sign);
    *cosine = (vec)((ivec)COSINE_POLYNOMIAL(z) ^ sign);
}

LANES_INLINE vec vec_noise_gradient(ivec stepped)
{
    uvec h = (uvec)stepped;
    h = (h ^ h >> 15) * 0x85ebca77u;
    vec size = __builtin_convertvector((ivec)(h >> 8 & 0x7fffffu), vec) * (0.71875f * 0x1p-23f) + 0.28125f;
    return (vec)((ivec)size ^ (ivec)(h & 0x80000000u));
}

/* The gradients on either side of a cell: out of the table, or hashed where there is none. */
LANES_INLINE void vec_gradients(const float *table, ivec cell, vec *low, vec *high)
{
    if (table) {
        vec_pairs(table, cell, low, high);
        return;
    }
    ivec stepped = (ivec)((uvec)cell * NOISE_STEP);
    *low = vec_noise_gradient(stepped);
    *high = vec_noise_gradient((ivec)((uvec)stepped + NOISE_STEP));
}

LANES_INLINE vec vec_noise(const float *table, vec t)
{
    ivec cell;
    vec f = t - vec_floor(t, &cell), low, high;
    vec_gradients(table, cell, &low, &high);
    vec a = low * f, b = high * (f - 1.0f);
    return a + NOISE_FADE(f) * (b - a);
}

/* table: noise_fill's, where all cells of t and 2 t are in it; or NULL */
LANES_INLINE vec vec_epsilon(const float *table, vec t)
{
    vec coarse = vec_noise(table, t), fine = vec_noise(table, 2.0f * t);
    return NOISE_OCTAVES(coarse, fine);
}

/* --- arc length --------------------------------------------------------------------------------- */

/* at[j], j < m: arc length from the root to vertex j; arc_measure's, without the segments.
 * returns  1 / length of the strand, 0 where it has none */
LANES_INLINE vec vec_arc(uint32_t m, const lanes *restrict x, lanes *restrict at)
{
    vec px = vec_load(x[0]), py = vec_load(x[1]), pz = vec_load(x[2]), sum = {0};
    vec_store(at[0], sum);
    for (uint32_t j = 1; j < m; j++) {
        vec qx = vec_load(x[3 * j]), qy = vec_load(x[3 * j + 1]), qz = vec_load(x[3 * j + 2]);
        vec ex = qx - px, ey = qy - py, ez = qz - pz;
        sum += vec_sqrt(ex * ex + ey * ey + ez * ez);
        vec_store(at[j], sum);
        px = qx, py = qy, pz = qz;
    }
    return vec_inverse(sum);
}

LANES_INLINE void vec_copy_root(const lanes *restrict x, lanes *restrict y)
{
    for (int c = 0; c < 3; c++)
        vec_store(y[c], vec_load(x[c]));
}

#endif
