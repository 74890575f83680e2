#include "fit/strand_error.h"

#include <string.h>

#include "fit/head_planes.h"
#include "model/arc.h"

void strand_error_measure(uint32_t m, struct strand_error_target *target)
{
    memset(target->length, 0, sizeof target->length);
    for (uint32_t j = 0; j + 1 < m; j++) {
        const lanes *p = (const lanes *)target->point + (size_t)3 * j;
        FOR_LANES(l)
        {
            float x = p[3][l] - p[0][l], y = p[4][l] - p[1][l], z = p[5][l] - p[2][l];
            target->length[l] += sqrtf(x * x + y * y + z * z);
        }
    }
}

/* The target's segment at a fraction of arc length, and where in it. */
LANES_INLINE void locate(float fraction, float segments, int32_t *index, float *within)
{
    float at = fraction * segments;
    *index = (int32_t)at_most(at, segments - 0.5f);
    *within = at_most(at - (float)*index, 1.0f);
}

/* Mean square depth in the head. */
LANES_INLINE void measure_depth(uint32_t m, const lanes *restrict x, const lanes *restrict plane, lanes deep)
{
    uint32_t n = head_planes_of(m);
    memset(deep, 0, sizeof(lanes));
    for (uint32_t k = 0; k < n; k++, plane += 4) {
        const lanes *p = x + (size_t)3 * head_plane_vertex(k, m);
        FOR_LANES(l)
        {
            float outside = plane[0][l] * p[0][l] + plane[1][l] * p[1][l] + plane[2][l] * p[2][l] + plane[3][l];
            float in = at_most(outside, 0.0f);
            deep[l] += in * in;
        }
    }
    FOR_LANES(l) deep[l] *= 1.0f / (float)n;
}

/* The target at a fraction of arc length; each lane has a segment of its own. */
LANES_INLINE void point_at(const lanes *restrict point, const lanes at, const lanes inverse, float segments,
                           lanes *restrict out)
{
    int32_t index[LANES];
    lanes within, low[3], high[3];
    FOR_LANES(l) locate(at[l] * inverse[l], segments, &index[l], &within[l]);
    for (int c = 0; c < 3; c++)
        for (int l = 0; l < LANES; l++) {
            low[c][l] = point[3 * index[l] + c][l];
            high[c][l] = point[3 * index[l] + 3 + c][l];
        }
    for (int c = 0; c < 3; c++)
        FOR_LANES(l) out[c][l] = low[c][l] + within[l] * (high[c][l] - low[c][l]);
}

/* Each segment stands beside the target's chord between the same fractions of arc length. (Beside the target's segment
 * at its middle, the error would jump wherever a middle passes a vertex of the target: no slope to follow, and a choice
 * by it would be rounding's.) */
LANES_INLINE void error_body(uint32_t m, const lanes *restrict x, const struct strand_error_target *restrict target,
                             const struct strand_error_weights *weights, lanes *restrict scratch,
                             float *restrict error)
{
    lanes *ell = scratch, *at = scratch + m, inverse, along = {0}, apart = {0}, deep = {0}, end[2][3];
    float segments = (float)(m - 1);
    arc_measure(m, x, ell, at, inverse);
    point_at((const lanes *)target->point, at[0], inverse, segments, end[0]);
    for (uint32_t j = 0; j + 1 < m; j++) {
        const lanes *p = x + (size_t)3 * j, *low = (const lanes *)end[j & 1];
        lanes *high = end[(j + 1) & 1];
        point_at((const lanes *)target->point, at[j + 1], inverse, segments, high);
        FOR_LANES(l)
        {
            float square = 0, dot = 0, chord = 0;
            for (int c = 0; c < 3; c++) {
                float step = high[c][l] - low[c][l];
                float off = 0.5f * ((p[c][l] + p[3 + c][l]) - (low[c][l] + high[c][l]));
                square += off * off;
                chord += step * step;
                dot += (p[3 + c][l] - p[c][l]) * step;
            }
            along[l] += dot * lane_inverse(sqrtf(chord));
            apart[l] += square * ell[j][l];
        }
    }
    if (target->plane)
        measure_depth(m, x, (const lanes *)target->plane, deep);
    FOR_LANES(l)
    {
        float longer = at[m - 1][l] - target->length[l];
        error[l] = weights->direction * (1.0f - along[l] * inverse[l]) + weights->vertex * (apart[l] * inverse[l]) +
                   weights->length * (longer * longer) + weights->depth * deep[l];
    }
}

static void error_baseline(uint32_t m, const lanes *restrict x, const struct strand_error_target *restrict target,
                           const struct strand_error_weights *weights, lanes *restrict scratch, float *restrict error)
{
    error_body(m, x, target, weights, scratch, error);
}

#if defined(__x86_64__)
KERNEL_TARGET_AVX2 static void error_avx2(uint32_t m, const lanes *restrict x,
                                          const struct strand_error_target *restrict target,
                                          const struct strand_error_weights *weights, lanes *restrict scratch,
                                          float *restrict error)
{
    error_body(m, x, target, weights, scratch, error);
}
#endif

void strand_error(enum kernel_variant variant, uint32_t m, const lanes *x, const struct strand_error_target *target,
                  const struct strand_error_weights *weights, lanes *scratch, float *error)
{
#if defined(__x86_64__)
    if (variant == KERNEL_AVX2) {
        error_avx2(m, x, target, weights, scratch, error);
        return;
    }
#endif
    error_baseline(m, x, target, weights, scratch, error);
}
