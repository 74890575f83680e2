/* What strands' numbers have in common goes to the guides; what draws have in common by chance stays. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "fit/centre.h"
#include "groom/sample.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

enum { SCALE, BEND, FRIZZ }; /* of the bent style's operators */
enum { N = 1500 };

static struct groom *bent(struct groom_sample **sample)
{
    *sample = guides_sample(GROOM_SAMPLE_BENT, N, 12, 2, NULL);
    return (*sample)->truth;
}

static float *numbers(const struct groom *groom, uint32_t op)
{
    float *copy = malloc(N * sizeof *copy);
    return memcpy(copy, groom->operators[op].random[0], N * sizeof *copy);
}

/* Half of the bundles have numbers that are larger, the others smaller ones. */
static double shared(uint32_t bundle) { return bundle % 2 ? 0.3 : -0.3; }

static void share(struct groom *groom, uint32_t op)
{
    for (uint32_t i = 0; i < N; i++) {
        float *number = &groom->operators[op].random[0][i];
        *number = (float)(0.6 * (double)*number + shared(groom->operator_guide_of[i]));
    }
}

/* Root mean square of differences. */
static double off(const float *a, const float *b, double times)
{
    double sum = 0;
    for (uint32_t i = 0; i < N; i++)
        sum += pow((double)a[i] - times * (double)b[i], 2);
    return sqrt(sum / N);
}

START_TEST(what_bundles_share_is_taken_off_their_numbers)
{
    struct groom_sample *sample;
    struct groom *groom = bent(&sample);
    for (uint32_t op = SCALE; op <= BEND; op++) {
        float *truth = numbers(groom, op);
        share(groom, op);
        ck_assert_double_gt(off(groom->operators[op].random[0], truth, 0.6), 0.29);
        ck_ok(centre_bundles(groom, memory_allocator(NULL), NULL));
        ck_assert_double_lt(off(groom->operators[op].random[0], truth, 0.6), 0.09); /* means of 38 draws, .32 each, are off by .05 */
        free(truth);
    }
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(what_draws_share_by_chance_stays)
{
    struct groom_sample *sample;
    struct groom *groom = bent(&sample);
    float *scale = numbers(groom, SCALE), *bend = numbers(groom, BEND), *frizz = numbers(groom, FRIZZ);
    ck_ok(centre_bundles(groom, memory_allocator(NULL), NULL));
    ck_assert_double_lt(off(groom->operators[SCALE].random[0], scale, 1), 0.04);
    ck_assert_double_lt(off(groom->operators[BEND].random[0], bend, 1), 0.04);
    ck_assert_mem_eq(groom->operators[FRIZZ].random[0], frizz, N * sizeof *frizz);
    free(scale), free(bend), free(frizz);
    groom_sample_destroy(sample);
}
END_TEST

static double length_of(const struct groom *groom, uint32_t i)
{
    float (*x)[3] = malloc(groom->n_vertices * sizeof *x);
    double length = 0;
    ck_ok(groom_evaluate(groom, i, 1, x, NULL, NULL));
    for (uint32_t j = 1; j < groom->n_vertices; j++)
        length += sqrt(pow((double)x[j][0] - (double)x[j - 1][0], 2) + pow((double)x[j][1] - (double)x[j - 1][1], 2) +
                       pow((double)x[j][2] - (double)x[j - 1][2], 2));
    free(x);
    return length;
}

START_TEST(scales_that_all_share_become_the_guides_length)
{
    struct groom_sample *sample;
    struct groom *groom = bent(&sample);
    groom->operators[BEND].enabled = groom->operators[FRIZZ].enabled = 0;
    double sum = 0, before[10];
    for (uint32_t i = 0; i < N; i++)
        groom->operators[SCALE].random[0][i] = (float)(0.5 * (double)groom->operators[SCALE].random[0][i] + 0.3);
    for (uint32_t i = 0; i < 10; i++)
        before[i] = length_of(groom, i);
    centre_scales(groom);
    for (uint32_t i = 0; i < N; i++)
        sum += (double)groom->operators[SCALE].random[0][i];
    ck_assert_double_lt(fabs(sum / N), 1e-4);
    for (uint32_t i = 0; i < 10; i++)
        ck_assert_double_eq_tol(length_of(groom, i), before[i], 1e-5);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(without_memory_nothing_changes)
{
    struct groom_sample *sample;
    struct groom *groom = bent(&sample);
    struct test_failing_allocator state;
    struct groom_allocator allocator;
    struct groom_diag diag;
    share(groom, SCALE);
    float *kept = numbers(groom, SCALE);
    test_failing_allocator_init(&state, 0, &allocator);
    ck_assert_int_eq(centre_bundles(groom, &allocator, &diag), GROOM_ENOMEM);
    ck_assert_mem_eq(groom->operators[SCALE].random[0], kept, N * sizeof *kept);
    ck_assert_uint_eq(state.outstanding_bytes, 0);
    free(kept);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_centre", what_bundles_share_is_taken_off_their_numbers, what_draws_share_by_chance_stays,
           scales_that_all_share_become_the_guides_length, without_memory_nothing_changes)
