/* The last degrees of the axes that hair was made along, off strands. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/align.h"
#include "fit/axes.h"
#include "fit/frame.h"
#include "groom/context.h"
#include "tests/support/guides.h"
#include "tests/support/invariance.h"
#include "tests/support/known.h"
#include "tests/support/test.h"

enum { N = 500, M = 100 };

/* A fit whose groom is the truth, with axes that are off by so many degrees. */
static struct groom_fit *fit_off_by(groom_sample_style style, double degrees, struct groom_sample **sample)
{
    struct groom *truth;
    *sample = guides_sample(style, N, M, 4, NULL);
    struct groom_fit_options options = known_options(*sample, 0);
    struct groom_fit *fit = guides_fit(*sample, &options, "operators", NULL);
    ck_ok(groom_clone((*sample)->truth, NULL, &truth, NULL));
    known_replace(fit, truth);
    float off = (float)(degrees * acos(-1) / 180 / sqrt(3));
    frame_turned(invariance_as_it_is, (const float[3]){off, -off, off}, fit->frame);
    fit->axes = AXES_NEAR;
    axes_give(fit);
    return fit;
}

static void finish(struct groom_fit *fit, struct groom_sample *sample)
{
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

static void are_told(groom_sample_style style, double degrees)
{
    struct groom_sample *sample;
    struct groom_fit *fit = fit_off_by(style, degrees, &sample);
    ck_ok(align_axes(fit, NULL, NULL));
    ck_assert_uint_eq(fit->axes, AXES_FOUND);
    double left = invariance_degrees((const double (*)[3])fit->frame, invariance_as_it_is);
    ck_assert_msg(left < 0.1, "%g degrees", left);
    finish(fit, sample);
}

START_TEST(straight_strands_tell_axes) { are_told(GROOM_SAMPLE_STRAIGHT, 8); } END_TEST
START_TEST(wavy_strands_tell_axes) { are_told(GROOM_SAMPLE_WAVY, 5); } END_TEST
START_TEST(short_strands_tell_axes) { are_told(GROOM_SAMPLE_SHORT, 8); } END_TEST
START_TEST(bent_strands_tell_axes) { are_told(GROOM_SAMPLE_BENT, 8); } END_TEST

/* Strands with other numbers than theirs are as far off along any axes. */
START_TEST(strands_that_were_not_found_tell_nothing_beyond_doubt)
{
    struct groom_sample *sample;
    struct groom_fit *fit = fit_off_by(GROOM_SAMPLE_WAVY, 8, &sample);
    known_replace(fit, known_redrawn(sample->truth, 99, NULL));
    ck_ok(align_axes(fit, NULL, NULL));
    ck_assert_uint_eq(fit->axes, AXES_NEAR);
    finish(fit, sample);
}
END_TEST

START_TEST(axes_of_the_file_stay)
{
    struct groom_sample *sample;
    struct groom_fit *fit = fit_off_by(GROOM_SAMPLE_STRAIGHT, 8, &sample);
    double before[3][3];
    memcpy(before, fit->frame, sizeof before);
    for (uint32_t axes = AXES_UNKNOWN; axes < AXES_NEAR; axes++) {
        fit->axes = axes;
        ck_ok(align_axes(fit, NULL, NULL));
        ck_assert_uint_eq(fit->axes, axes);
        ck_assert_mem_eq(fit->frame, before, sizeof before);
    }
    finish(fit, sample);
}
END_TEST

START_TEST(an_alignment_that_fails_changes_nothing)
{
    struct groom_sample *sample;
    struct groom_fit *fit = fit_off_by(GROOM_SAMPLE_STRAIGHT, 4, &sample);
    double before[3][3];
    float axes[3][3];
    groom_status st = GROOM_ENOMEM;
    uint32_t n_failed = 0;
    memcpy(before, fit->frame, sizeof before);
    memcpy(axes, fit->groom->axes, sizeof axes);
    for (size_t fail_at = 0; st == GROOM_ENOMEM; fail_at += 1 + fail_at / 8) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        st = align_axes(fit, &context, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_ENOMEM) {
            n_failed++;
            ck_assert_mem_eq(fit->frame, before, sizeof before);
            ck_assert_mem_eq(fit->groom->axes, axes, sizeof axes);
            ck_assert_uint_eq(fit->axes, AXES_NEAR);
        }
    }
    ck_ok(st);
    ck_assert_uint_gt(n_failed, 20);
    finish(fit, sample);
}
END_TEST

/* From strands alone: no more is known of how they were turned than what they tell. */
START_TEST(hair_that_was_turned_is_found_as_it_was)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 900, M, 4, NULL);
    double made[3][3];
    for (int k = 0; k < 9; k++)
        made[k / 3][k % 3] = invariance_slanted[k % 3][k / 3];
    invariance_turn(sample, invariance_slanted);
    struct groom_fit_options options = known_options(sample, 0);
    struct groom_fit *fit = guides_fit(sample, &options, "", NULL);
    ck_assert_uint_eq(fit->axes, AXES_FOUND);
    ck_assert_double_lt(invariance_degrees((const double (*)[3])fit->frame, (const double (*)[3])made), 0.2);
    finish(fit, sample);
}
END_TEST

TEST_SUITE("fit_align", straight_strands_tell_axes, wavy_strands_tell_axes, short_strands_tell_axes, bent_strands_tell_axes,
           strands_that_were_not_found_tell_nothing_beyond_doubt, axes_of_the_file_stay, an_alignment_that_fails_changes_nothing,
           hair_that_was_turned_is_found_as_it_was)
