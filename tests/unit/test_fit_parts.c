/* K-means, K-medoids, smoothing, regions, spreads: each against brute force or what is known of it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/medoids.h"
#include "fit/regions.h"
#include "fit/simplex.h"
#include "fit/smooth.h"
#include "fit/spread.h"
#include "geometry/kmeans.h"
#include "groom/random.h"
#include "tests/support/test.h"

static const struct groom_random_key key = {11, 900};

/* n rows of d numbers around n_blobs places */
static float *blobs(uint32_t n, uint32_t d, uint32_t n_blobs, float spread)
{
    float *x = malloc((size_t)n * d * sizeof *x);
    struct groom_random_key places = {5, 1}, noise = {5, 2};
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t c = 0; c < d; c++)
            x[(size_t)i * d + c] = (float)(groom_random_normal(places, i % n_blobs, c) +
                                           spread * groom_random_normal(noise, i, c));
    return x;
}

static double squared(const float *a, const float *b, uint32_t d)
{
    double sum = 0;
    for (uint32_t i = 0; i < d; i++)
        sum += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
    return sum;
}

/* --- K-means -------------------------------------------------------------------- */

START_TEST(seeds_are_different_rows_and_cover_separate_blobs)
{
    float *x = blobs(3000, 13, 20, 0.01f);
    uint32_t chosen[20], n_chosen, seen[20] = {0};
    ck_ok(kmeans_seed(x, 3000, 13, 20, key, NULL, chosen, &n_chosen, NULL));
    ck_assert_uint_eq(n_chosen, 20);
    for (int i = 0; i < 20; i++)
        seen[chosen[i] % 20]++;
    for (int i = 0; i < 20; i++)
        ck_assert_uint_eq(seen[i], 1);
    free(x);
}
END_TEST

START_TEST(seeding_stops_where_no_place_is_left)
{
    float *x = blobs(50, 4, 3, 0);
    uint32_t chosen[10], n_chosen;
    ck_ok(kmeans_seed(x, 50, 4, 10, key, NULL, chosen, &n_chosen, NULL));
    ck_assert_uint_eq(n_chosen, 3);
    free(x);
}
END_TEST

static float *first_rows(const float *x, uint32_t k, uint32_t d)
{
    float *centres = malloc((size_t)k * d * sizeof *centres);
    memcpy(centres, x, (size_t)k * d * sizeof *centres);
    return centres;
}

START_TEST(an_iteration_is_nearest_centre_then_mean)
{
    enum { N = 611, D = 7, K = 9 };
    float *x = blobs(N, D, 11, 0.3f), *centres = first_rows(x, K, D), *old = first_rows(x, K, D);
    uint32_t cluster_of[N] = {0};
    struct kmeans_step step;
    ck_ok(kmeans_iterate(x, N, D, K, centres, cluster_of, NULL, &step, NULL));
    double mean[K][D] = {{0}}, n[K] = {0}, objective = 0;
    for (int i = 0; i < N; i++) {
        double least = INFINITY;
        for (int c = 0; c < K; c++)
            least = fmin(least, squared(x + i * D, old + c * D, D));
        double own = squared(x + i * D, old + cluster_of[i] * D, D);
        ck_assert_double_le(own, least * (1 + 1e-5) + 1e-6);
        objective += own / N;
        n[cluster_of[i]]++;
        for (int c = 0; c < D; c++)
            mean[cluster_of[i]][c] += x[i * D + c];
    }
    ck_assert_double_eq_tol(step.objective, objective, 1e-9);
    for (int c = 0; c < K; c++)
        for (int a = 0; a < D; a++)
            ck_assert_double_eq_tol(centres[c * D + a], mean[c][a] / n[c], 1e-6);
    free(x);
    free(centres);
    free(old);
}
END_TEST

START_TEST(the_objective_never_increases_and_no_cluster_is_empty)
{
    enum { N = 4000, D = 24, K = 150 };
    float *x = blobs(N, D, 60, 0.2f), *centres = first_rows(x, K, D);
    uint32_t *cluster_of = calloc(N, sizeof *cluster_of);
    double last = INFINITY;
    /* half of the centres start at one place: they lose all rows at once */
    for (int c = K / 2; c < K; c++)
        memcpy(centres + c * D, centres, D * sizeof *centres);
    for (int round = 0; round < 40; round++) {
        struct kmeans_step step;
        uint32_t count[K] = {0};
        ck_ok(kmeans_iterate(x, N, D, K, centres, cluster_of, NULL, &step, NULL));
        ck_assert_double_le(step.objective, last * (1 + 1e-6));
        last = step.objective;
        for (int i = 0; i < N; i++)
            count[cluster_of[i]]++;
        for (int c = 0; c < K; c++)
            ck_assert_uint_gt(count[c], 0);
        if (round == 0)
            ck_assert_uint_gt(step.n_refilled, 60);
    }
    free(x);
    free(centres);
    free(cluster_of);
}
END_TEST

/* Clusters found in some columns: the others' means follow, and a cluster without rows keeps its centre. */
START_TEST(means_follow_the_clusters_they_are_told)
{
    enum { N = 500, D = 7, K = 4 };
    float *x = blobs(N, D, 5, 0.2f), centres[K * D];
    double sum[K][D] = {{0}}, count[K] = {0};
    uint32_t cluster_of[N];
    for (int i = 0; i < N; i++) {
        cluster_of[i] = (uint32_t)(i % (K - 1));
        count[cluster_of[i]]++;
        for (int d = 0; d < D; d++)
            sum[cluster_of[i]][d] += (double)x[i * D + d];
    }
    for (int d = 0; d < D; d++)
        centres[(K - 1) * D + d] = (float)d;
    ck_ok(kmeans_means(x, N, D, K, cluster_of, centres, NULL, NULL));
    for (int c = 0; c < K; c++)
        for (int d = 0; d < D; d++)
            ck_assert_float_eq(centres[c * D + d], c < K - 1 ? (float)(sum[c][d] / count[c]) : (float)d);
    free(x);
}
END_TEST

START_TEST(kmeans_gives_the_same_bits_for_one_thread_and_three)
{
    enum { N = 3001, D = 31, K = 70 };
    float *x = blobs(N, D, 50, 0.4f), *centres[2];
    uint32_t *cluster_of[2], chosen[2][K], n_chosen;
    for (int run = 0; run < 2; run++) {
        struct groom_pool *pool;
        ck_ok(groom_pool_create(run ? 3 : 1, &pool));
        struct groom_context context = {.pool = pool};
        struct kmeans_step step;
        ck_ok(kmeans_seed(x, N, D, K, key, &context, chosen[run], &n_chosen, NULL));
        centres[run] = malloc(K * D * sizeof(float));
        for (int c = 0; c < K; c++)
            memcpy(centres[run] + c * D, x + chosen[run][c] * D, D * sizeof(float));
        cluster_of[run] = calloc(N, sizeof(uint32_t));
        for (int round = 0; round < 4; round++)
            ck_ok(kmeans_iterate(x, N, D, K, centres[run], cluster_of[run], &context, &step, NULL));
        groom_pool_destroy(pool);
    }
    ck_assert_mem_eq(chosen[0], chosen[1], sizeof chosen[0]);
    ck_assert_mem_eq(centres[0], centres[1], K * D * sizeof(float));
    ck_assert_mem_eq(cluster_of[0], cluster_of[1], N * sizeof(uint32_t));
    for (int run = 0; run < 2; run++) {
        free(centres[run]);
        free(cluster_of[run]);
    }
    free(x);
}
END_TEST

START_TEST(kmeans_survives_each_failing_allocation)
{
    enum { N = 300, D = 6, K = 10 };
    float *x = blobs(N, D, 12, 0.2f), *centres = first_rows(x, K, D), *kept = first_rows(x, K, D);
    uint32_t cluster_of[N] = {0}, chosen[K], n_chosen;
    for (size_t at = 0;; at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        struct kmeans_step step;
        groom_status st = kmeans_seed(x, N, D, K, key, &context, chosen, &n_chosen, NULL);
        if (st == GROOM_OK)
            st = kmeans_iterate(x, N, D, K, centres, cluster_of, &context, &step, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_mem_eq(centres, kept, K * D * sizeof *centres);
    }
    free(x);
    free(centres);
    free(kept);
}
END_TEST

/* --- smoothing -------------------------------------------------------------------- */

enum { M = 24 };

static void wiggle(float p[M][3])
{
    for (int j = 0; j < M; j++) {
        p[j][0] = 0.01f * (float)j;
        p[j][1] = 0.02f * sinf(1.7f * (float)j);
        p[j][2] = 0.3f - 0.02f * (float)j + 0.01f * cosf(0.9f * (float)j);
    }
}

/* One step of the heat equation, by Gauss's elimination on the rows of the free vertices. */
static void brute_step(double x[M], int n_fixed, double lambda)
{
    double diagonal[M], right[M];
    for (int j = n_fixed; j < M - 1; j++) {
        diagonal[j] = 1 + 2 * lambda;
        right[j] = x[j] + (j == n_fixed ? lambda * x[j - 1] : 0) + (j == M - 2 ? lambda * x[j + 1] : 0);
        if (j > n_fixed) {
            double factor = -lambda / diagonal[j - 1];
            diagonal[j] += factor * lambda;
            right[j] -= factor * right[j - 1];
        }
    }
    for (int j = M - 2; j >= n_fixed; j--)
        x[j] = (right[j] + (j < M - 2 ? lambda * x[j + 1] : 0)) / diagonal[j];
}

START_TEST(smoothing_is_the_steps_of_the_heat_equation)
{
    for (int n_fixed = 1; n_fixed <= 5; n_fixed += 2)
        for (int steps = 1; steps <= 80; steps += 79) {
            float p[M][3], q[M][3];
            wiggle(p);
            memcpy(q, p, sizeof q);
            ck_ok(smooth_polylines(p, 1, M, (uint32_t)n_fixed, 0.7, (uint32_t)steps, NULL, NULL));
            for (int c = 0; c < 3; c++) {
                double x[M];
                for (int j = 0; j < M; j++)
                    x[j] = q[j][c];
                for (int s = 0; s < steps; s++)
                    brute_step(x, n_fixed, 0.7);
                for (int j = 0; j < M; j++)
                    ck_assert_double_eq_tol(p[j][c], x[j], 1e-7);
            }
        }
}
END_TEST

START_TEST(smoothing_keeps_the_root_and_the_tip_to_the_bit)
{
    float p[M][3], q[M][3];
    wiggle(p);
    memcpy(q, p, sizeof q);
    ck_ok(smooth_polylines(p, 1, M, 3, 1, 80, NULL, NULL));
    ck_assert_mem_eq(p, q, 3 * sizeof p[0]);
    ck_assert_mem_eq(p[M - 1], q[M - 1], sizeof p[0]);
    ck_assert_mem_ne(p, q, sizeof p);
}
END_TEST

START_TEST(smoothing_without_end_is_a_straight_line)
{
    float p[M][3];
    wiggle(p);
    ck_ok(smooth_polylines(p, 1, M, 0, 1, 100000, NULL, NULL));
    for (int j = 0; j < M; j++)
        for (int c = 0; c < 3; c++)
            ck_assert_float_eq_tol(p[j][c], p[0][c] + (p[M - 1][c] - p[0][c]) * (float)j / (M - 1), 1e-6f);
}
END_TEST

START_TEST(smoothing_nothing_free_changes_nothing)
{
    float p[M][3], q[M][3];
    wiggle(p);
    memcpy(q, p, sizeof q);
    ck_ok(smooth_polylines(p, 1, M, M - 1, 1, 80, NULL, NULL));
    ck_ok(smooth_polylines(p, 1, M, M + 9, 1, 80, NULL, NULL));
    ck_ok(smooth_polylines(p, 1, M, 1, 0, 80, NULL, NULL));
    ck_ok(smooth_polylines(p, 1, M, 1, 1, 0, NULL, NULL));
    ck_ok(smooth_polylines(p, M / 2, 2, 1, 1, 80, NULL, NULL));
    ck_assert_mem_eq(p, q, sizeof p);
}
END_TEST

/* --- K-medoids --------------------------------------------------------------------- */

static double mean_nearest(const float *x, uint32_t n, uint32_t d, const uint32_t *medoids, uint32_t k)
{
    double sum = 0;
    for (uint32_t i = 0; i < n; i++) {
        double least = INFINITY;
        for (uint32_t s = 0; s < k; s++)
            least = fmin(least, sqrt(squared(x + (size_t)i * d, x + (size_t)medoids[s] * d, d)));
        sum += least / n;
    }
    return sum;
}

START_TEST(medoids_are_different_members_in_order)
{
    enum { N = 200, D = 6, K = 23 };
    float *x = blobs(N, D, 30, 0.1f);
    uint32_t medoids[K];
    double before, after;
    ck_ok(medoids_choose(x, N, D, K, 20, key, NULL, medoids, &before, &after, NULL));
    for (int s = 0; s < K; s++) {
        ck_assert_uint_lt(medoids[s], N);
        if (s)
            ck_assert_uint_gt(medoids[s], medoids[s - 1]);
    }
    ck_assert_double_le(after, before);
    ck_assert_double_eq_tol(after, mean_nearest(x, N, D, medoids, K), 1e-5);
    free(x);
}
END_TEST

START_TEST(no_single_swap_improves_medoids)
{
    enum { N = 60, D = 3, K = 7 };
    float *x = blobs(N, D, 9, 0.4f);
    uint32_t medoids[K];
    double after;
    ck_ok(medoids_choose(x, N, D, K, 1000, key, NULL, medoids, NULL, &after, NULL));
    for (int s = 0; s < K; s++)
        for (uint32_t other = 0; other < N; other++) {
            uint32_t kept = medoids[s];
            medoids[s] = other;
            ck_assert_double_ge(mean_nearest(x, N, D, medoids, K), after * (1 - 1e-5));
            medoids[s] = kept;
        }
    free(x);
}
END_TEST

START_TEST(one_medoid_is_the_best_one)
{
    enum { N = 40, D = 4 };
    float *x = blobs(N, D, 40, 1);
    uint32_t medoid;
    double after;
    ck_ok(medoids_choose(x, N, D, 1, 5, key, NULL, &medoid, NULL, &after, NULL));
    for (uint32_t other = 0; other < N; other++)
        ck_assert_double_ge(mean_nearest(x, N, D, &other, 1), after * (1 - 1e-6));
    free(x);
}
END_TEST

START_TEST(all_rows_or_rows_at_one_place_may_be_medoids)
{
    float x[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    uint32_t medoids[4];
    ck_ok(medoids_choose(x, 4, 2, 4, 5, key, NULL, medoids, NULL, NULL, NULL));
    for (uint32_t i = 0; i < 4; i++)
        ck_assert_uint_eq(medoids[i], i);
    ck_ok(medoids_choose(x, 4, 2, 2, 5, key, NULL, medoids, NULL, NULL, NULL));
    ck_assert_uint_ne(medoids[0], medoids[1]);
}
END_TEST

START_TEST(medoids_survive_each_failing_allocation)
{
    float *x = blobs(50, 4, 9, 0.2f);
    uint32_t medoids[5];
    for (size_t at = 0;; at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = medoids_choose(x, 50, 4, 5, 9, key, &context, medoids, NULL, NULL, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
    }
    free(x);
}
END_TEST

/* --- weights that sum to 1 ------------------------------------------------------------ */

/* A random problem: n columns of 9 numbers, a target near some blend of them. */
static void problem(uint32_t index, uint32_t n, double *gram, double *b)
{
    struct groom_random_key draw = {77, index};
    double column[8][9], target[9] = {0};
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t c = 0; c < 9; c++) {
            column[i][c] = groom_random_normal(draw, i, c);
            target[c] += column[i][c] * (groom_random_uniform(draw, i, 20) - 0.3);
        }
    for (uint32_t i = 0; i < n; i++) {
        b[i] = 0;
        for (uint32_t c = 0; c < 9; c++)
            b[i] += column[i][c] * target[c];
        for (uint32_t j = 0; j < n; j++) {
            gram[i * n + j] = 0;
            for (uint32_t c = 0; c < 9; c++)
                gram[i * n + j] += column[i][c] * column[j][c];
        }
    }
}

static double value_of(const double *gram, const double *b, uint32_t n, const double *w)
{
    double value = 0;
    for (uint32_t i = 0; i < n; i++) {
        value -= 2 * b[i] * w[i];
        for (uint32_t j = 0; j < n; j++)
            value += w[i] * gram[i * n + j] * w[j];
    }
    return value;
}

START_TEST(simplex_weights_are_the_minimum_on_a_fine_grid)
{
    for (uint32_t index = 0; index < 60; index++) {
        double gram[9], b[3], w[3], least = INFINITY;
        problem(index, 3, gram, b);
        simplex_solve(gram, b, 3, 3, w);
        for (int i = 0; i <= 100; i++)
            for (int j = 0; i + j <= 100; j++)
                least = fmin(least, value_of(gram, b, 3, (double[3]){i / 100., j / 100., (100 - i - j) / 100.}));
        ck_assert_double_le(value_of(gram, b, 3, w), least + 1e-9);
        ck_assert_double_ge(fmin(w[0], fmin(w[1], w[2])), 0);
        ck_assert_double_eq_tol(w[0] + w[1] + w[2], 1, 1e-9);
    }
}
END_TEST

/* Where no weight may grow at another's cost, the (convex) problem is solved. */
START_TEST(no_exchange_between_simplex_weights_is_an_improvement)
{
    for (uint32_t index = 0; index < 300; index++) {
        double gram[64], b[8], w[8], sum = 0;
        problem(index, 8, gram, b);
        simplex_solve(gram, b, 8, 8, w);
        double reached = value_of(gram, b, 8, w);
        for (int i = 0; i < 8; i++) {
            ck_assert_double_ge(w[i], 0);
            sum += w[i];
            for (int j = 0; j < 8; j++) {
                double step = fmin(w[j], 1e-4);
                w[i] += step;
                w[j] -= step;
                ck_assert_double_ge(value_of(gram, b, 8, w), reached - 1e-9);
                w[i] -= step;
                w[j] += step;
            }
        }
        ck_assert_double_eq_tol(sum, 1, 1e-9);
    }
}
END_TEST

START_TEST(a_limited_support_is_kept_and_better_than_one)
{
    for (uint32_t index = 0; index < 100; index++) {
        double gram[64], b[8], w[8], one[8];
        uint32_t n_above = 0;
        problem(index, 8, gram, b);
        simplex_solve(gram, b, 8, 3, w);
        simplex_solve(gram, b, 8, 1, one);
        for (int i = 0; i < 8; i++)
            n_above += w[i] > 0;
        ck_assert_uint_le(n_above, 3);
        ck_assert_double_le(value_of(gram, b, 8, w), value_of(gram, b, 8, one) + 1e-12);
    }
}
END_TEST

START_TEST(columns_that_are_alike_are_survived)
{
    double gram[16], b[4], w[4], sum = 0;
    for (int i = 0; i < 16; i++)
        gram[i] = 2;
    for (int i = 0; i < 4; i++)
        b[i] = 1;
    simplex_solve(gram, b, 4, 4, w);
    for (int i = 0; i < 4; i++)
        sum += w[i];
    ck_assert_double_eq_tol(sum, 1, 1e-9);
}
END_TEST

/* --- regions ------------------------------------------------------------------------ */

enum { SIDE = 20 };

/* Of four unequal parts of a square. */
static uint32_t part_of(uint32_t x, uint32_t y) { return (x >= 12) + 2 * (y >= 14); }

/* Edges of a grid: rugged, and on average eight times as costly from part to part. */
static uint32_t grid(struct region_edge *edge)
{
    struct groom_random_key noise = {7, 3};
    uint32_t n = 0;
    for (uint32_t y = 0; y < SIDE; y++)
        for (uint32_t x = 0; x < SIDE; x++)
            for (int way = 0; way < 2; way++) {
                uint32_t x2 = x + (way == 0), y2 = y + (way == 1);
                if (x2 == SIDE || y2 == SIDE)
                    continue;
                double cost = part_of(x, y) == part_of(x2, y2) ? 1 : 8;
                edge[n] = (struct region_edge){y * SIDE + x, y2 * SIDE + x2, cost * (0.4 + 1.2 * groom_random_uniform(noise, n, 0))};
                n++;
            }
    return n;
}

START_TEST(regions_end_where_neighbours_are_unlike)
{
    static struct region_edge edge[2 * SIDE * SIDE];
    uint32_t region[SIDE * SIDE], of_part[4], n = grid(edge);
    ck_ok(regions_merge(edge, n, SIDE * SIDE, 4, region, memory_allocator(NULL)));
    for (uint32_t p = 0; p < 4; p++)
        of_part[p] = region[(p / 2) * 16 * SIDE + (p % 2) * 16];
    for (uint32_t k = 0; k < SIDE * SIDE; k++)
        ck_assert_uint_eq(region[k], of_part[part_of(k % SIDE, k / SIDE)]);
    ck_assert_uint_eq((1u << of_part[0]) | (1u << of_part[1]) | (1u << of_part[2]) | (1u << of_part[3]), 15);
}
END_TEST

START_TEST(islands_beyond_the_number_of_regions_are_joined)
{
    const struct region_edge edge[] = {{0, 1, 1}, {2, 3, 1}, {4, 5, 1}, {6, 6, 0}};
    uint32_t region[7];
    ck_ok(regions_merge(edge, 4, 7, 2, region, memory_allocator(NULL)));
    ck_assert_uint_eq(region[0], region[1]);
    for (uint32_t k = 2; k < 7; k++)
        ck_assert_uint_eq(region[k], 1);
}
END_TEST

START_TEST(regions_survive_each_failing_allocation)
{
    static struct region_edge edge[2 * SIDE * SIDE];
    uint32_t region[SIDE * SIDE], n = grid(edge);
    struct test_failing_allocator state;
    struct groom_allocator allocator;
    size_t fail_at = 0;
    for (groom_status st = GROOM_ENOMEM; st != GROOM_OK; fail_at++) {
        test_failing_allocator_init(&state, fail_at, &allocator);
        st = regions_merge(edge, n, SIDE * SIDE, 4, region, &allocator);
        ck_assert(st == GROOM_OK || st == GROOM_ENOMEM);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
    }
    ck_assert_uint_gt(fail_at, 10);
}
END_TEST

/* --- spreads ------------------------------------------------------------------------------- */

#define MEASURED 400

/* Things around 5, 2 apart, measured with errors of 1 times 0.5 to 3.5. */
static void measure(struct spread_sample sample[MEASURED], double *thing)
{
    for (uint32_t i = 0; i < MEASURED; i++) {
        double size = 0.5 + (double)(i % 4);
        thing[i] = 5 + 2 * groom_random_normal(key, i, 1);
        sample[i] = (struct spread_sample){thing[i] + size * groom_random_normal(key, i, 2), 1, size};
    }
}

START_TEST(a_law_is_told_from_the_errors_of_its_samples)
{
    static struct spread_sample sample[MEASURED];
    static double thing[MEASURED];
    struct spread_law law;
    double off = 0, measured = 0;
    measure(sample, thing);
    spread_find(sample, MEASURED, 3, &law); /* and what is known otherwise is wrong */
    ck_assert_double_eq_tol(law.mean, 5, 0.3);
    ck_assert_double_eq_tol(sqrt(law.variance), 2, 0.25);
    ck_assert_double_eq_tol(sqrt(law.error), 1, 0.15);
    for (uint32_t i = 0; i < MEASURED; i++) {
        off += pow(spread_expect(&law, &sample[i]) - thing[i], 2);
        measured += pow(sample[i].value - thing[i], 2);
    }
    ck_assert_double_lt(off, 0.5 * measured);
}
END_TEST

START_TEST(samples_without_errors_are_the_law)
{
    static struct spread_sample sample[MEASURED];
    static double thing[MEASURED];
    struct spread_law law;
    measure(sample, thing);
    for (uint32_t i = 0; i < MEASURED; i++)
        sample[i] = (struct spread_sample){thing[i], 1 + (double)(i % 3), 0};
    spread_find(sample, MEASURED, 0, &law);
    ck_assert_double_eq_tol(sqrt(law.variance), 2, 0.2);
    ck_assert_double_eq_tol(spread_expect(&law, &sample[7]), thing[7], 1e-12);
}
END_TEST

START_TEST(a_law_of_nothing_is_none)
{
    struct spread_sample same[2] = {{3, 1, 1}, {3, 1, 2}};
    struct spread_law law;
    spread_find(NULL, 0, 0, &law);
    ck_assert_double_eq(law.mean + law.variance, 0);
    spread_find(same, 2, 0, &law);
    ck_assert_double_eq(law.mean, 3);
    ck_assert_double_eq(law.variance, 0);
    ck_assert_double_eq(spread_expect(&law, &same[1]), 3);
}
END_TEST

TEST_SUITE("fit_parts", seeds_are_different_rows_and_cover_separate_blobs, seeding_stops_where_no_place_is_left,
           an_iteration_is_nearest_centre_then_mean,
           the_objective_never_increases_and_no_cluster_is_empty, means_follow_the_clusters_they_are_told,
           kmeans_gives_the_same_bits_for_one_thread_and_three, kmeans_survives_each_failing_allocation,
           smoothing_is_the_steps_of_the_heat_equation, smoothing_keeps_the_root_and_the_tip_to_the_bit,
           smoothing_without_end_is_a_straight_line, smoothing_nothing_free_changes_nothing,
           medoids_are_different_members_in_order, no_single_swap_improves_medoids, one_medoid_is_the_best_one,
           all_rows_or_rows_at_one_place_may_be_medoids, medoids_survive_each_failing_allocation,
           simplex_weights_are_the_minimum_on_a_fine_grid, no_exchange_between_simplex_weights_is_an_improvement,
           a_limited_support_is_kept_and_better_than_one, columns_that_are_alike_are_survived,
           regions_end_where_neighbours_are_unlike, islands_beyond_the_number_of_regions_are_joined,
           regions_survive_each_failing_allocation, a_law_is_told_from_the_errors_of_its_samples,
           samples_without_errors_are_the_law, a_law_of_nothing_is_none)
