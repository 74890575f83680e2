/* How many curls there are to have guides for. */
#include <stdlib.h>

#include "base/memory.h"
#include "fit/coils.h"
#include "groom/sample.h"
#include "tests/support/fits.h"
#include "tests/support/test.h"

enum { VERTICES = 80 };

static struct groom_sample *sample_of(groom_sample_style style, uint32_t n_strands, uint32_t n_curls, int defects)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    if (defects)
        groom_sample_options_capture(style, &options);
    else
        groom_sample_options_init(style, &options);
    options.n_strands = n_strands;
    options.n_vertices = VERTICES;
    options.n_guides = options.n_operator_guides = n_curls;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    return sample;
}

static struct groom_fit *fit_of(const struct groom_sample *sample, const struct groom_context *context)
{
    struct groom_fit_options *options = malloc(sizeof *options);
    struct groom_fit *fit;
    groom_fit_options_init(GROOM_FIT_STANDARD, options);
    options->vertices = VERTICES;
    ck_ok(groom_fit_create(sample->capture, sample->head, options, context, &fit, NULL));
    free(options);
    return fit;
}

static uint32_t count(groom_sample_style style, uint32_t n_strands, uint32_t n_curls, int defects)
{
    struct groom_sample *sample = sample_of(style, n_strands, n_curls, defects);
    struct groom_fit *fit = fit_of(sample, NULL);
    uint32_t n;
    ck_ok(coils_count(fit, NULL, &n, NULL));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    return n;
}

START_TEST(curls_of_a_few_strands_are_counted)
{
    uint32_t few = count(GROOM_SAMPLE_COILY, 3000, 300, 0), many = count(GROOM_SAMPLE_COILY, 3000, 700, 0);
    ck_assert_uint_gt(few, 200);
    ck_assert_uint_lt(few, 550);
    ck_assert_uint_gt(many, 500);
    ck_assert_uint_lt(many, 1000);
    ck_assert_uint_gt(count(GROOM_SAMPLE_COILY, 3000, 600, 1), 400);
}
END_TEST

/* Frizz winds, but every strand by itself; what is wide waves along is shape; and curls of many strands have guides anyhow. */
START_TEST(hair_without_small_curls_has_none)
{
    ck_assert_uint_eq(count(GROOM_SAMPLE_STRAIGHT, 3000, 60, 0), 0);
    ck_assert_uint_eq(count(GROOM_SAMPLE_SPIKY, 3000, 300, 1), 0);
    ck_assert_uint_eq(count(GROOM_SAMPLE_BENT, 3000, 60, 0), 0);
    ck_assert_uint_eq(count(GROOM_SAMPLE_WAVY, 3000, 70, 1), 0);
    ck_assert_uint_eq(count(GROOM_SAMPLE_CURLY, 6000, 40, 0), 0);
    ck_assert_uint_eq(count(GROOM_SAMPLE_COILY, 200, 40, 0), 0); /* too few to look at */
}
END_TEST

START_TEST(one_thread_and_three_count_the_same)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_COILY, 1000, 200, 0);
    struct groom_fit *fit = fit_of(sample, NULL);
    struct groom_pool *pool;
    uint32_t one, three;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(coils_count(fit, NULL, &one, NULL));
    ck_ok(coils_count(fit, &context, &three, NULL));
    ck_assert_uint_eq(one, three);
    ck_assert_uint_gt(one, 0);
    groom_pool_destroy(pool);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(without_memory_it_says_so)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_COILY, 400, 80, 0);
    struct groom_fit *fit = fit_of(sample, NULL);
    struct test_failing_allocator state;
    struct groom_allocator allocator;
    struct groom_context context = {.allocator = &allocator};
    groom_status st = GROOM_ENOMEM;
    uint32_t n;
    for (size_t fail_at = 0; st == GROOM_ENOMEM; fail_at++) {
        ck_assert_uint_lt(fail_at, 100);
        test_failing_allocator_init(&state, fail_at, &allocator);
        st = coils_count(fit, &context, &n, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
    }
    ck_assert_int_eq(st, GROOM_OK);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* How many guides, and operator guides among them, a fit makes where nobody says. */
static struct groom_shape automatic_counts(groom_sample_style style, uint32_t n_curls, uint32_t *n_coils)
{
    struct groom_sample *sample = sample_of(style, 3000, n_curls, 0);
    struct groom_fit *fit = fit_of(sample, NULL);
    ck_ok(coils_count(fit, NULL, n_coils, NULL));
    while (!fit->groom)
        ck_ok(groom_fit_step(fit, NULL, NULL));
    struct groom_shape shape = {.n_guides = fit->groom->n_guides, .n_operator_guides = fit->groom->n_operator_guides};
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    return shape;
}

START_TEST(automatic_counts_are_of_curls)
{
    uint32_t n_coils;
    struct groom_shape shape = automatic_counts(GROOM_SAMPLE_COILY, 600, &n_coils);
    ck_assert_uint_eq(shape.n_guides, n_coils < 3000 / 4 ? n_coils : 3000 / 4);
    ck_assert_uint_eq(shape.n_operator_guides, shape.n_guides);
    shape = automatic_counts(GROOM_SAMPLE_STRAIGHT, 60, &n_coils);
    ck_assert_uint_eq(shape.n_guides, 219); /* four for each square root of the strands */
    ck_assert_uint_eq(shape.n_operator_guides, 110);
}
END_TEST

TEST_SUITE("fit_coils", curls_of_a_few_strands_are_counted, hair_without_small_curls_has_none,
           one_thread_and_three_count_the_same, without_memory_it_says_so, automatic_counts_are_of_curls)
