/* The covariance of the strands' statistics: what it is told by, and by how many. */
#include <math.h>
#include <stdlib.h>

#include "fit/correlation.h"
#include "fit/moments.h"
#include "groom/random.h"
#include "tests/support/test.h"

enum { PAIRS = 600, BUNDLES = 60 };

struct told {
    float values[PAIRS][MOMENTS_COUNT];
    uint32_t bundle[PAIRS];
    double size[MOMENTS_COUNT];
};

/* Independent normal numbers of deviation 1. */
static struct told *tell(void)
{
    struct told *told = malloc(sizeof *told);
    struct groom_random_key key = {7, 1};
    for (uint32_t i = 0; i < PAIRS; i++) {
        told->bundle[i] = i % BUNDLES;
        for (uint32_t f = 0; f < MOMENTS_COUNT; f++) {
            double sum = -6; /* of twelve uniform ones */
            for (uint32_t k = 0; k < 12; k++)
                sum += (double)groom_random_uniform(key, i, 12 * f + k);
            told->values[i][f] = (float)sum;
        }
    }
    for (int f = 0; f < MOMENTS_COUNT; f++)
        told->size[f] = 1;
    return told;
}

/* The first n pairs alone have this one. */
static void silence(struct told *told, int f, uint32_t n)
{
    for (uint32_t i = n; i < PAIRS; i++)
        told->values[i][f] = NAN;
}

/* Of statistic f, from the factor. */
static double variance(const double *cholesky, int f)
{
    double sum = 0;
    for (int g = 0; g <= f; g++)
        sum += cholesky[f * MOMENTS_COUNT + g] * cholesky[f * MOMENTS_COUNT + g];
    return sum;
}

static double *covariance_of(struct told *told, double floor)
{
    double *cholesky = calloc(MOMENTS_COUNT * MOMENTS_COUNT, sizeof *cholesky);
    ck_ok(moments_covariance(told->values[0], PAIRS, told->bundle, BUNDLES, told->size, floor, cholesky, NULL, NULL));
    return cholesky;
}

/* Sums over bundles: as the means of so many independent numbers scatter. */
START_TEST(means_scatter_as_their_pairs_do)
{
    struct told *told = tell();
    double *cholesky = covariance_of(told, 0);
    for (int f = 0; f < MOMENTS_COUNT; f++) {
        ck_assert_double_gt(variance(cholesky, f), 0.8 / PAIRS);
        ck_assert_double_lt(variance(cholesky, f), 2.0 / PAIRS);
    }
    free(cholesky);
    free(told);
}
END_TEST

/* One pair does not scatter about its own mean: that is no certainty, and neither is what a handful does. */
START_TEST(what_few_pairs_tell_is_left_out)
{
    enum { ONE = MOMENTS_LOCAL, FEW, ENOUGH, NONE };
    struct told *told = tell();
    silence(told, ONE, 1);
    silence(told, FEW, PAIRS / 100);
    silence(told, ENOUGH, PAIRS / 20);
    silence(told, NONE, 0);
    double *cholesky = covariance_of(told, 0.01);
    ck_assert_double_gt(variance(cholesky, ONE), 1e5);
    ck_assert_double_gt(variance(cholesky, FEW), 1e5);
    ck_assert_double_gt(variance(cholesky, NONE), 1e5);
    ck_assert_double_lt(variance(cholesky, ENOUGH), 2.0 / (PAIRS / 20));
    ck_assert_double_gt(variance(cholesky, ENOUGH), 0.3 / (PAIRS / 20));
    free(cholesky);
    free(told);
}
END_TEST

/* --- products of columns ------------------------------------------------------------------------ */

static const float *rows_of_numbers(uint32_t n_rows, uint32_t n)
{
    float *values = malloc((size_t)n_rows * n * sizeof *values);
    struct groom_random_key key = {3, 1};
    for (uint32_t i = 0; i < n_rows; i++)
        for (uint32_t f = 0; f < n; f++)
            values[(size_t)i * n + f] = (float)groom_random_uniform(key, i, f) - 0.4f;
    return values;
}

static double product(const float *values, uint32_t n_rows, uint32_t n, uint32_t f, uint32_t g)
{
    double sum = 0;
    for (uint32_t i = 0; i < n_rows; i++)
        sum += (double)values[(size_t)i * n + f] * values[(size_t)i * n + g];
    return sum;
}

/* Whether the last tile lies upon a part of the one before or not, and whether rows fill their blocks or not; to the same bits by
 * any instructions and threads. */
START_TEST(columns_are_correlated)
{
    static const uint32_t columns[] = {16, 20, 32, 60, MOMENTS_COUNT, 256}, rows[] = {1, 63, 64, 700};
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context three = {.pool = pool};
    for (int c = 0; c < 6; c++)
        for (int r = 0; r < 4; r++) {
            uint32_t n = columns[c], n_rows = rows[r];
            const float *values = rows_of_numbers(n_rows, n);
            float *out = calloc((size_t)n * n, sizeof *out), *other = calloc((size_t)n * n, sizeof *out);
            correlation_of(values, n_rows, n, out, NULL);
            correlation_with(KERNEL_BASELINE, values, n_rows, n, other, &three);
            for (uint32_t f = 0; f < n; f++)
                for (uint32_t g = 0; g <= f; g++) {
                    ck_assert(out[f * n + g] == other[f * n + g]);
                    ck_assert_double_eq_tol(out[f * n + g], product(values, n_rows, n, f, g), 1e-6 * n_rows);
                }
            free(out);
            free(other);
            free((void *)(uintptr_t)values);
        }
    groom_pool_destroy(pool);
}
END_TEST

TEST_SUITE("fit_moments", means_scatter_as_their_pairs_do, what_few_pairs_tell_is_left_out, columns_are_correlated)
