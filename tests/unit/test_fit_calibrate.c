/* Curvature on average, and the amplitude of frizz by it. */
#include <math.h>
#include <stdlib.h>

#include "fit/calibrate.h"
#include "fit/mean_curvature.h"
#include "fit/state.h"
#include "groom/groom.h"
#include "groom/sample.h"
#include "tests/support/test.h"

enum { M = 60 };

START_TEST(a_circle_turns_by_its_radius)
{
    float points[2 * M][3] = {{0}};
    for (int i = 0; i < 2 * M; i++) {
        double angle = 0.02 * (i % M);
        points[i][0] = (float)(0.05 * cos(angle));
        points[i][1] = (float)(0.05 * sin(angle));
    }
    ck_assert_double_eq_tol(mean_curvature((const float (*)[3])points, 2, M), 20, 0.02);
}
END_TEST

START_TEST(what_does_not_turn_or_is_too_short_has_none)
{
    float straight[M][3] = {{0}}, point[M][3] = {{0}};
    for (int j = 0; j < M; j++)
        straight[j][2] = (float)j;
    ck_assert_double_eq(mean_curvature((const float (*)[3])straight, 1, M), 0);
    ck_assert_double_eq(mean_curvature((const float (*)[3])point, 1, M), 0);
    ck_assert_double_eq(mean_curvature((const float (*)[3])straight, 20, 3), 0);
    ck_assert_double_eq(mean_curvature((const float (*)[3])straight, 0, M), 0);
}
END_TEST

static float *amplitude_of(struct groom *groom)
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (groom->operators[o].type == GROOM_OPERATOR_FRIZZ)
            return &groom->operators[o].parameter[1];
    ck_abort_msg("no frizz");
    return NULL;
}

/* Whatever allocation fails, the parameter stays. */
static void without_memory(struct groom_fit *fit, const float *amplitude)
{
    float before = *amplitude;
    groom_status st = GROOM_ENOMEM;
    for (uint64_t fail_at = 1; st != GROOM_OK; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        st = calibrate_frizz(fit, &context, NULL);
        ck_assert(st == GROOM_OK || st == GROOM_ENOMEM);
        if (st != GROOM_OK)
            ck_assert_float_eq(*amplitude, before);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert_uint_lt(fail_at, 2000);
    }
}

/* A fit has ended with its frizz calibrated: from 1 % off it comes back, from 30 % off as far as is let. */
START_TEST(an_amplitude_that_is_off_comes_back)
{
    struct groom_sample_options options;
    struct groom_fit_options *fit_options = malloc(sizeof *fit_options);
    struct groom_sample *sample;
    struct groom_fit *fit;
    groom_sample_options_init(GROOM_SAMPLE_SPIKY, &options);
    options.n_strands = 400;
    options.n_vertices = M;
    options.n_guides = 40;
    options.n_operator_guides = 20;
    groom_fit_options_init(GROOM_FIT_DRAFT, fit_options);
    fit_options->vertices = M;
    fit_options->guides = 40;
    fit_options->operator_guides = 20;
    fit_options->stages.randoms.refinements = 1;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    ck_ok(groom_fit_create(sample->capture, sample->head, fit_options, NULL, &fit, NULL));
    while (!groom_fit_done(fit))
        ck_ok(groom_fit_step(fit, NULL, NULL));
    ck_ok(calibrate_frizz(fit, NULL, NULL));
    float *amplitude = amplitude_of(fit->groom), right = *amplitude;
    *amplitude = 0.99f * right;
    ck_ok(calibrate_frizz(fit, NULL, NULL));
    ck_assert_float_eq_tol(*amplitude, right, 2e-3f * right);
    *amplitude = 0.7f * right;
    ck_ok(calibrate_frizz(fit, NULL, NULL));
    ck_assert_float_eq_tol(*amplitude, 0.7f * expf(0.015f) * right, 1e-3f * right);
    *amplitude = right;
    without_memory(fit, amplitude);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    free(fit_options);
}
END_TEST

TEST_SUITE("fit_calibrate", a_circle_turns_by_its_radius, what_does_not_turn_or_is_too_short_has_none,
           an_amplitude_that_is_off_comes_back)
