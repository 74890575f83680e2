/* the kernels' own elementary functions, against libm */
#include <math.h>

#include "model/lanes.h"
#include "model/noise.h"
#include "model/vec.h"
#include "tests/support/test.h"

/* Distance in units of the last place of the true value as a float. */
static double ulps(float got, double truth)
{
    float near = (float)truth;
    double unit = (double)nextafterf(fabsf(near), INFINITY) - fabsf(near);
    return fabs(got - truth) / unit;
}

START_TEST(exp2_is_within_three_ulps)
{
    double worst = 0.0;
    for (int i = -1260000; i <= 1270000; i += 3) {
        float x = (float)i * 1e-4f;
        worst = fmax(worst, ulps(lane_exp2(x), exp2((double)x)));
    }
    ck_assert_double_lt(worst, 3.0);
    ck_assert(lane_exp2(0.0f) == 1.0f);
    ck_assert(lane_exp2(-0.0f) == 1.0f);
    ck_assert(lane_exp2(-1e30f) >= 0.0f && lane_exp2(-1e30f) < 1.2e-38f);
    for (int i = 0; i <= 1000; i++) {
        float v = (float)i * 1e-3f;
        ck_assert_double_lt(fabs(lane_begun(v, 0.3f) - 1.0 / (1.0 + exp(-10.0 * ((double)v - 0.3f)))), 3e-7);
    }
}
END_TEST

START_TEST(sincos_is_within_two_parts_in_ten_million)
{
    double worst = 0.0;
    for (int i = -400000; i <= 400000; i++) {
        float turns = (float)i * 1.37e-4f, s, c;
        lane_sincos_turns(turns, &s, &c);
        worst = fmax(worst, fabs(s - sin(2.0 * M_PI * turns)));
        worst = fmax(worst, fabs(c - cos(2.0 * M_PI * turns)));
    }
    ck_assert_double_lt(worst, 2e-7);
    float s, c;
    lane_sincos_turns(0.0f, &s, &c);
    ck_assert(s == 0.0f && c == 1.0f);
    lane_sincos_turns(MANY_TURNS, &s, &c);
    ck_assert(s == 0.0f && c == 1.0f);
}
END_TEST

/* The same formulas in steps of which one is shared, or without steps that do nothing there. */
START_TEST(short_forms_agree_with_long_ones)
{
    lanes at[3], fallen[3];
    for (int i = 0; i <= 1000; i++) {
        lanes begun, sine, cosine, wanted_sine, wanted_cosine;
        float length = 0.01f + 1e-3f * (float)i, v = 1e-3f * (float)i, halves = 0.49f * (2.0f * v - 1.0f);
        vec s, c;
        vec_store(at[0], vec_of(0.0f)), vec_store(at[1], vec_of(v * length)), vec_store(at[2], vec_of(length));
        vec_fall(3, (const lanes *)at, fallen);
        vec_store(begun, vec_begun(lane_rise(0.4f), vec_load(fallen[1])));
        ck_assert_double_lt(fabs(begun[0] - 1.0 / (1.0 + exp(-10.0 * ((double)v - 0.4f)))), 5e-7);
        vec_sincos_near(vec_of(halves), &s, &c);
        vec_store(sine, s), vec_store(cosine, c);
        vec_sincos_halves(vec_of(halves), &s, &c);
        vec_store(wanted_sine, s), vec_store(wanted_cosine, c);
        ck_assert(sine[0] == wanted_sine[0] && cosine[0] == wanted_cosine[0]);
    }
}
END_TEST

START_TEST(noise_is_what_documents_mean_by_it)
{
    /* worked out once from the definition in model/noise.h; never to change */
    ck_assert_uint_eq(noise_hash(NOISE_STEP), 0x5d1170a9u);
    ck_assert_uint_eq(noise_hash(2 * NOISE_STEP), 0xd4fcabc9u);
    ck_assert_uint_eq(noise_hash(0 - NOISE_STEP), 0xf403a632u);
    ck_assert(noise_gradient(0) == 0.28125f);
    ck_assert_float_eq_tol(noise_gradient(NOISE_STEP), 0.80384928f, 1e-7);
    ck_assert_float_eq_tol(noise_gradient(0 - NOISE_STEP), -0.932697214f, 1e-7);
    for (int i = -20; i < 20; i++)
        ck_assert(noise_value((float)i) == 0.0f);
}
END_TEST

START_TEST(noise_has_its_moments_and_its_slope)
{
    double square = 0.0, worst = 0.0;
    for (int i = 0; i < 200000; i++) {
        float t = -300.0f + (float)i * 3.1e-3f, value;
        float slope = noise_epsilon_slope(t, &value);
        ck_assert(value == noise_epsilon(t));
        square += (double)value * value;
        double step = 1.0 / 1024;
        double difference = ((double)noise_epsilon(t + (float)step) - noise_epsilon(t - (float)step)) / (2 * step);
        worst = fmax(worst, fabs(slope - difference));
    }
    /* root mean square of one axis times half an amplitude: three axes give 0.10 amplitudes */
    ck_assert_double_eq_tol(0.5 * sqrt(3.0 * square / 200000), 0.10, 0.005);
    ck_assert_double_lt(worst, 2e-3);
}
END_TEST

START_TEST(noise_looked_up_is_the_noise)
{
    const float offset[3] = NOISE_OFFSETS;
    const float (*cubic)[4] = noise_table();
    double worst = 0.0;
    ck_assert_uint_eq(NOISE_OFFSET_Y, (unsigned)(NOISE_PIECES * offset[1]));
    ck_assert_uint_eq(NOISE_OFFSET_Z, (unsigned)(NOISE_PIECES * offset[2]));
    ck_assert_uint_le(NOISE_PIECES * NOISE_NEAR + NOISE_OFFSET_Z, NOISE_TABLE);
    for (uint32_t i = 0; i < NOISE_TABLE; i++)
        for (int k = 0; k < 64; k++) {
            float f = (float)k / 64, got = cubic[i][0] + f * (cubic[i][1] + f * (cubic[i][2] + f * cubic[i][3]));
            worst = fmax(worst, fabs(got - (double)noise_epsilon(((float)i + f) / NOISE_PIECES)));
        }
    ck_assert_double_lt(worst, NOISE_TOLERANCE);
}
END_TEST

static void same_bits(vec got, const float *wanted)
{
    lanes bits;
    vec_store(bits, got);
    ck_assert_mem_eq(bits, wanted, sizeof bits);
}

START_TEST(vectors_are_the_same_bits_as_lanes)
{
    for (int i = 0; i < 200000; i++) {
        lanes x, sine, cosine, power, inverse, noise, floors, limited;
        int32_t cell;
        for (int l = 0; l < LANES; l++) {
            x[l] = (float)(i * LANES + l) * 2.741e-4f * (l & 1 && i % 3 ? -1.0f : 1.0f);
            lane_sincos_turns(x[l], &sine[l], &cosine[l]);
            power[l] = lane_exp2(0.5f * x[l]);
            inverse[l] = lane_inverse(x[l]);
            noise[l] = noise_epsilon(fabsf(x[l]));
            floors[l] = lane_floor(x[l], &cell);
            ck_assert_int_eq(cell, (int)floor((double)x[l]));
            limited[l] = at_least(at_most(x[l], 7.0f), -2.0f);
        }
        vec v = vec_load(x), s, c;
        ivec cells;
        vec_sincos_halves(2.0f * v, &s, &c);
        same_bits(s, sine);
        same_bits(c, cosine);
        same_bits(vec_exp2(0.5f * v), power);
        same_bits(vec_inverse(v), inverse);
        same_bits(vec_floor(v, &cells), floors);
        same_bits(vec_at_least(vec_at_most(v, 7.0f), -2.0f), limited);
        vec place = vec_choose(v < 0.0f, -v, v);
        same_bits(vec_epsilon(place), noise);
    }
}
END_TEST

TEST_SUITE("model_math", exp2_is_within_three_ulps, vectors_are_the_same_bits_as_lanes, short_forms_agree_with_long_ones, sincos_is_within_two_parts_in_ten_million,
           noise_is_what_documents_mean_by_it, noise_looked_up_is_the_noise, noise_has_its_moments_and_its_slope)
