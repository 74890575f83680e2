/* The axes that hair was made along: rotations, and which ones fits choose. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/axes.h"
#include "fit/frame.h"
#include "fit/matching.h"
#include "groom/context.h"
#include "tests/support/fits.h"
#include "tests/support/guides.h"
#include "tests/support/invariance.h"
#include "tests/support/known.h"
#include "tests/support/test.h"

enum { N = 900, M = 100, PAIRS = 500 };

/* --- rotations -------------------------------------------------------------------------------- */

static void is_rotation(const double r[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double dot = 0;
            for (int c = 0; c < 3; c++)
                dot += r[i][c] * r[j][c];
            ck_assert_double_eq_tol(dot, i == j, 1e-12);
        }
    ck_assert_double_gt(r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                            r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]), 0);
}

/* x to y, y to -x. */
START_TEST(a_quarter_turn_about_z)
{
    const double about_z[3] = {0, 0, acos(-1) / 2}, expected[3][3] = {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
    double r[3][3];
    frame_rotation(about_z, r);
    is_rotation((const double (*)[3])r);
    for (int k = 0; k < 9; k++)
        ck_assert_double_eq_tol(r[k / 3][k % 3], expected[k / 3][k % 3], 1e-12);
}
END_TEST

START_TEST(a_rotation_leaves_its_axis_and_turns_by_its_length)
{
    const double vector[3] = {0.3, -0.5, 0.9};
    double r[3][3], angle = sqrt(0.09 + 0.25 + 0.81);
    frame_rotation(vector, r);
    is_rotation((const double (*)[3])r);
    for (int i = 0; i < 3; i++)
        ck_assert_double_eq_tol(r[i][0] * vector[0] + r[i][1] * vector[1] + r[i][2] * vector[2], vector[i], 1e-12);
    ck_assert_double_eq_tol(r[0][0] + r[1][1] + r[2][2], 1 + 2 * cos(angle), 1e-12);
    frame_rotation((const double[3]){0, 0, 0}, r);
    ck_assert_double_eq_tol(r[0][0] + r[1][1] + r[2][2], 3, 1e-12);
}
END_TEST

/* --- fits ------------------------------------------------------------------------------------------ */

static struct groom_fit *fit_of(groom_sample_style style, const double turn[3][3], const char *stage, struct groom_sample **sample)
{
    *sample = guides_sample(style, N, M, 4, NULL);
    invariance_turn(*sample, turn);
    struct groom_fit_options options = known_options(*sample, 0);
    return guides_fit(*sample, &options, stage, NULL);
}

static void is_frame(const struct groom_fit *fit, const double frame[3][3])
{
    for (int k = 0; k < 9; k++)
        ck_assert_double_eq_tol(fit->frame[k / 3][k % 3], frame[k / 3][k % 3], 1e-12);
}

/* Hair of the model lies along the axes of its file; with another axis up, which nobody tells, along those. Both are told
 * the same parameters then. */
static void are_found_as_it_lies(groom_sample_style style)
{
    struct groom_sample *sample, *other;
    struct groom_fit *given = fit_of(style, invariance_as_it_is, "randoms", &sample);
    struct groom_fit *upright = fit_of(style, invariance_upright, "randoms", &other);
    struct known_parameter parameter[KNOWN_PARAMETERS];
    ck_assert_uint_eq(given->axes, AXES_GIVEN);
    is_frame(given, invariance_as_it_is);
    ck_assert_uint_eq(upright->axes, AXES_QUARTER);
    double back[3][3];
    for (int k = 0; k < 9; k++)
        back[k / 3][k % 3] = invariance_upright[k % 3][k / 3];
    is_frame(upright, (const double (*)[3])back);
    uint32_t n = known_parameters(upright->groom, given->groom, parameter);
    for (uint32_t k = 0; k < n; k++)
        ck_assert_msg(fabs(parameter[k].error) < 0.5, "%s.%s moves by %.2f %%", parameter[k].of, parameter[k].name, parameter[k].error);
    groom_fit_destroy(upright);
    groom_fit_destroy(given);
    groom_sample_destroy(other);
    groom_sample_destroy(sample);
}

START_TEST(axes_of_straight_hair_are_found_as_it_lies) { are_found_as_it_lies(GROOM_SAMPLE_STRAIGHT); } END_TEST
START_TEST(axes_of_bent_hair_are_found_as_it_lies) { are_found_as_it_lies(GROOM_SAMPLE_BENT); } END_TEST

/* Of waves it is which axis is up that tells most; half a turn about it tells little. */
START_TEST(waves_are_found_which_axis_was_up)
{
    struct groom_sample *sample;
    struct groom_fit *fit = fit_of(GROOM_SAMPLE_WAVY, invariance_upright, "randoms", &sample);
    double up = 0;
    ck_assert_uint_eq(fit->axes, AXES_QUARTER);
    for (int c = 0; c < 3; c++)
        up += fit->frame[1][c] * invariance_upright[c][1];
    ck_assert_double_eq_tol(fabs(up), 1, 1e-12);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* Turned askew, hair is known by how it falls: the frame stays one, and comes near the one that the hair was made along;
 * parameters are those that the hair is told as it is. */
static void are_found_askew(groom_sample_style style, double most_degrees)
{
    struct groom_sample *sample, *other;
    struct groom_fit *given = fit_of(style, invariance_as_it_is, "randoms", &other);
    struct groom_fit *fit = fit_of(style, invariance_slanted, "randoms", &sample);
    struct known_parameter parameter[KNOWN_PARAMETERS];
    double made[3][3];
    for (int k = 0; k < 9; k++)
        made[k / 3][k % 3] = invariance_slanted[k % 3][k / 3];
    ck_assert_uint_eq(fit->axes, AXES_NEAR);
    is_rotation((const double (*)[3])fit->frame);
    ck_assert_double_lt(invariance_degrees((const double (*)[3])fit->frame, (const double (*)[3])made), most_degrees);
    uint32_t n = known_parameters(fit->groom, given->groom, parameter);
    for (uint32_t k = 0; k < n; k++)
        ck_assert_msg(fabs(parameter[k].error) < 5, "%s.%s moves by %.1f %%", parameter[k].of, parameter[k].name, parameter[k].error);
    groom_fit_destroy(fit);
    groom_fit_destroy(given);
    groom_sample_destroy(other);
    groom_sample_destroy(sample);
}

START_TEST(axes_of_straight_hair_are_found_askew) { are_found_askew(GROOM_SAMPLE_STRAIGHT, 10); } END_TEST
START_TEST(axes_of_bent_hair_are_found_askew) { are_found_askew(GROOM_SAMPLE_BENT, 15); } END_TEST

/* Crimps from vertex to vertex, which no operator makes, on hair that was turned. */
START_TEST(hair_that_is_not_of_the_model_lies_as_its_file_does)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, N, M, 4, NULL);
    struct groom_fit_options options = known_options(sample, 0);
    invariance_turn(sample, invariance_upright);
    for (uint32_t v = 0; v < sample->capture->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            sample->capture->points[v][c] += v % M == 0 ? 0 : v / 2 % 2 ? 2e-3f : -2e-3f;
    struct groom_fit *fit = guides_fit(sample, &options, "randoms", NULL);
    ck_assert_uint_eq(fit->axes, AXES_GIVEN);
    is_frame(fit, invariance_as_it_is);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(a_choice_that_fails_changes_nothing)
{
    struct groom_sample *sample;
    struct groom_fit *fit = fit_of(GROOM_SAMPLE_STRAIGHT, invariance_as_it_is, "operators", &sample);
    double before[3][3];
    groom_status st = GROOM_ENOMEM;
    uint32_t n_failed = 0;
    memcpy(before, fit->frame, sizeof before);
    for (size_t fail_at = 0; st == GROOM_ENOMEM; fail_at += 1 + fail_at / 16) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        st = axes_choose(fit, PAIRS / 10, &context, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_ENOMEM) {
            n_failed++;
            ck_assert_mem_eq(fit->frame, before, sizeof before);
            ck_assert_uint_eq(fit->axes, AXES_UNKNOWN);
        }
    }
    ck_assert_int_eq(st, GROOM_OK);
    ck_assert_uint_gt(n_failed, 20);
    ck_assert_uint_ne(fit->axes, AXES_UNKNOWN);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- operators -------------------------------------------------------------------------------- */

/* A vector of any length turns a frame by that, and what is turned all the way round is where it was. */
START_TEST(operators_are_matched_along_the_axes_that_are_asked_for)
{
    struct groom_sample *sample;
    struct groom_fit *fit = fit_of(GROOM_SAMPLE_WAVY, invariance_as_it_is, "operators", &sample);
    struct matching_wanted wanted = {.n_pairs = PAIRS, .floor = 0.03};
    struct matching *matching;
    double before[MOMENTS_COUNT], turned[MOMENTS_COUNT], after[MOMENTS_COUNT], round[3][3];
    frame_turned(invariance_as_it_is, (const float[3]){0, (float)(2 * acos(-1)), 0}, round);
    is_rotation((const double (*)[3])round);
    ck_ok(matching_create(fit, &wanted, NULL, &matching, NULL));
    ck_ok(matching_residual(matching, fit->groom->operators, invariance_as_it_is, before, NULL, NULL));
    ck_ok(matching_residual(matching, fit->groom->operators, invariance_upright, turned, NULL, NULL));
    ck_ok(matching_residual(matching, fit->groom->operators, invariance_as_it_is, after, NULL, NULL));
    ck_assert_mem_eq(before, after, sizeof before);
    double apart = 0;
    for (int f = 0; f < MOMENTS_COUNT; f++)
        apart += fabs(turned[f] - before[f]);
    ck_assert_double_gt(apart, 1);
    ck_ok(matching_residual(matching, fit->groom->operators, (const double (*)[3])round, after, NULL, NULL));
    for (int f = 0; f < MOMENTS_COUNT; f++)
        ck_assert_double_eq_tol(after[f], before[f], 0.05);
    matching_destroy(matching);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- what the groom leans on ---------------------------------------------------------------------------- */

static void leans_on(const struct groom_fit *fit, const double frame[3][3])
{
    for (int k = 0; k < 9; k++)
        ck_assert_double_eq_tol((double)fit->groom->axes[k / 3][k % 3], frame[k / 3][k % 3], 1e-6);
}

/* Upright hair has a frame of zeroes, by which no bit changes. */
START_TEST(a_groom_leans_on_the_axes_that_were_found)
{
    static const double space[3][3];
    struct groom_sample *sample, *other;
    struct groom_fit *given = fit_of(GROOM_SAMPLE_BENT, invariance_as_it_is, "operators", &sample);
    leans_on(given, space);
    guides_fit_on(given, "randoms", NULL);
    leans_on(given, space);
    struct groom_fit *slanted = fit_of(GROOM_SAMPLE_BENT, invariance_slanted, "randoms", &other);
    leans_on(slanted, (const double (*)[3])slanted->frame);
    struct groom_fit_options options = known_options(other, 0);
    slanted = fits_pass_on(slanted, guides_fit(other, &options, "initialize", NULL));
    leans_on(slanted, (const double (*)[3])slanted->frame);
    groom_fit_destroy(slanted);
    groom_fit_destroy(given);
    groom_sample_destroy(other);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_axes", a_quarter_turn_about_z, a_rotation_leaves_its_axis_and_turns_by_its_length,
           axes_of_straight_hair_are_found_as_it_lies, axes_of_bent_hair_are_found_as_it_lies,
           waves_are_found_which_axis_was_up, axes_of_straight_hair_are_found_askew, axes_of_bent_hair_are_found_askew,
           hair_that_is_not_of_the_model_lies_as_its_file_does, a_choice_that_fails_changes_nothing,
           operators_are_matched_along_the_axes_that_are_asked_for, a_groom_leans_on_the_axes_that_were_found)
