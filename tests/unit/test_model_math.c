/* the kernels' own elementary functions, against libm */
#include <math.h>
#include <stdlib.h>

#include "model/lanes.h"
#include "model/noise.h"
#include "tests/support/test.h"

/* Distance in units of the last place of the true value as a float. */
static double ulps(float got, double truth)
{
    float near = (float)truth;
    double unit = (double)nextafterf(fabsf(near), INFINITY) - fabsf(near);
    return fabs(got - truth) / unit;
}

START_TEST(exp_is_within_two_ulps)
{
    double worst = 0.0;
    for (int i = -860000; i <= 870000; i += 7) {
        float x = (float)i * 1e-4f;
        worst = fmax(worst, ulps(lane_exp(x), exp((double)x)));
    }
    ck_assert_double_lt(worst, 2.0);
    ck_assert(lane_exp(0.0f) == 1.0f);
    ck_assert(lane_exp(-0.0f) == 1.0f);
    ck_assert(lane_exp(-1e30f) >= 0.0f && lane_exp(-1e30f) < 1e-37f);
    ck_assert_double_lt(fabs((double)lane_sigmoid(-3.0f) - 1.0 / (1.0 + exp(3.0))), 1e-8);
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

TEST_SUITE("model_math", exp_is_within_two_ulps, sincos_is_within_two_parts_in_ten_million,
           noise_is_what_documents_mean_by_it, noise_has_its_moments_and_its_slope)
