/* Curl: strands wind around their operator guide (Chang et al. 2025, Appendix A).
 *   w' = max(frequency + random_frequency u1, 0) turns a metre, turn_j = s_j w' + 3.9 u2,
 *   rho'_j = rho (0.43 + 0.79 v_j), zeta'_j = sigmoid(10 (v_j - zeta)),
 *   x~_j = x_j + zeta'_j rho'_j (sin(2 pi turn_j) n_j + cos(2 pi turn_j) b_j), not at the root.
 * The frame (n, b) is the operator guide's: model/frames.h. */
#include "model/arc.h"
#include "model/kernel.h"
#include "model/vec.h"

enum { RADIUS, FREQUENCY, RANDOM_FREQUENCY, START };

#define RADIUS_AT_ROOT 0.43f
#define RADIUS_GROWTH 0.79f
#define RANDOM_TURNS 3.9f
#define TWO_PI 6.28318531f

LANES_INLINE void turning(const struct kernel_inputs *in, float *restrict rate, float *restrict shift)
{
    FOR_LANES(l)
    {
        float wanted = in->parameter[FREQUENCY] + in->parameter[RANDOM_FREQUENCY] * in->random[0][l];
        rate[l] = wanted > 0.0f ? wanted : 0.0f;
        shift[l] = RANDOM_TURNS * in->random[1][l];
    }
}

/* zeta' rho': how far each vertex is moved. */
LANES_INLINE void curl_sizes(const struct kernel_inputs *in, const lanes *restrict at, const lanes *restrict fallen,
                             lanes *restrict size)
{
    vec growth = in->parameter[RADIUS] * RADIUS_GROWTH * vec_inverse(vec_load(at[in->m - 1]));
    float at_root = in->parameter[RADIUS] * RADIUS_AT_ROOT, rise = lane_rise(in->parameter[START]);
    for (uint32_t j = 1; j < in->m; j++)
        vec_store(size[j], (at_root + growth * vec_load(at[j])) * vec_begun(rise, vec_load(fallen[j])));
}

LANES_INLINE void curl_vertices(const struct kernel_inputs *in, const lanes *restrict size, const lanes *restrict x,
                                const lanes *restrict at, lanes *restrict y)
{
    lanes rates, shifts;
    turning(in, rates, shifts);
    vec rate = 2.0f * vec_load(rates), shift = 2.0f * vec_load(shifts), sine, cosine; /* in half turns */
    vec_copy_root(x, y);
    for (uint32_t j = 1; j < in->m; j++) {
        const lanes *p = x + 3 * j, *frame = in->frame + FRAME_WIDTH * j;
        lanes *q = y + 3 * j;
        vec_sincos_halves(vec_at_most(vec_load(at[j]) * rate + shift, 2.0f * MANY_TURNS), &sine, &cosine);
        vec along_n = vec_load(size[j]) * sine, along_b = vec_load(size[j]) * cosine;
        for (int c = 0; c < 3; c++)
            vec_store(q[c], vec_load(p[c]) + (along_n * vec_load(frame[c]) + along_b * vec_load(frame[3 + c])));
    }
}

LANES_INLINE void curl_forward(const struct kernel_inputs *in, struct bundle x, struct bundle y, lanes *scratch)
{
    lanes *size = scratch, *fallen = x.fallen;
    if (!fallen) {
        fallen = scratch + in->m;
        vec_fall(in->m, (const lanes *)x.at, fallen);
    }
    curl_sizes(in, (const lanes *)x.at, (const lanes *)fallen, size);
    curl_vertices(in, (const lanes *)size, (const lanes *)x.points, (const lanes *)x.at, y.points);
    if (y.at)
        vec_measure(in->m, (const lanes *)y.points, y.at);
}

LANES_INLINE void curl_backward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,
                                struct kernel_adjoints *adjoints, lanes *restrict scratch)
{
    uint32_t m = in->m;
    lanes *ell = scratch, *at = scratch + m, *d_at = scratch + 2 * m, inverse, rate, shift;
    lanes d_radius = {0}, d_rate = {0}, d_start = {0}, d_turns = {0}, d_length = {0};
    float radius = in->parameter[RADIUS], start = in->parameter[START];
    arc_measure(m, x, ell, at, inverse);
    turning(in, rate, shift);
    FOR_LANES(l) d_at[0][l] = 0.0f;
    for (uint32_t j = 1; j < m; j++) {
        const lanes *dp = d + 3 * j, *frame = in->frame + FRAME_WIDTH * j;
        lanes *d_frame = adjoints->frame + FRAME_WIDTH * j;
        FOR_LANES(l)
        {
            float v = at[j][l] * inverse[l], sine, cosine;
            float growth = RADIUS_AT_ROOT + RADIUS_GROWTH * v, begun = lane_begun(v, start);
            float size = radius * growth * begun;
            lane_sincos_turns(at_most(at[j][l] * rate[l] + shift[l], MANY_TURNS), &sine, &cosine);
            float dx = dp[0][l], dy = dp[1][l], dz = dp[2][l];
            float on_n = dx * frame[0][l] + dy * frame[1][l] + dz * frame[2][l];
            float on_b = dx * frame[3][l] + dy * frame[4][l] + dz * frame[5][l];
            float along_n = size * sine, along_b = size * cosine;
            d_frame[0][l] += along_n * dx;
            d_frame[1][l] += along_n * dy;
            d_frame[2][l] += along_n * dz;
            d_frame[3][l] += along_b * dx;
            d_frame[4][l] += along_b * dy;
            d_frame[5][l] += along_b * dz;

            float d_size = sine * on_n + cosine * on_b;
            float d_turn = TWO_PI * (along_b * on_n - along_n * on_b);
            float d_begun = START_STEEPNESS * (d_size * radius * growth) * (begun * (1.0f - begun));
            float d_v = d_size * radius * begun * RADIUS_GROWTH + d_begun;
            d_radius[l] += d_size * growth * begun;
            d_start[l] -= d_begun;
            d_rate[l] += d_turn * at[j][l];
            d_turns[l] += d_turn;
            d_at[j][l] = d_turn * rate[l] + d_v * inverse[l];
            d_length[l] -= d_v * v * inverse[l];
        }
    }
    FOR_LANES(l)
    {
        float wanted = rate[l] > 0.0f ? d_rate[l] : 0.0f;
        d_at[m - 1][l] += d_length[l];
        adjoints->parameter[RADIUS][l] = d_radius[l];
        adjoints->parameter[FREQUENCY][l] = wanted;
        adjoints->parameter[RANDOM_FREQUENCY][l] = wanted * in->random[0][l];
        adjoints->parameter[START][l] = d_start[l];
        adjoints->random[0][l] = wanted * in->parameter[RANDOM_FREQUENCY];
        adjoints->random[1][l] = RANDOM_TURNS * d_turns[l];
    }
    arc_backward(m, x, ell, d_at, NULL, d);
}

KERNEL_TABLE(curl)
