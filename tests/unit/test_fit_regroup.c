/* Strands that got among the wrong ones, and bundles that are two. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "fit/regroup.h"
#include "fit/strays.h"
#include "fit/trades.h"
#include "tests/support/guides.h"
#include "tests/support/known.h"
#include "tests/support/test.h"

enum { N = 900, M = 100 };

static const struct strand_error_weights weights = {2, 400, 1, 0};

/* A fit that has found the truth. */
static struct groom_fit *at_truth(groom_sample_style style, struct groom_sample **sample)
{
    struct groom_diag diag = {0};
    struct groom *truth;
    *sample = guides_sample(style, N, M, 4, NULL);
    struct groom_fit_options options = known_options(*sample, 0);
    struct groom_fit *fit = guides_fit(*sample, &options, "instance_weights", NULL);
    known_must(groom_clone((*sample)->truth, NULL, &truth, &diag), &diag);
    known_replace(fit, truth);
    return fit;
}

static double mean_error(struct groom_fit *fit)
{
    struct random_search search;
    float *error = malloc(fit->n * sizeof *error);
    double sum = 0;
    ck_ok(random_search_init(&search, fit, NULL, NULL));
    search.weights = weights;
    random_search_errors(&search, fit->n, error, NULL);
    random_search_finish(&search);
    for (uint32_t i = 0; i < fit->n; i++)
        sum += (double)error[i] / fit->n;
    free(error);
    return sum;
}

static uint32_t followers(const struct groom *groom, uint32_t o)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < groom->n_strands; i++)
        n += groom->operator_guide_of[i] == o;
    return n;
}

/* --- strays ----------------------------------------------------------------------------------------- */

/* The operator guide next to the one that a strand follows. */
static uint32_t next_to(const struct groom *groom, uint32_t guide)
{
    const float *at = groom->guide_uv[groom->operator_guide[guide]];
    uint32_t best = guide;
    float least = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        const float *uv = groom->guide_uv[groom->operator_guide[o]];
        float square = (uv[0] - at[0]) * (uv[0] - at[0]) + (uv[1] - at[1]) * (uv[1] - at[1]);
        if (o != guide && followers(groom, o) > 0 && (best == guide || square < least)) {
            least = square;
            best = o;
        }
    }
    return best;
}

static void settle_strays(struct groom_fit *fit)
{
    struct random_search search;
    ck_ok(random_search_init(&search, fit, NULL, NULL));
    search.weights = weights;
    ck_ok(strays_settle(&search, 0, fit->n, 1, NULL, NULL));
    random_search_finish(&search);
}

START_TEST(strays_find_back)
{
    struct groom_sample *sample;
    struct groom_fit *fit = at_truth(GROOM_SAMPLE_COILY, &sample);
    struct groom *groom = fit->groom;
    uint32_t n_back = 0, n_strays = 0;
    double before = mean_error(fit);
    for (uint32_t i = 0; i < N; i += 30, n_strays++) {
        groom->operator_guide_of[i] = next_to(groom, groom->operator_guide_of[i]);
        for (uint32_t o = 0; o < groom->n_operators; o++)
            if (groom_operator_random_arrays(groom->operators[o].type) > 0 && !groom_operator_random_per_guide(groom->operators[o].type))
                groom->operators[o].random[0][i] = 0.1f;
    }
    double astray = mean_error(fit);
    settle_strays(fit);
    for (uint32_t i = 0; i < N; i++) {
        int same = groom->operator_guide_of[i] == sample->truth->operator_guide_of[i];
        if (i % 30 == 0)
            n_back += (uint32_t)same;
        else
            ck_assert(same); /* those that are where they belong are not asked, or stay */
    }
    ck_assert_uint_ge(10 * n_back, 8 * n_strays);
    ck_assert_double_lt(mean_error(fit) - before, 0.2 * (astray - before));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(strands_that_are_as_near_as_usual_stay)
{
    struct groom_sample *sample;
    struct groom_fit *fit = at_truth(GROOM_SAMPLE_SHORT, &sample);
    for (uint32_t i = 0; i < N; i++) /* all the same, so that none is far off */
        fit->groom->operators[0].random[0][i] *= 0.9f;
    float *kept = malloc(N * sizeof *kept);
    memcpy(kept, fit->groom->operators[0].random[0], N * sizeof *kept);
    double before = mean_error(fit);
    settle_strays(fit);
    uint32_t n_changed = 0;
    for (uint32_t i = 0; i < N; i++)
        n_changed += fit->groom->operators[0].random[0][i] != kept[i];
    ck_assert_uint_lt(n_changed, N / 4);
    ck_assert_double_le(mean_error(fit), before);
    free(kept);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- bundles --------------------------------------------------------------------------------------------- */

/* Strands of `gone` follow `into`: one bundle for two. */
static void join(struct groom *groom, uint32_t gone, uint32_t into)
{
    for (uint32_t i = 0; i < groom->n_strands; i++)
        if (groom->operator_guide_of[i] == gone)
            groom->operator_guide_of[i] = into;
}

/* The operator guide that most strands of a true bundle follow, and how many of them do. */
static uint32_t majority(const struct groom *groom, const struct groom *truth, uint32_t bundle, uint32_t *n)
{
    uint32_t *count = calloc(groom->n_operator_guides, sizeof *count), best = 0;
    for (uint32_t i = 0; i < groom->n_strands; i++)
        count[groom->operator_guide_of[i]] += truth->operator_guide_of[i] == bundle;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        best = count[o] > count[best] ? o : best;
    *n = count[best];
    free(count);
    return best;
}

/* Three pairs of the largest bundles are joined. */
static uint32_t join_some(struct groom *groom, uint32_t gone[3], uint32_t into[3])
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides && n < 3; o++) {
        uint32_t other = next_to(groom, o), taken = 0;
        for (uint32_t k = 0; k < n; k++)
            taken |= gone[k] == o || into[k] == o || gone[k] == other || into[k] == other;
        if (taken || followers(groom, o) < 6 || followers(groom, other) < 6)
            continue;
        gone[n] = o;
        into[n++] = other;
    }
    for (uint32_t k = 0; k < n; k++)
        join(groom, gone[k], into[k]);
    return n;
}

static void check_bundles(groom_sample_style style)
{
    struct groom_sample *sample;
    struct groom_fit *fit = at_truth(style, &sample);
    uint32_t gone[3], into[3], n_joined = join_some(fit->groom, gone, into), n_parted = 0;
    double joined = mean_error(fit);
    ck_assert_uint_eq(n_joined, 3);
    ck_ok(regroup(fit, weights, NULL, NULL));
    ck_ok(groom_validate(fit->groom, NULL));
    for (uint32_t k = 0; k < n_joined; k++) {
        uint32_t n_a, n_b, a = majority(fit->groom, sample->truth, gone[k], &n_a), b = majority(fit->groom, sample->truth, into[k], &n_b);
        n_parted += a != b && 3 * n_a >= 2 * followers(sample->truth, gone[k]) && 3 * n_b >= 2 * followers(sample->truth, into[k]);
    }
    ck_assert_uint_ge(n_parted, 2);
    ck_assert_double_lt(mean_error(fit), joined);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

START_TEST(bundles_that_are_two_are_parted)
{
    check_bundles(GROOM_SAMPLE_WAVY);
    check_bundles(GROOM_SAMPLE_CURLY);
}
END_TEST

START_TEST(bundles_that_are_one_stay)
{
    struct groom_sample *sample;
    struct groom_fit *fit = at_truth(GROOM_SAMPLE_WAVY, &sample);
    const struct groom *truth = sample->truth;
    ck_ok(regroup(fit, weights, NULL, NULL));
    ck_assert_mem_eq(fit->groom->operator_guide_of, truth->operator_guide_of, N * sizeof *truth->operator_guide_of);
    ck_assert_mem_eq(fit->groom->guides, truth->guides, (size_t)truth->n_guides * M * sizeof *truth->guides);
    ck_assert_mem_eq(fit->groom->instancing_weight, truth->instancing_weight, (size_t)N * truth->n_instancing * sizeof(float));
    for (uint32_t o = 0; o < truth->n_operators; o++)
        for (uint32_t k = 0; k < groom_operator_random_arrays(truth->operators[o].type); k++)
            ck_assert_mem_eq(fit->groom->operators[o].random[k], truth->operators[o].random[k],
                             (groom_operator_random_per_guide(truth->operators[o].type) ? truth->n_operator_guides : N) * sizeof(float));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* A spare is missed least, a bundle is the worst first; no operator guide takes part twice. */
START_TEST(trades_pair_what_is_missed_least_with_what_is_worst)
{
    struct groom_sample *sample;
    struct groom_fit *fit = at_truth(GROOM_SAMPLE_CURLY, &sample);
    uint32_t gone[3], into[3], n_joined = join_some(fit->groom, gone, into), n_found = 0;
    struct random_search search;
    struct trades trades;
    ck_ok(random_search_init(&search, fit, NULL, NULL));
    search.weights = weights;
    ck_ok(trades_init(&trades, &search, NULL, NULL));
    ck_assert_uint_ge(trades.n, n_joined);
    for (uint32_t t = 0; t < trades.n; t++) {
        ck_assert_uint_ne(trades.trade[t].bundle, trades.trade[t].spare);
        ck_assert_uint_eq(trades.of[trades.trade[t].bundle], t);
        ck_assert_uint_eq(trades.of[trades.trade[t].spare], t);
        for (uint32_t k = 0; k < n_joined; k++)
            n_found += trades.trade[t].bundle == into[k];
    }
    ck_assert_uint_eq(n_found, n_joined);
    for (uint32_t i = 0; i < N; i++) {
        uint32_t trade = trades.of[trades.other[i]];
        ck_assert(trade == TRADES_NONE || trades.trade[trade].spare != trades.other[i]);
    }
    trades_finish(&trades, memory_allocator(NULL));
    random_search_finish(&search);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_regroup", strays_find_back, strands_that_are_as_near_as_usual_stay, bundles_that_are_two_are_parted,
           bundles_that_are_one_stay, trades_pair_what_is_missed_least_with_what_is_worst)
