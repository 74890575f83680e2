/* What strands of a curl are long together, and how often they wind then. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "fit/lengths.h"
#include "groom/groom.h"
#include "groom/sample.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

enum { SCALE, CURL }; /* of the wavy style's operators */

static struct groom *wavy(struct groom_sample **sample)
{
    *sample = guides_sample(GROOM_SAMPLE_WAVY, 1500, 12, 2, NULL);
    return (*sample)->truth;
}

static double frequency_of(const struct groom *groom, uint32_t o)
{
    const struct groom_operator *curl = &groom->operators[CURL];
    return (double)curl->parameter[1] + (double)curl->parameter[2] * (double)curl->random[0][o];
}

static double scale_of(const struct groom *groom, uint32_t i)
{
    return 1 + (double)groom->operators[SCALE].parameter[0] * (double)groom->operators[SCALE].random[0][i];
}

/* Strands of every other operator guide 3 per cent longer, those of the others shorter; they wind as much less or more
 * often a metre. */
static double longer(uint32_t guide) { return guide % 2 ? 1.03 : 0.97; }

static void stretch(struct groom *groom)
{
    struct groom_operator *scale = &groom->operators[SCALE], *curl = &groom->operators[CURL];
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        curl->random[0][o] = (float)((frequency_of(groom, o) / longer(o) - (double)curl->parameter[1]) / (double)curl->parameter[2]);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        scale->random[0][i] = (float)((scale_of(groom, i) * longer(groom->operator_guide_of[i]) - 1) / (double)scale->parameter[0]);
}

/* Root mean square of how far frequencies are off, as a part of them. */
static double off(const struct groom *groom, const double *truth)
{
    double sum = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        sum += pow(frequency_of(groom, o) / truth[o] - 1, 2);
    return sqrt(sum / groom->n_operator_guides);
}

START_TEST(bundles_that_are_longer_than_draws_make_them_wind_more_often)
{
    struct groom_sample *sample;
    struct groom *groom = wavy(&sample);
    uint32_t n = groom->n_operator_guides;
    double *truth = calloc(n, sizeof *truth), *turns = calloc(groom->n_strands, sizeof *turns);
    for (uint32_t o = 0; o < n; o++)
        truth[o] = frequency_of(groom, o);
    stretch(groom);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        turns[i] = scale_of(groom, i) * frequency_of(groom, groom->operator_guide_of[i]);
    double before = off(groom, truth);
    ck_ok(lengths_settle(groom, &groom->operators[CURL], &groom->operators[SCALE], memory_allocator(NULL), NULL));
    ck_assert_double_lt(off(groom, truth), 0.6 * before);
    uint32_t same = 0; /* strands wind as often as they did, but where a number is at the end of its range */
    for (uint32_t i = 0; i < groom->n_strands; i++)
        same += fabs(scale_of(groom, i) * frequency_of(groom, groom->operator_guide_of[i]) / turns[i] - 1) < 1e-5;
    ck_assert_uint_gt(10 * same, 9 * groom->n_strands);
    free(truth), free(turns);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(what_draws_explain_stays)
{
    struct groom_sample *sample;
    struct groom *groom = wavy(&sample);
    double *truth = calloc(groom->n_operator_guides, sizeof *truth);
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        truth[o] = frequency_of(groom, o);
    ck_ok(lengths_settle(groom, &groom->operators[CURL], &groom->operators[SCALE], memory_allocator(NULL), NULL));
    ck_assert_double_lt(off(groom, truth), 0.004); /* means of 20 draws are off by 0.01 */
    free(truth);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(nothing_to_scale_or_to_wind_changes_nothing)
{
    struct groom_sample *sample;
    struct groom *groom = wavy(&sample);
    float *kept = malloc(groom->n_operator_guides * sizeof *kept);
    groom->operators[CURL].parameter[2] = 0;
    memcpy(kept, groom->operators[CURL].random[0], groom->n_operator_guides * sizeof *kept);
    ck_ok(lengths_settle(groom, &groom->operators[CURL], &groom->operators[SCALE], memory_allocator(NULL), NULL));
    ck_assert_mem_eq(kept, groom->operators[CURL].random[0], groom->n_operator_guides * sizeof *kept);
    groom->operators[SCALE].parameter[0] = 0;
    groom->operators[CURL].parameter[2] = 2;
    ck_ok(lengths_settle(groom, &groom->operators[CURL], &groom->operators[SCALE], memory_allocator(NULL), NULL));
    ck_assert_mem_eq(kept, groom->operators[CURL].random[0], groom->n_operator_guides * sizeof *kept);
    free(kept);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_lengths", bundles_that_are_longer_than_draws_make_them_wind_more_often, what_draws_explain_stays,
           nothing_to_scale_or_to_wind_changes_nothing)
