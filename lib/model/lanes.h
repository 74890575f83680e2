/* Kernels work on blocks of LANES strands: one lane a strand, structure of arrays.
 *
 * A kernel is an always-inline body in plain C: forward in vectors of the compiler's own (model/vec.h),
 * backward in innermost loops over the lanes that it turns into vectors; KERNEL_VARIANTS wraps the body once for each
 * instruction set. No lane looks at another, nothing is contracted into fused multiply-adds, and the
 * functions below are polynomials of our own: a strand's numbers are the same bits whatever the
 * instruction set, its lane and its neighbours. */
#ifndef MODEL_LANES_H
#define MODEL_LANES_H

#include <math.h>
#include <stdint.h>

/* One vector of AVX2; two of WebAssembly's, whose chains of results are waited for side by side. */
#define LANES 8

/* One number of each strand of a block. Arrays of a block are [..][LANES]; a block's points are
 * lanes x[3 * m], coordinate c of vertex j in x[3 * j + c], relative to the strand's root. */
typedef float lanes[LANES];

#define LANES_INLINE static inline __attribute__((always_inline))

#ifdef __clang__
#pragma clang diagnostic ignored "-Wpass-failed" /* builds that do not optimise vectorise nothing */
#define FOR_LANES(l) _Pragma("clang loop unroll(disable) vectorize(assume_safety) interleave(disable)") for (int l = 0; l < LANES; l++)
#else
#define FOR_LANES(l) _Pragma("GCC ivdep") _Pragma("GCC unroll 1") for (int l = 0; l < LANES; l++)
#endif

/* A length below this (metres) counts as none: its direction is not defined, its derivative is 0. */
#define NO_LENGTH 1e-12f

union lane_bits {
    float f;
    int32_t i;
    uint32_t u;
};

LANES_INLINE int32_t bits_of(float f) { return ((union lane_bits){.f = f}).i; }
LANES_INLINE float float_of(int32_t i) { return ((union lane_bits){.i = i}).f; }

/* 1.5 * 2^23: adding it rounds a float below 2^22 to the nearest whole number, which then stands in
 * the low bits. */
#define ROUNDER 0x1.8p23f

/* x, at most / at least `limit`: one instruction each. */
LANES_INLINE float at_most(float x, float limit) { return x < limit ? x : limit; }
LANES_INLINE float at_least(float x, float limit) { return x > limit ? x : limit; }

/* The largest whole number up to t, |t| below 2^22, and that number as an integer. One instruction finds it
 * where there is one for it; the bits are the same. */
LANES_INLINE float lane_floor(float t, int32_t *whole)
{
#if defined(__wasm_simd128__) || defined(__aarch64__)
    float below = floorf(t);
    *whole = bits_of(below + ROUNDER) - bits_of(ROUNDER);
    return below;
#else
    float rounded = t + ROUNDER, near = rounded - ROUNDER;
    int32_t back = t < near ? -1 : 0;
    *whole = bits_of(rounded) - bits_of(ROUNDER) + back;
    return near - float_of(back & bits_of(1.0f));
#endif
}

/* 1 / x, or 0 where x is no length. */
LANES_INLINE float lane_inverse(float x)
{
    float safe = x > NO_LENGTH ? x : 1.0f;
    float inverse = 1.0f / safe;
    return x > NO_LENGTH ? inverse : 0.0f;
}

#define LOG2_E 1.44269504f

/* Polynomials are macros, for floats and for vectors of them (model/vec.h) alike; z is r r. In Estrin's
 * order, whose halves need not wait for each other. */
#define EXP2_POLYNOMIAL(r, z)                                                                                        \
    ((1.0f + 0.693147004f * (r)) +                                                                                   \
     (z) * ((0.240222424f + 0.0555073358f * (r)) + (z) * (0.00967151299f + 0.0013264725f * (r))))

/* 2^x for x up to 127, below 3 ulps off (tested); 2^-126 for anything less. */
LANES_INLINE float lane_exp2(float x)
{
    x = at_least(x, -126.0f);
    float rounded = x + ROUNDER, r = x - (rounded - ROUNDER), z = r * r, p = EXP2_POLYNOMIAL(r, z);
    return float_of((int32_t)((uint32_t)bits_of(p) + ((uint32_t)bits_of(rounded) << 23))); /* the rounder's own bits leave */
}

/* zeta': how far an operator that sets in at `start` has begun at v, both fractions of arc length:
 * 1 / (1 + e^(-10 (v - start))), the exponent to base 2. */
#define START_STEEPNESS 10.0f
LANES_INLINE float lane_begun(float v, float start)
{
    return 1.0f / (1.0f + lane_exp2((START_STEEPNESS * LOG2_E) * (start - v)));
}

/* e^(10 start): what the kernels that keep e^(-10 v) need besides. start is 0 to 1. */
LANES_INLINE float lane_rise(float start) { return lane_exp2((START_STEEPNESS * LOG2_E) * start); }

/* Turns, and waves of the noise, beyond which a float no longer tells where in the turn it is. */
#define MANY_TURNS 0x1p20f

/* sin and cos of 2 pi turns for |turns| up to MANY_TURNS, 2e-7 off at most (tested): reduced to a
 * quarter of a turn on either side of a whole or half one. */
#define SINE_POLYNOMIAL(r, z)                                                                                        \
    (((r) * (z)) * ((2.55003142f * (z) - 5.16770696f) + ((z) * (z)) * (0.0772201261f * (z) - 0.59804517f)) + (r) * 3.14159251f)
#define COSINE_POLYNOMIAL(z)                                                                                         \
    ((1.0f - 4.93479538f * (z)) + ((z) * (z)) * ((4.05845118f - 1.33209383f * (z)) + 0.220080629f * ((z) * (z))))
LANES_INLINE void lane_sincos_turns(float turns, float *sine, float *cosine)
{
    float halves = turns * 2.0f, rounded = halves + ROUNDER;
    float r = halves - (rounded - ROUNDER), z = r * r;
    int32_t sign = (int32_t)((uint32_t)bits_of(rounded) << 31);
    *sine = float_of(bits_of(SINE_POLYNOMIAL(r, z)) ^ sign);
    *cosine = float_of(bits_of(COSINE_POLYNOMIAL(z)) ^ sign);
}

#endif
