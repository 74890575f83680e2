/* stage `operators`: the paper's losses, the statistics that are matched, and what the stage finds */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/dense.h"
#include "fit/loss_determinant.h"
#include "fit/moments.h"
#include "fit/state.h"
#include "groom/mesh.h"
#include "groom/random.h"
#include "groom/sample.h"
#include "groom/strands.h"
#include "quality/loss_wasserstein.h"
#include "tests/support/test.h"

static const struct groom_random_key key = {3, 700};

static float *noise(uint32_t n, uint32_t stream)
{
    float *x = malloc(n * sizeof *x);
    for (uint32_t i = 0; i < n; i++)
        x[i] = (float)groom_random_normal((struct groom_random_key){9, stream}, i, 0);
    return x;
}

/* --- dense ------------------------------------------------------------------------- */

START_TEST(a_symmetric_system_is_solved)
{
    double a[9] = {4, 0, 0, 2, 5, 0, 1, 3, 6}, x[3] = {11, 21, 25}; /* of (1, 2, 3) */
    ck_assert(dense_cholesky(a, 3));
    dense_forward(a, 3, x);
    dense_backward(a, 3, x);
    for (int i = 0; i < 3; i++)
        ck_assert_double_eq_tol(x[i], i + 1, 1e-12);
    double indefinite[4] = {1, 0, 2, 1};
    ck_assert(!dense_cholesky(indefinite, 2));
}
END_TEST

/* --- sliced Wasserstein ----------------------------------------------------------------- */

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void project(const float *x, uint32_t n, uint32_t d, const double *direction, double *out)
{
    for (uint32_t i = 0; i < n; i++) {
        out[i] = 0;
        for (uint32_t c = 0; c < d; c++)
            out[i] += (double)x[i * d + c] * direction[c];
    }
    qsort(out, n, sizeof *out, compare_doubles);
}

/* Eq. 11 as it is written, over n. */
static double sliced(const float *a, const float *b, uint32_t n, uint32_t d)
{
    double sum = 0, *p = malloc(n * sizeof *p), *q = malloc(n * sizeof *q), *direction = malloc(d * sizeof *direction);
    for (uint32_t k = 0; k < d; k++) {
        double square = 0;
        for (uint32_t c = 0; c < d; c++) {
            direction[c] = (float)groom_random_normal(key, k, c);
            square += direction[c] * direction[c];
        }
        for (uint32_t c = 0; c < d; c++)
            direction[c] /= sqrt(square);
        project(a, n, d, direction, p);
        project(b, n, d, direction, q);
        for (uint32_t i = 0; i < n; i++)
            sum += (p[i] - q[i]) * (p[i] - q[i]);
    }
    free(p);
    free(q);
    free(direction);
    return sum / d / n;
}

START_TEST(the_sliced_loss_is_that_of_its_equation)
{
    float *a = noise(40 * 7, 1), *b = noise(40 * 7, 2);
    double loss;
    ck_ok(loss_wasserstein(a, b, 40, 7, 0, key, NULL, &loss, NULL));
    ck_assert_double_eq_tol(loss, sliced(a, b, 40, 7), 1e-5);
    ck_ok(loss_wasserstein(a, b, 1, 7, 3, key, NULL, &loss, NULL));
    ck_assert(isfinite(loss));
    free(a);
    free(b);
}
END_TEST

START_TEST(the_order_of_rows_does_not_matter_and_a_shift_costs_its_square)
{
    float *a = noise(500, 1), b[500], c[500];
    double loss;
    for (int i = 0; i < 500; i++) {
        b[i] = a[499 - i];
        c[i] = a[(i * 7) % 500] + 0.25f;
    }
    ck_ok(loss_wasserstein(a, b, 500, 1, 0, key, NULL, &loss, NULL));
    ck_assert_double_eq(loss, 0);
    ck_ok(loss_wasserstein(a, c, 500, 1, 0, key, NULL, &loss, NULL));
    ck_assert_double_eq_tol(loss, 0.0625, 1e-6);
    free(a);
}
END_TEST

static struct groom_context three_threads(void)
{
    struct groom_context context = {0};
    ck_ok(groom_pool_create(3, &context.pool));
    return context;
}

START_TEST(losses_have_the_same_bits_for_any_threads)
{
    enum { N = 700, M = 21 };
    float *a = noise(N * M * 3, 1), *b = noise(N * M * 3, 2);
    const float (*p)[3] = (const float (*)[3])(void *)a, (*q)[3] = (const float (*)[3])(void *)b;
    struct groom_context context = three_threads();
    struct loss_shape one, three;
    double of_one, of_three;
    ck_ok(loss_shape(p, q, N, M, 0.1, 400, key, NULL, &one, NULL));
    ck_ok(loss_shape(p, q, N, M, 0.1, 400, key, &context, &three, NULL));
    ck_assert_mem_eq(&one, &three, sizeof one);
    ck_assert_double_eq(one.total, one.spectra + 400 * one.segments);
    ck_ok(loss_determinant(p, q, 14, 50, M, 0.1, 0.1, determinant_clump_kernel, NULL, &of_one, NULL));
    ck_ok(loss_determinant(p, q, 14, 50, M, 0.1, 0.1, determinant_clump_kernel, &context, &of_three, NULL));
    ck_assert_mem_eq(&of_one, &of_three, sizeof of_one);
    groom_pool_destroy(context.pool);
    free(a);
    free(b);
}
END_TEST

/* A segment that turns f times along the strand has its power at f, whatever its phase and the unit. */
START_TEST(features_are_segments_and_their_spectrum)
{
    enum { M = 33, F = 5 };
    float points[M][3] = {{0}}, segments[3 * (M - 1)], magnitudes[3 * ((M - 1) / 2 + 1)];
    for (int j = 1; j < M; j++) {
        points[j][0] = points[j - 1][0] + 0.02f * (float)cos(2 * 3.14159265358979 * F * (j - 1) / (M - 1) + 0.7);
        points[j][1] = points[j - 1][1] + 0.5f;
    }
    ck_ok(loss_shape_features((const float (*)[3])points, 1, M, 2, segments, magnitudes, NULL, NULL));
    for (int k = 0; k <= (M - 1) / 2; k++) {
        ck_assert_double_eq_tol(magnitudes[k], k == F ? 0.01 * (M - 1) / 2 : 0, 1e-5);
        ck_assert_double_eq_tol(magnitudes[(M - 1) / 2 + 1 + k], k == 0 ? 0.25 * (M - 1) : 0, 1e-4);
    }
    for (int j = 0; j < M - 1; j++)
        ck_assert_double_eq_tol(segments[M - 1 + j], 0.25, 1e-6);
}
END_TEST

/* --- determinants ------------------------------------------------------------------------- */

/* n straight strands of m vertices; strand i starts at (0.01 i, 0, 0) and has this length. */
static float (*straight(uint32_t n, uint32_t m, const float *length))[3]
{
    float (*points)[3] = malloc((size_t)n * m * sizeof *points);
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < m; j++) {
            float *x = points[i * m + j];
            x[0] = 0.01f * (float)i, x[1] = length[i] * (float)j / (float)(m - 1), x[2] = 0;
        }
    return points;
}

START_TEST(kernels_of_known_strands_have_known_determinants)
{
    float (*p)[3] = straight(2, 5, (const float[]){0.1f, 0.15f});
    double kernel[9], expected;
    determinant_scale_kernel((const float (*)[3])p, 2, 5, 0.1, 0.1, kernel);
    expected = exp(-0.25 / 0.1);
    ck_assert_double_eq_tol(kernel[2], expected, 1e-5);
    ck_assert_double_eq_tol(determinant_log(kernel, 2), log(pow(1 + DETERMINANT_EPSILON, 2) - expected * expected), 1e-5);
    free(p);
    p = straight(3, 5, (const float[]){0.1f, 0.1f, 0.1f}); /* parallel: distance as at the roots */
    determinant_clump_kernel((const float (*)[3])p, 3, 5, 0.1, 0.1, kernel);
    ck_assert_double_eq_tol(kernel[3], exp(-10), 1e-7);
    ck_assert_double_eq_tol(kernel[6], exp(-10), 1e-7);
    determinant_scale_kernel((const float (*)[3])p, 3, 5, 0.1, 0.1, kernel); /* alike: of rank 1 */
    ck_assert_double_eq_tol(determinant_log(kernel, 3), log(3 + DETERMINANT_EPSILON) + 2 * log(DETERMINANT_EPSILON), 1e-6);
    free(p);
}
END_TEST

START_TEST(strands_from_one_root_have_a_determinant)
{
    float *p = noise(6 * 4 * 3, 5);
    double kernel[36];
    for (int i = 1; i < 6; i++)
        memcpy(p + i * 12, p, 3 * sizeof *p);
    memcpy(p + 12, p, 12 * sizeof *p); /* and two that are the same */
    determinant_clump_kernel((const float (*)[3])(void *)p, 6, 4, 1, 0.1, kernel);
    ck_assert(isfinite(determinant_log(kernel, 6)));
    free(p);
}
END_TEST

START_TEST(clumped_strands_have_smaller_determinants_and_the_unit_cancels)
{
    float length[20], (*p)[3], (*q)[3], (*big)[3];
    double loss, again, same;
    for (int i = 0; i < 20; i++)
        length[i] = 0.1f;
    p = straight(20, 9, length), q = straight(20, 9, length), big = straight(20, 9, length);
    for (int v = 0; v < 180; v++) {
        q[v][0] += (0.1f - q[v][0]) * 0.9f * (float)(v % 9) / 8;
        for (int c = 0; c < 3; c++)
            big[v][c] = 40 * p[v][c];
    }
    double a[400], b[400];
    determinant_clump_kernel((const float (*)[3])p, 20, 9, 0.1, 1, a);
    determinant_clump_kernel((const float (*)[3])q, 20, 9, 0.1, 1, b);
    ck_assert_double_gt(determinant_log(a, 20), determinant_log(b, 20) + 0.1);
    ck_ok(loss_determinant((const float (*)[3])p, (const float (*)[3])p, 1, 20, 9, 0.1, 0.1, determinant_scale_kernel, NULL, &same, NULL));
    ck_assert_double_eq(same, 0);
    for (int v = 0; v < 180; v++)
        q[v][1] *= 1 + 0.02f * (float)(v / 9);
    ck_ok(loss_determinant((const float (*)[3])p, (const float (*)[3])q, 2, 10, 9, 0.1, 0.1, determinant_scale_kernel, NULL, &loss, NULL));
    for (int v = 0; v < 180; v++)
        for (int c = 0; c < 3; c++)
            q[v][c] *= 40;
    ck_ok(loss_determinant((const float (*)[3])big, (const float (*)[3])q, 2, 10, 9, 4, 0.1, determinant_scale_kernel, NULL, &again, NULL));
    ck_assert_double_gt(loss, 0.1);
    ck_assert_double_eq_tol(again, loss, 1e-3 * loss);
    free(p);
    free(q);
    free(big);
}
END_TEST

START_TEST(a_batch_is_a_strand_and_its_nearest)
{
    float uv[100][2];
    uint32_t strand[8 * 9];
    for (int i = 0; i < 100; i++)
        uv[i][0] = 0.1f * (float)(i % 10), uv[i][1] = 0.1f * (float)(i / 10);
    ck_ok(determinant_batches((const float (*)[2])uv, 100, 8, 9, key, NULL, strand, NULL));
    for (int k = 0; k < 8; k++)
        for (int i = 0; i < 9; i++) {
            const float *middle = uv[strand[k * 9]], *other = uv[strand[k * 9 + i]];
            ck_assert_double_le(hypot(other[0] - middle[0], other[1] - middle[1]), 0.42);
        }
}
END_TEST

/* --- statistics ------------------------------------------------------------------------------ */

/* Helices around the y axis side by side. */
static void coils(uint32_t n, uint32_t m, double radius, double turns, double unit, float (*points)[3])
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < m; j++) {
            double v = (double)j / (m - 1), angle = 6.283185307 * (turns * v + 0.37 * i);
            points[i * m + j][0] = (float)(unit * (0.05 * i + radius * cos(angle)));
            points[i * m + j][1] = (float)(unit * -0.3 * v);
            points[i * m + j][2] = (float)(unit * radius * sin(angle));
        }
}

static void statistics(double radius, double turns, double unit, double mean[MOMENTS_COUNT])
{
    enum { N = 8, M = 60 };
    static float base[N * M][3], points[N * M][3], values[N / 2 * MOMENTS_COUNT];
    static const uint32_t bundle[N] = {0, 1, 0, 1, 0, 2, 0, 2}; /* pairs of one, of two, ... */
    struct moments_plan plan = {.n_pairs = N / 2, .m = M, .base = (const float (*)[3])base,
                                .guide = (const float (*)[3])base, .bundle = bundle};
    coils(N, M, 0, 0, unit, base);
    coils(N, M, radius, turns, unit, points);
    ck_ok(moments_plan_init(&plan, NULL, NULL));
    moments_measure(&plan, (const float (*)[3])points, values, NULL);
    moments_mean(values, N / 2, mean);
}

static uint32_t strongest(const double mean[MOMENTS_COUNT])
{
    uint32_t best = 3;
    for (uint32_t q = 3; q < MOMENTS_FREQUENCIES; q++)
        if (mean[MOMENTS_SPECTRUM + q] != 0 && mean[MOMENTS_SPECTRUM + q] > mean[MOMENTS_SPECTRUM + best])
            best = q;
    return best;
}

START_TEST(statistics_do_not_know_the_unit_and_see_curls)
{
    double metres[MOMENTS_COUNT], inches[MOMENTS_COUNT], wider[MOMENTS_COUNT], faster[MOMENTS_COUNT];
    statistics(0.004, 6, 1, metres);
    statistics(0.004, 6, 39.37, inches);
    statistics(0.008, 6, 1, wider);
    statistics(0.004, 18, 1, faster);
    for (int f = 0; f < MOMENTS_COUNT; f++)
        if ((f < MOMENTS_DISTANCE || f >= MOMENTS_ALONG) && (f < MOMENTS_GUIDE_DISTANCE || f >= MOMENTS_GUIDE_ALONG))
            ck_assert_double_eq_tol(metres[f], inches[f], 0.01);
    uint32_t peak = strongest(metres);
    ck_assert_double_eq_tol(wider[MOMENTS_SPECTRUM + peak] - metres[MOMENTS_SPECTRUM + peak], 2 * log(2), 0.05);
    ck_assert_uint_gt(strongest(faster), peak + 3);
    ck_assert_double_gt(wider[MOMENTS_LENGTH + 2], metres[MOMENTS_LENGTH + 2]);
}
END_TEST

/* --- the stage ----------------------------------------------------------------------------------- */

static struct groom_sample *sample_of(groom_sample_style style, uint32_t n, uint32_t m)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    groom_sample_options_init(style, &options);
    options.n_strands = n;
    options.n_vertices = m;
    options.n_guides = n / 4 < 200 ? n / 4 : 200;
    options.n_operator_guides = n / 8 < 100 ? n / 8 : 100;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    return sample;
}

/* A fit before stage operators, with the truth's guides and other random numbers. */
static struct groom_fit *fit_of(const struct groom_sample *sample, uint32_t m, uint32_t refinements)
{
    struct groom_fit_options options;
    struct groom_fit *fit;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.vertices = m;
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    options.operators_auto = 0;
    options.n_operators = sample->truth->n_operators;
    options.seed = 5;
    options.stages.operators.refinements = refinements;
    for (uint32_t o = 0; o < options.n_operators; o++)
        options.operators[o] = sample->truth->operators[o].type;
    ck_ok(groom_fit_create(sample->capture, sample->head, &options, NULL, &fit, NULL));
    while (fit->stage < FIT_STAGE_operators)
        ck_ok(groom_fit_step(fit, NULL, NULL));
    return fit;
}

static void know_guides(struct groom_fit *fit, const struct groom *truth)
{
    struct groom *groom;
    ck_ok(groom_clone(truth, NULL, &groom, NULL));
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        groom_draw_random(groom, &groom->operators[o], fit->options.seed);
        memcpy(groom->operators[o].parameter, fit->groom->operators[o].parameter, sizeof groom->operators[o].parameter);
    }
    groom_destroy(fit->groom);
    fit->groom = groom;
}

static groom_status finish(struct groom_fit *fit, const struct groom_context *context)
{
    groom_status st = GROOM_OK;
    while (st == GROOM_OK && fit->stage == FIT_STAGE_operators)
        st = groom_fit_step(fit, context, NULL);
    return st;
}

static void same_parameters(const struct groom *a, const struct groom *b)
{
    for (uint32_t o = 0; o < a->n_operators; o++)
        ck_assert_mem_eq(a->operators[o].parameter, b->operators[o].parameter, sizeof a->operators[o].parameter);
}

static const struct groom_fit_loss *loss_of(const struct groom_fit *fit, const char *name)
{
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    for (uint32_t i = 0; i < report->n_losses; i++)
        if (strcmp(report->losses[i].stage, "operators") == 0 && strcmp(report->losses[i].name, name) == 0)
            return &report->losses[i];
    ck_abort_msg("no loss %s", name);
    return NULL;
}

/* With the guides known, no parameter may be off by more than this share. */
static void finds(groom_sample_style style, double most)
{
    struct groom_sample *sample = sample_of(style, 1600, 60);
    struct groom_fit *fit = fit_of(sample, 60, 14);
    struct groom_context context = three_threads();
    uint32_t n;
    know_guides(fit, sample->truth);
    ck_ok(finish(fit, &context));
    for (uint32_t o = 0; o < sample->truth->n_operators; o++) {
        const struct groom_operator_parameter *p = groom_operator_parameters(sample->truth->operators[o].type, &n);
        for (uint32_t k = 0; k < n; k++) {
            double right = sample->truth->operators[o].parameter[k], found = fit->groom->operators[o].parameter[k];
            ck_assert_msg(fabs(found - right) < most * right, "%s: %s %g, not %g",
                          groom_operator_name(sample->truth->operators[o].type), p[k].name, found, right);
        }
    }
    ck_assert_double_lt(loss_of(fit, "shape")->after, loss_of(fit, "shape")->before);
    ck_assert_double_lt(loss_of(fit, "misfit")->after, 1000);
    groom_pool_destroy(context.pool);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

START_TEST(straight_hair_is_found) { finds(GROOM_SAMPLE_STRAIGHT, 0.2); } END_TEST
START_TEST(bent_hair_is_found) { finds(GROOM_SAMPLE_BENT, 0.2); } END_TEST

START_TEST(the_stage_has_the_same_bits_for_any_threads_and_after_any_interruption)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_WAVY, 200, 30);
    struct groom_fit *one = fit_of(sample, 30, 2), *three = fit_of(sample, 30, 2);
    struct groom_context context = three_threads();
    ck_ok(finish(one, NULL));
    ck_ok(finish(three, &context));
    same_parameters(one->groom, three->groom);
    ck_assert_mem_eq(&one->report, &three->report, sizeof one->report);
    groom_pool_destroy(context.pool);
    groom_fit_destroy(one);
    groom_fit_destroy(three);
    groom_sample_destroy(sample);
}
END_TEST

/* The same capture twice as large. */
START_TEST(parameters_do_not_depend_on_the_unit)
{
    static const double power[GROOM_OPERATOR_COUNT][4] = {[GROOM_OPERATOR_CURL] = {1, -1, -1, 0}, [GROOM_OPERATOR_FRIZZ] = {-1, 1}};
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 300, 30);
    struct groom_fit *small = fit_of(sample, 30, 4);
    uint32_t n;
    for (uint32_t v = 0; v < sample->capture->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            sample->capture->points[v][c] *= 2;
    for (uint32_t v = 0; v < sample->head->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            sample->head->points[v][c] *= 2;
    struct groom_fit *large = fit_of(sample, 30, 4);
    ck_ok(finish(small, NULL));
    ck_ok(finish(large, NULL));
    for (uint32_t o = 0; o < small->groom->n_operators; o++) {
        const struct groom_operator *p = &small->groom->operators[o], *q = &large->groom->operators[o];
        (void)groom_operator_parameters(p->type, &n);
        for (uint32_t k = 0; k < n; k++)
            ck_assert_double_eq_tol(q->parameter[k], p->parameter[k] * pow(2, power[p->type][k]), 0.005 * q->parameter[k]);
    }
    ck_assert_double_eq_tol(loss_of(large, "shape")->after, loss_of(small, "shape")->after, 0.02 * loss_of(small, "shape")->after);
    groom_fit_destroy(small);
    groom_fit_destroy(large);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(no_refinements_leave_the_operators_as_they_are)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 100, 20);
    struct groom_fit *fit = fit_of(sample, 20, 0);
    struct groom *before;
    ck_ok(groom_clone(fit->groom, NULL, &before, NULL));
    ck_ok(finish(fit, NULL));
    same_parameters(before, fit->groom);
    groom_destroy(before);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

static int after_a_while(void *user) { return (*(int *)user)-- <= 0; }

/* Inside a step, too: not only between steps. */
START_TEST(a_step_can_be_cancelled_and_done_again)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 120, 20);
    struct groom_fit *fit = fit_of(sample, 20, 2), *whole = fit_of(sample, 20, 2);
    int left, n_cancelled = 0;
    struct groom_progress progress = {.cancelled = after_a_while, .user = &left};
    struct groom_context context = {.progress = &progress};
    while (fit->stage == FIT_STAGE_operators) {
        left = 3;
        groom_status st = groom_fit_step(fit, &context, NULL);
        n_cancelled += st == GROOM_ECANCELLED;
        ck_assert(st == GROOM_OK || st == GROOM_ECANCELLED);
        if (st != GROOM_OK)
            ck_ok(groom_fit_step(fit, NULL, NULL));
    }
    ck_assert_int_gt(n_cancelled, 2);
    ck_ok(finish(whole, NULL));
    same_parameters(whole->groom, fit->groom);
    groom_fit_destroy(fit);
    groom_fit_destroy(whole);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_operators", a_symmetric_system_is_solved, the_sliced_loss_is_that_of_its_equation,
           the_order_of_rows_does_not_matter_and_a_shift_costs_its_square, losses_have_the_same_bits_for_any_threads,
           features_are_segments_and_their_spectrum, kernels_of_known_strands_have_known_determinants,
           strands_from_one_root_have_a_determinant, clumped_strands_have_smaller_determinants_and_the_unit_cancels,
           a_batch_is_a_strand_and_its_nearest, statistics_do_not_know_the_unit_and_see_curls, straight_hair_is_found,
           bent_hair_is_found, the_stage_has_the_same_bits_for_any_threads_and_after_any_interruption,
           parameters_do_not_depend_on_the_unit, no_refinements_leave_the_operators_as_they_are, a_step_can_be_cancelled_and_done_again)
