/* Kernels work on blocks of LANES strands: one lane a strand, structure of arrays.
 *
 * A kernel is an always-inline body in plain C whose innermost loop runs over the lanes, so that the
 * compiler turns it into vector instructions; KERNEL_VARIANTS wraps the body once for each
 * instruction set. No lane looks at another, nothing is contracted into fused multiply-adds, and the
 * functions below are polynomials of our own: a strand's numbers are the same bits whatever the
 * instruction set, its lane and its neighbours. */
#ifndef MODEL_LANES_H
#define MODEL_LANES_H

#include <math.h>
#include <stdint.h>

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

/* 1 / x, or 0 where x is no length. */
LANES_INLINE float lane_inverse(float x)
{
    float safe = x > NO_LENGTH ? x : 1.0f;
    float inverse = 1.0f / safe;
    return x > NO_LENGTH ? inverse : 0.0f;
}

/* e^x for x up to 88, below 2 ulps off (tested); e^-87 for anything less. */
LANES_INLINE float lane_exp(float x)
{
    x = at_least(x, -87.0f);
    float rounded = x * 1.44269504f + ROUNDER;
    float n = rounded - ROUNDER;
    float r = (x - n * 0.693359375f) - n * -2.12194440e-4f;
    float p = 0.00139262038f;
    p = p * r + 0.00836319476f;
    p = p * r + 0.0416665561f;
    p = p * r + 0.166665763f;
    p = p * r + 0.5f;
    p = (p * (r * r) + r) + 1.0f;
    return p * float_of((bits_of(rounded) - bits_of(ROUNDER) + 127) << 23);
}

LANES_INLINE float lane_sigmoid(float x) { return 1.0f / (1.0f + lane_exp(-x)); }

/* Turns, and waves of the noise, beyond which a float no longer tells where in the turn it is. */
#define MANY_TURNS 0x1p20f

/* sin and cos of 2 pi turns for |turns| up to MANY_TURNS, 2e-7 off at most (tested). */
LANES_INLINE void lane_sincos_turns(float turns, float *sine, float *cosine)
{
    float rounded = turns * 4.0f + ROUNDER;
    float r = turns - (rounded - ROUNDER) * 0.25f, z = r * r;
    int32_t quadrant = bits_of(rounded);
    float s = r * (((-75.4016113f * z + 81.5925446f) * z - 41.3416634f) * z + 6.28318548f);
    float c = (((59.4241066f * z - 85.448822f) * z + 64.9393692f) * z - 19.7392082f) * z + 1.0f;
    int32_t swap = -(quadrant & 1), s_bits = bits_of(s), c_bits = bits_of(c);
    int32_t s_sign = (int32_t)((uint32_t)(quadrant & 2) << 30), c_sign = (int32_t)((uint32_t)((quadrant + 1) & 2) << 30);
    *sine = float_of(((c_bits & swap) | (s_bits & ~swap)) ^ s_sign);
    *cosine = float_of(((s_bits & swap) | (c_bits & ~swap)) ^ c_sign);
}

#endif
