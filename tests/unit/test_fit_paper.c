/* the paper's own methods of stages instance_weights, guides and operators: their gradients are those of their losses,
 * their steps go down, and they can be interrupted, run out of memory and be cancelled like any other */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/radix.h"
#include "fit/gradient_determinant.h"
#include "fit/gradient_filter.h"
#include "fit/gradient_shape.h"
#include "fit/loss_guides.h"
#include "fit/paper_guides.h"
#include "fit/paper_operators.h"
#include "groom/strands.h"
#include "tests/support/fits.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

enum { M = 24 };

static struct groom_fit_options paper_options(const struct groom_sample *sample)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.vertices = M;
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    options.operators_auto = 0;
    options.n_operators = sample->truth->n_operators;
    for (uint32_t o = 0; o < options.n_operators; o++)
        options.operators[o] = sample->truth->operators[o].type;
    options.stages.initialize.estimate_operators = 0;
    options.stages.instance_weights.method = options.stages.guides.method = options.stages.operators.method = GROOM_FIT_PAPER;
    options.stages.instance_weights.iterations = 400;
    options.stages.guides.iterations = 60;
    options.stages.operators.iterations = 25;
    options.stages.operators.alternate = 10;
    options.stages.operators.batch_fraction = 0.1;
    options.stages.randoms.rounds = 0;
    return options;
}

/* --- gradients ----------------------------------------------------------------------------- */

typedef double evaluator(void *of, struct groom_gradient *gradient);

static double shape_loss(void *of, struct groom_gradient *gradient)
{
    double loss;
    ck_ok(gradient_shape_evaluate(of, 3, gradient, &loss, NULL, NULL));
    return loss;
}

static double determinant_loss(void *of, struct groom_gradient *gradient)
{
    double loss;
    ck_ok(gradient_determinant_evaluate(of, 3, 4, gradient, &loss, NULL, NULL));
    return loss;
}

/* Differences of each parameter of operators of these types, over `step` of its size. */
static void agrees(struct groom_fit *fit, evaluator *evaluate, void *of, const groom_operator_type *types, int n_types,
                   double step, double tolerance)
{
    struct groom_gradient *gradient, *other;
    uint32_t n_parameters;
    int checked = 0;
    ck_ok(groom_gradient_create(fit->groom, NULL, &gradient, NULL));
    ck_ok(groom_gradient_create(fit->groom, NULL, &other, NULL));
    double loss = evaluate(of, gradient);
    ck_assert_double_gt(loss, 0);
    for (uint32_t o = 0; o < fit->groom->n_operators; o++)
        for (int t = 0; t < n_types; t++) {
            struct groom_operator *op = &fit->groom->operators[o];
            groom_operator_parameters(op->type, &n_parameters);
            for (uint32_t k = 0; op->type == types[t] && k < n_parameters; k++, checked++) {
                float *value = &op->parameter[k], kept = *value;
                volatile float up = kept + (float)step * kept, down = kept - (float)step * kept;
                double slope = gradient->operators[o].parameter[k], h = (double)up - (double)down;
                *value = up;
                double above = evaluate(of, other);
                *value = down;
                double below = evaluate(of, other);
                *value = kept;
                ck_assert_msg(fabs(slope - (above - below) / h) <= tolerance * (fabs(slope) + loss / (double)kept),
                              "operator %u, parameter %u: %g, by differences %g", o, k, slope, (above - below) / h);
            }
        }
    ck_assert_int_gt(checked, 0);
    groom_gradient_destroy(gradient);
    groom_gradient_destroy(other);
}

static struct groom_fit *before_operators(groom_sample_style style, uint32_t n, struct groom_sample **sample)
{
    *sample = guides_sample(style, n, M, 3, NULL);
    struct groom_fit_options options = paper_options(*sample);
    options.stages.guides.iterations = 5;
    return guides_fit(*sample, &options, "operators", NULL);
}

START_TEST(the_gradient_of_shapes_is_that_of_their_loss)
{
    static const groom_operator_type types[] = {GROOM_OPERATOR_BEND, GROOM_OPERATOR_CURL, GROOM_OPERATOR_FRIZZ};
    struct groom_sample *sample;
    struct groom_fit *fit = before_operators(GROOM_SAMPLE_WAVY, 150, &sample);
    struct gradient_shape *shape;
    ck_ok(gradient_shape_create(fit, NULL, &shape, NULL));
    agrees(fit, shape_loss, shape, types, 3, 1e-4, 0.02);
    gradient_shape_destroy(shape);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

static void determinant_agrees(enum gradient_determinant_kind kind, groom_operator_type type)
{
    struct groom_sample *sample;
    struct groom_fit *fit = before_operators(GROOM_SAMPLE_STRAIGHT, 150, &sample);
    struct gradient_determinant *determinant;
    fit->options.stages.operators.sigma_clump = 3; /* at 0.1 the kernel is the identity but for rounding */
    ck_ok(gradient_determinant_create(fit, kind, NULL, &determinant, NULL));
    ck_assert_uint_eq(gradient_determinant_batch(fit), 15);
    agrees(fit, determinant_loss, determinant, &type, 1, 1e-3, 0.02);
    gradient_determinant_destroy(determinant);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

START_TEST(the_gradient_of_lengths_is_that_of_their_determinants) { determinant_agrees(GRADIENT_SCALE, GROOM_OPERATOR_SCALE); } END_TEST
START_TEST(the_gradient_of_clumps_is_that_of_their_determinants) { determinant_agrees(GRADIENT_CLUMP, GROOM_OPERATOR_CLUMP); } END_TEST

START_TEST(floats_are_ordered_by_size_then_place)
{
    const float values[] = {3, -1, 0, 3, -7, 1e-20f, -0.5f};
    uint64_t order[7], spare[7];
    const uint32_t expected[] = {4, 1, 6, 2, 5, 0, 3};
    radix_sort_order(values, order, spare, 7);
    for (int i = 0; i < 7; i++)
        ck_assert_uint_eq((uint32_t)order[i], expected[i]);
}
END_TEST

/* --- the filter -------------------------------------------------------------------------------- */

/* A strip of guides that part in the middle: the left half goes one way, the right half another. */
START_TEST(the_filter_spreads_over_the_scalp_but_not_across_a_parting)
{
    enum { N = 40 };
    float uv[N][2], direction[N][3], *filter = malloc(sizeof(float[N][N])), rows[N][1] = {{0}}, out[N][1];
    for (int g = 0; g < N; g++) {
        uv[g][0] = 0.02f * (float)(g / 2), uv[g][1] = 0.02f * (float)(g % 2);
        memcpy(direction[g], g < N / 2 ? (float[]){1, 0, 0} : (float[]){-1, 0, 0}, sizeof direction[g]);
    }
    ck_ok(gradient_filter((const float (*)[2])uv, (const float (*)[3])direction, N, (struct gradient_filter_widths){10, 0.3, 0.4},
                          filter, NULL, NULL));
    for (int a = 0; a < N; a++) {
        double sum = 0;
        for (int b = 0; b < N; b++)
            sum += (double)filter[a * N + b];
        ck_assert_double_eq_tol(sum, 1, 1e-5);
    }
    rows[N / 2 - 2][0] = 1;
    gradient_filter_apply(filter, rows[0], N, 1, out[0], NULL);
    ck_assert_float_gt(out[N / 2 - 4][0], 0.05f);
    ck_assert_float_lt(out[N / 2][0], 0.01f * out[N / 2 - 4][0]);
    free(filter);
}
END_TEST

/* --- the stages ---------------------------------------------------------------------------------- */

/* The expectation that clump alone takes part in: with the truth as the groom, none of its scatter. */
START_TEST(the_loss_of_guides_is_the_distance_from_the_mean)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 60, M, 3, NULL);
    struct groom_fit_options options = paper_options(sample);
    struct groom_fit *fit = guides_fit(sample, &options, "guides", NULL);
    double loss, off, sum = 0;
    float (*x)[3] = malloc((size_t)fit->n * M * sizeof *x);
    for (uint32_t o = 0; o < fit->groom->n_operators; o++)
        fit->groom->operators[o].enabled = 0;
    ck_ok(groom_evaluate(fit->groom, 0, fit->n, x, NULL, NULL));
    for (size_t v = 0; v < (size_t)fit->n * M; v++)
        for (int c = 0; c < 3; c++) {
            off = (double)x[v][c] - ((double)fit->target[v][c] * fit->scale + fit->centre[c]);
            sum += off * off;
        }
    ck_ok(loss_guides(fit, &loss, NULL, NULL));
    ck_assert_double_eq_tol(loss, sum / (fit->n * M), 1e-9 * sum);
    free(x);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(steps_go_down)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_CURLY, 200, M, 3, NULL);
    struct groom_fit_options options = paper_options(sample);
    options.stages.guides.iterations = 200;
    options.stages.operators.iterations = 160; /* Adam's first steps overshoot */
    struct groom_fit *fit = guides_fit(sample, &options, "", NULL);
    const struct groom_fit_loss *weights = fits_loss(fit, "instance_weights", "L_x"), *guides = fits_loss(fit, "guides", "L_g");
    const struct groom_fit_loss *shape = fits_loss(fit, "operators", "shape");
    ck_assert_double_lt(weights->after, 0.8 * weights->before);
    ck_assert_double_lt(guides->after, 0.9 * guides->before);
    ck_assert_double_lt(shape->after, shape->before);
    ck_assert_uint_eq(fit->n_moments, 0);
    ck_ok(groom_validate(fit->groom, NULL));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

static void same_grooms(const struct groom *a, const struct groom *b)
{
    ck_assert_mem_eq(a->guides, b->guides, (size_t)a->n_guides * a->n_vertices * sizeof *a->guides);
    ck_assert_mem_eq(a->instancing_weight, b->instancing_weight, (size_t)a->n_strands * a->n_instancing * sizeof(float));
    ck_assert_uint_eq(a->n_operators, b->n_operators);
    for (uint32_t o = 0; o < a->n_operators; o++)
        ck_assert_mem_eq(a->operators[o].parameter, b->operators[o].parameter, sizeof a->operators[o].parameter);
}

/* 4 000 strands: 25 gradients of guides a step and 5 of operators. */
START_TEST(steps_can_be_interrupted_anywhere_and_know_no_threads)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 4000, 8, 3, NULL);
    struct groom_fit_options options = paper_options(sample);
    struct groom_context context = {0};
    int steps = 0;
    options.vertices = 8;
    options.guides = options.operator_guides = 40;
    options.stages.operators.iterations = 12;
    options.stages.operators.batch_fraction = 0.005;
    ck_ok(groom_pool_create(3, &context.pool));
    struct groom_fit *whole = guides_fit(sample, &options, "", &context), *other = guides_fit(sample, &options, "instance_weights", NULL);
    for (; !groom_fit_done(other); steps++) {
        struct groom_fit *next;
        ck_ok(groom_fit_step(other, NULL, NULL));
        ck_ok(groom_fit_create(sample->capture, sample->head, &options, NULL, &next, NULL));
        other = fits_pass_on(other, next);
    }
    ck_assert_int_gt(steps, 10);
    same_grooms(whole->groom, other->groom);
    ck_assert_mem_eq(&whole->report, &other->report, sizeof whole->report);
    groom_fit_destroy(whole);
    groom_fit_destroy(other);
    groom_sample_destroy(sample);
    groom_pool_destroy(context.pool);
}
END_TEST

START_TEST(a_step_without_memory_changes_nothing)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 80, M, 3, NULL);
    struct groom_fit_options options = paper_options(sample);
    options.stages.guides.iterations = options.stages.operators.iterations = 2;
    struct groom_fit *whole = guides_fit(sample, &options, "", NULL), *poor = guides_fit(sample, &options, "instance_weights", NULL);
    ck_assert_uint_gt(fits_finish_without_memory(poor), 40);
    same_grooms(whole->groom, poor->groom);
    groom_fit_destroy(whole);
    groom_fit_destroy(poor);
    groom_sample_destroy(sample);
}
END_TEST

/* Asked for the nth time, somebody wants to stop. */
struct patience { int left; };

static int is_over(void *user)
{
    struct patience *patience = user;
    return patience->left-- <= 0;
}

START_TEST(a_cancelled_step_changes_nothing)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 80, M, 3, NULL);
    struct groom_fit_options options = paper_options(sample);
    int cancelled = 0;
    options.stages.guides.iterations = options.stages.operators.iterations = 8;
    struct groom_fit *whole = guides_fit(sample, &options, "", NULL), *other = guides_fit(sample, &options, "instance_weights", NULL);
    for (int asked = 0; !groom_fit_done(other); asked++) {
        struct patience patience = {asked};
        struct groom_progress progress = {.user = &patience, .cancelled = is_over};
        struct groom_context context = {.progress = &progress};
        groom_status st = groom_fit_step(other, &context, NULL);
        ck_assert(st == GROOM_OK || st == GROOM_ECANCELLED);
        cancelled += st == GROOM_ECANCELLED;
        asked = st == GROOM_OK ? -1 : asked;
    }
    ck_assert_int_gt(cancelled, 20);
    same_grooms(whole->groom, other->groom);
    groom_fit_destroy(whole);
    groom_fit_destroy(other);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_paper", the_gradient_of_shapes_is_that_of_their_loss, the_gradient_of_lengths_is_that_of_their_determinants,
           the_gradient_of_clumps_is_that_of_their_determinants, floats_are_ordered_by_size_then_place,
           the_filter_spreads_over_the_scalp_but_not_across_a_parting, the_loss_of_guides_is_the_distance_from_the_mean,
           steps_go_down, steps_can_be_interrupted_anywhere_and_know_no_threads, a_step_without_memory_changes_nothing,
           a_cancelled_step_changes_nothing)
