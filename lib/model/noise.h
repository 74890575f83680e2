/* The frizz operator's noise: one-dimensional gradient noise (Perlin 1985).
 *
 * All of this is part of what a groom document means and never changes:
 *   hash(i)      h = (uint32)i * 0x9e3779b1; h ^= h >> 15; h *= 0x85ebca77   (modulo 2^32)
 *   gradient(i)  9/32 + 23/32 k / 2^23, where k is bits 8..30 of hash(i); negative where bit 31 is set.
 *                In [-1, 1], and the mean square 0.4535 makes a strand's displacement, over the three
 *                axes, 0.10 of the amplitude (root mean square)
 *   fade(f)      6 f^5 - 15 f^4 + 10 f^3
 *   noise(t)     i = floor(t), f = t - i, a = gradient(i) f, b = gradient(i + 1) (f - 1):
 *                a + fade(f) (b - a)
 *   epsilon^c    2/3 (noise(chi + xi^c) + 1/3 noise(2 (chi + xi^c)))
 *   xi           0 for x, 37.3125 for y, 71.6875 for z (exact in binary; their fractions differ, so
 *                that the three coordinates do not come to rest at the same points of a strand) */
#ifndef MODEL_NOISE_H
#define MODEL_NOISE_H

#include "model/lanes.h"

#define NOISE_OFFSETS {0.0f, 37.3125f, 71.6875f}

#define NOISE_STEP 0x9e3779b1u

/* Of i * NOISE_STEP, so that neighbours cost one addition. */
LANES_INLINE uint32_t noise_hash(uint32_t stepped) { return (stepped ^ stepped >> 15) * 0x85ebca77u; }

LANES_INLINE float noise_gradient(uint32_t stepped)
{
    uint32_t h = noise_hash(stepped);
    float size = (float)(int32_t)(h >> 8 & 0x7fffffu) * (0.71875f * 0x1p-23f) + 0.28125f;
    return float_of(bits_of(size) ^ (int32_t)(h & 0x80000000u));
}

struct noise_cell {
    float f, a, b, low, high; /* place in the cell, the two ramps there, their slopes */
};

LANES_INLINE struct noise_cell noise_ramps(float f, float low, float high)
{
    return (struct noise_cell){f, low * f, high * (f - 1.0f), low, high};
}

/* |t| up to 2^21. */
LANES_INLINE struct noise_cell noise_cell_of(float t)
{
    int32_t cell;
    float f = t - lane_floor(t, &cell);
    uint32_t stepped = (uint32_t)cell * NOISE_STEP;
    return noise_ramps(f, noise_gradient(stepped), noise_gradient(stepped + NOISE_STEP));
}

/* Macros, for floats and for vectors of them (model/vec.h) alike. */
#define NOISE_FADE(f) ((f) * (f) * (f) * ((f) * ((f) * 6.0f - 15.0f) + 10.0f))
#define NOISE_OCTAVES(coarse, fine) ((2.0f / 3.0f) * (coarse) + (2.0f / 9.0f) * (fine))

LANES_INLINE float noise_blend(struct noise_cell cell) { return cell.a + NOISE_FADE(cell.f) * (cell.b - cell.a); }

LANES_INLINE float noise_value(float t) { return noise_blend(noise_cell_of(t)); }

/* d noise / dt, and the noise itself. */
LANES_INLINE float noise_slope(float t, float *value)
{
    struct noise_cell cell = noise_cell_of(t);
    float f = cell.f, fade = NOISE_FADE(f), fade_slope = 30.0f * (f * f) * ((f - 1.0f) * (f - 1.0f));
    *value = noise_blend(cell);
    return cell.low + fade * (cell.high - cell.low) + fade_slope * (cell.b - cell.a);
}

/* epsilon of one axis at chi + xi, and its slope. */
LANES_INLINE float noise_epsilon(float t)
{
    return NOISE_OCTAVES(noise_value(t), noise_value(2.0f * t));
}

LANES_INLINE float noise_epsilon_slope(float t, float *epsilon)
{
    float coarse, fine;
    float slope = noise_slope(t, &coarse) + (2.0f / 3.0f) * noise_slope(2.0f * t, &fine);
    *epsilon = NOISE_OCTAVES(coarse, fine);
    return (2.0f / 3.0f) * slope;
}

/* --- epsilon looked up ---------------------------------------------------------------- */

/* Evaluations take epsilon from a table of cubics, which costs one load of four numbers where the two octaves
 * cost four hashes: NOISE_PIECES to a cell, each through epsilon at both ends and at two places between, so that it
 * is continuous; NOISE_TOLERANCE off at most (tested), as far as a float of chi tells. The offsets of the axes
 * are whole numbers of pieces: one place among the pieces serves all three. Gradients take epsilon itself. */
#define NOISE_PIECES 16
#define NOISE_TOLERANCE 2e-5f
#define NOISE_OFFSET_Y 597
#define NOISE_OFFSET_Z 1147
#define NOISE_NEAR 96 /* chi from 0 to below this is looked up, on all axes */
#define NOISE_TABLE ((NOISE_NEAR + 72) * NOISE_PIECES)

/* [NOISE_TABLE]: epsilon(t) = c0 + f (c1 + f (c2 + f c3)) in piece floor(NOISE_PIECES t), f the fraction. One for all,
 * worked out once in a process: that takes as long as some hundred strands. From any thread. */
const float (*noise_table(void))[4];

#endif
