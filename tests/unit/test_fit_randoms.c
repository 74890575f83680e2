/* stage `randoms`: what a strand's error is, and that known random numbers are found again */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/gradient_strands.h"
#include "base/memory.h"
#include "fit/frequencies.h"
#include "fit/guides.h"
#include "fit/loss_strands.h"
#include "fit/state.h"
#include "fit/strand_error.h"
#include "groom/random.h"
#include "groom/strands.h"
#include "tests/support/fits.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

enum { M = 40 };

/* --- the error of a strand ------------------------------------------------------------ */

/* A helix in each lane, m vertices of which stand closer towards the tip the larger `bunch` is. */
static void helices(uint32_t m, float bunch, float shift, lanes *x)
{
    for (uint32_t j = 0; j < m; j++)
        for (int l = 0; l < LANES; l++) {
            float v = powf((float)j / (float)(m - 1), 1 - bunch), angle = 9 * v + (float)l;
            x[3 * j][l] = 0.02f * (sinf(angle) - sinf((float)l)) + shift * v;
            x[3 * j + 1][l] = -0.2f * v;
            x[3 * j + 2][l] = 0.02f * (cosf(angle) - cosf((float)l));
        }
}

static void error_of(enum kernel_variant variant, const lanes *x, lanes *target_x, struct strand_error_weights weights, lanes error)
{
    lanes scratch[STRAND_ERROR_SCRATCH(400)];
    struct strand_error_target target = {.point = target_x};
    strand_error_measure(400, &target);
    strand_error(variant, 400, x, &target, &weights, scratch, error);
}

START_TEST(the_error_is_none_on_the_same_curve_however_its_vertices_stand)
{
    static lanes x[1200], same[1200], off[1200];
    lanes error;
    helices(400, 0, 0, x);
    helices(400, 0.3f, 0, same);
    helices(400, 0, 0.03f, off);
    error_of(KERNEL_BASELINE, same, x, (struct strand_error_weights){1, 100, 100, 0}, error);
    for (int l = 0; l < LANES; l++)
        ck_assert_float_le(fabsf(error[l]), 2e-4f);
    error_of(KERNEL_BASELINE, off, x, (struct strand_error_weights){0, 1, 0, 0}, error);
    for (int l = 0; l < LANES; l++) /* the mean of (0.03 v)^2 */
        ck_assert_float_eq_tol(error[l], 0.0003f, 0.00006f);
}
END_TEST

/* The directions' share of the error of a helix along a zigzag, vertices bunched towards the root this much. */
static double error_beside_corners(float bunch)
{
    static lanes x[1200], zigzag[1200];
    lanes error;
    helices(400, bunch, 0, x);
    for (int j = 0; j < 400; j++)
        for (int l = 0; l < LANES; l++) {
            zigzag[3 * j][l] = (float)(j % 2) * 0.0005f;
            zigzag[3 * j + 1][l] = -0.0005f * (float)j;
            zigzag[3 * j + 2][l] = 0;
        }
    error_of(KERNEL_BASELINE, x, zigzag, (struct strand_error_weights){1, 0, 0, 0}, error);
    return (double)error[0];
}

START_TEST(the_error_does_not_jump_where_vertices_pass_corners)
{
    double first = error_beside_corners(0.2f), last = first, largest = 0;
    int steps = 1000;
    for (int k = 1; k <= steps; k++) {
        double error = error_beside_corners(0.2f + 1e-5f * (float)k);
        largest = fmax(largest, fabs(error - last));
        last = error;
    }
    ck_assert_msg(largest < 5e-4, "jumps by %g of %g", largest, last);
}
END_TEST

START_TEST(the_error_has_the_same_bits_in_all_variants)
{
    static lanes x[1200], y[1200];
    lanes one, other;
    helices(400, 0.2f, 0.01f, x);
    helices(400, 0, 0, y);
    error_of(KERNEL_BASELINE, x, y, (struct strand_error_weights){2, 30, 1, 0}, one);
    error_of(kernel_best_variant(), x, y, (struct strand_error_weights){2, 30, 1, 0}, other);
    ck_assert_mem_eq(one, other, sizeof one);
}
END_TEST

/* Two straight strands of 0.2 and 0.3 m at a right angle. */
START_TEST(the_losses_are_those_of_their_equation)
{
    float a[11][3] = {{0}}, b[11][3] = {{0}};
    struct loss_strands loss;
    for (int j = 0; j < 11; j++)
        a[j][1] = 0.02f * (float)j, b[j][0] = 0.03f * (float)j;
    ck_ok(loss_strands((const float (*)[3])a, (const float (*)[3])b, 1, 11, 0.1, 2, 0.01, NULL, &loss, NULL));
    ck_assert_double_eq_tol(loss.direction, 1, 1e-5);
    ck_assert_double_eq_tol(loss.length, 1, 1e-5);
    ck_assert_double_eq_tol(loss.spectra, 200, 1e-3); /* 10 segments at wave 0, once along y, once along x */
    ck_assert_double_eq_tol(loss.vertex, 0.18028, 1e-4);
    ck_assert_double_eq_tol(loss.total, 202.01, 1e-3);
    ck_ok(loss_strands((const float (*)[3])a, (const float (*)[3])a, 1, 11, 0.1, 2, 0.01, NULL, &loss, NULL));
    ck_assert_double_eq_tol(loss.total, 0, 1e-6);
}
END_TEST

/* --- the stage ----------------------------------------------------------------------------- */

/* A fit before the stage that knows all of the truth but its random numbers. */
static struct groom_fit *fit_of(const struct groom_sample *sample, uint32_t rounds)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.vertices = sample->truth->n_vertices;
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    options.seed = 77;
    options.stages.randoms.rounds = rounds;
    options.stages.randoms.refinements = 0; /* parameters are the truth's: nothing to refine */
    struct groom_fit *fit = guides_fit(sample, &options, "instance_weights", NULL);
    struct groom *groom;
    ck_ok(groom_clone(sample->truth, NULL, &groom, NULL));
    for (uint32_t o = 0; o < groom->n_operators; o++)
        groom_draw_random(groom, &groom->operators[o], options.seed);
    groom_destroy(fit->groom);
    fit->groom = groom;
    fit->stage = FIT_STAGE_randoms;
    fit->phase = fit->iteration = 0;
    return fit;
}

static void finish(struct groom_fit *fit, const struct groom_context *context)
{
    while (!groom_fit_done(fit))
        ck_ok(groom_fit_step(fit, context, NULL));
}

static struct groom_context three_threads(void)
{
    struct groom_context context = {0};
    ck_ok(groom_pool_create(3, &context.pool));
    return context;
}

/* Errors fall to this share of what they are with other random numbers. */
static void finds(groom_sample_style style, double direction, double vertex)
{
    struct groom_context context = three_threads();
    struct groom_sample *sample = guides_sample(style, 600, M, 3, &context);
    struct groom_fit *fit = fit_of(sample, 2);
    finish(fit, &context);
    const struct groom_fit_loss *d = fits_loss(fit, "randoms", "direction"), *x = fits_loss(fit, "randoms", "vertex");
    const struct groom_fit_loss *all = fits_loss(fit, "randoms", "L_rand");
    ck_assert_msg(d->after < direction * d->before, "direction %g of %g", d->after, d->before);
    ck_assert_msg(x->after < vertex * x->before, "vertex %g of %g", x->after, x->before);
    ck_assert_double_lt(all->after, 0.5 * all->before);
    ck_ok(groom_validate(fit->groom, NULL));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    groom_pool_destroy(context.pool);
}

START_TEST(numbers_of_bent_hair_are_found) { finds(GROOM_SAMPLE_BENT, 0.1, 0.1); } END_TEST
START_TEST(numbers_of_spiky_hair_are_found) { finds(GROOM_SAMPLE_SPIKY, 0.1, 0.15); } END_TEST
START_TEST(numbers_of_curls_are_found) { finds(GROOM_SAMPLE_CURLY, 0.4, 0.5); } END_TEST

static double off_guides(const struct groom *a, const struct groom *b)
{
    double sum = 0;
    for (size_t v = 0; v < (size_t)a->n_guides * a->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            sum += pow((double)a->guides[v][c] - b->guides[v][c], 2);
    return sqrt(sum / ((double)a->n_guides * a->n_vertices));
}

/* Those of the truth. */
static void know_numbers(struct groom *groom, const struct groom *truth)
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        for (uint32_t r = 0; r < groom_operator_random_arrays(groom->operators[o].type); r++)
            memcpy(groom->operators[o].random[r], truth->operators[o].random[r],
                   (groom_operator_random_per_guide(groom->operators[o].type) ? groom->n_operator_guides : groom->n_strands) *
                       sizeof(float));
}

/* Each turned and stretched a little. */
static void spoil_guides(struct groom *groom)
{
    for (uint32_t g = 0; g < groom->n_guides; g++)
        for (uint32_t j = 1; j < groom->n_vertices; j++) {
            float *x = groom->guides[(size_t)g * groom->n_vertices + j], *root = groom->guides[(size_t)g * groom->n_vertices];
            for (int c = 0; c < 3; c++)
                x[c] += (x[c] - root[c]) * 0.02f * (float)((int)(g % 5) - 2) + 0.004f * (float)j / M * (float)((int)(g % 3) - 1);
        }
}

/* Guides of the truth, spoilt, come back where numbers are the truth's. */
static void come_back(groom_sample_style style, double share)
{
    struct groom_sample *sample = guides_sample(style, 600, M, 3, NULL);
    struct groom_fit *fit = fit_of(sample, 2);
    struct groom *groom = fit->groom;
    know_numbers(groom, sample->truth);
    spoil_guides(groom);
    double before = off_guides(groom, sample->truth);
    fit->options.stages.randoms.across = 1e-4;
    for (int step = 0; step < 3; step++)
        ck_ok(guides_refine(fit, NULL, NULL));
    double after = off_guides(groom, sample->truth);
    ck_assert_msg(after < share * before, "%g mm of %g mm", 1e3 * after, 1e3 * before);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

START_TEST(guides_of_straight_hair_follow_known_numbers) { come_back(GROOM_SAMPLE_STRAIGHT, 0.15); } END_TEST
START_TEST(guides_of_wavy_hair_follow_known_numbers) { come_back(GROOM_SAMPLE_WAVY, 0.2); } END_TEST

/* Radians that guides turn by on their first tenth, on average. */
static double turn_at_roots(const struct groom *groom)
{
    uint32_t m = groom->n_vertices;
    double sum = 0;
    for (uint32_t g = 0; g < groom->n_guides; g++) {
        const float (*x)[3] = (const float (*)[3])(groom->guides + (size_t)g * m);
        double dot = 0, a = 0, b = 0;
        for (int c = 0; c < 3; c++) {
            double first = (double)x[1][c] - x[0][c], then = (double)x[m / 10][c] - x[m / 10 - 1][c];
            dot += first * then, a += first * first, b += then * then;
        }
        sum += acos(fmin(dot / sqrt(a * b), 1)) / groom->n_guides;
    }
    return sum;
}

START_TEST(guides_turn_out_of_the_scalp_as_hair_does)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 600, 100, 3, NULL);
    struct groom_fit *fit = fit_of(sample, 2);
    uint32_t m = fit->m;
    know_numbers(fit->groom, sample->truth);
    for (uint32_t g = 0; g < fit->n_guides; g++) /* straight to begin with */
        for (uint32_t j = 1; j < m / 8; j++)
            for (int c = 0; c < 3; c++) {
                float (*x)[3] = fit->groom->guides + (size_t)g * m;
                x[j][c] = x[0][c] + (x[m / 8][c] - x[0][c]) * (float)j / (float)(m / 8);
            }
    double before = turn_at_roots(fit->groom), truth = turn_at_roots(sample->truth);
    ck_ok(guides_refine(fit, NULL, NULL));
    double after = turn_at_roots(fit->groom);
    ck_assert_msg(fabs(after - truth) < 0.1 * truth, "%g of %g, straight %g", after, truth, before);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

static const float *frizz_of(const struct groom *groom)
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (groom->operators[o].type == GROOM_OPERATOR_FRIZZ)
            return groom->operators[o].random[0];
    ck_abort_msg("no frizz");
}

START_TEST(few_places_in_the_noise_are_missed_where_guides_are_wrong)
{
    struct groom_context context = three_threads();
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_SHORT, 1000, 100, 3, &context);
    struct groom_fit *fit = fit_of(sample, 2);
    uint32_t n_lost = 0;
    spoil_guides(fit->groom);
    finish(fit, &context);
    for (uint32_t i = 0; i < fit->n; i++)
        n_lost += fabs((double)frizz_of(fit->groom)[i] - frizz_of(sample->truth)[i]) > 0.01;
    ck_assert_msg(n_lost < 25, "%u of %u", n_lost, fit->n);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    groom_pool_destroy(context.pool);
}
END_TEST

static void same_grooms(const struct groom *a, const struct groom *b)
{
    size_t n = a->n_strands;
    for (uint32_t o = 0; o < a->n_operators; o++)
        for (uint32_t r = 0; r < groom_operator_random_arrays(a->operators[o].type); r++)
            ck_assert_mem_eq(a->operators[o].random[r], b->operators[o].random[r],
                             (groom_operator_random_per_guide(a->operators[o].type) ? a->n_operator_guides : n) * sizeof(float));
    for (uint32_t o = 0; o < a->n_operators; o++)
        ck_assert_mem_eq(a->operators[o].parameter, b->operators[o].parameter, sizeof a->operators[o].parameter);
    ck_assert_mem_eq(a->guides, b->guides, (size_t)a->n_guides * a->n_vertices * sizeof *a->guides);
    ck_assert_mem_eq(a->instancing_weight, b->instancing_weight, n * a->n_instancing * sizeof(float));
    ck_assert_mem_eq(a->operator_guide_of, b->operator_guide_of, n * sizeof(uint32_t));
}

/* Guides that are too short would have all strands scaled up. */
START_TEST(what_scales_have_in_common_goes_to_the_guides)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_BENT, 200, M, 3, NULL);
    struct groom_fit *fit = fit_of(sample, 2);
    struct groom *groom = fit->groom;
    double mean = 0, length = 0, right = 0;
    for (uint32_t g = 0; g < groom->n_guides; g++)
        for (uint32_t j = 1; j < M; j++)
            for (int c = 0; c < 3; c++)
                groom->guides[g * M + j][c] += 0.05f * (groom->guides[g * M][c] - groom->guides[g * M + j][c]);
    finish(fit, NULL);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        mean += (double)groom->operators[0].random[0][i] / groom->n_strands;
    for (uint32_t g = 0; g < groom->n_guides; g++) {
        length += groom_polyline_length((const float (*)[3])(groom->guides + (size_t)g * M), M);
        right += groom_polyline_length((const float (*)[3])(sample->truth->guides + (size_t)g * M), M);
    }
    ck_assert_int_eq(groom->operators[0].type, GROOM_OPERATOR_SCALE);
    ck_assert_double_lt(fabs(mean), 0.1);
    ck_assert_double_eq_tol(length / right, 1, 0.015);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- the law of curls' frequencies ------------------------------------------------------- */

/* The curl of a truth, told by a law that is too wide and too fast. Returns the frequencies that it has. */
static struct groom_operator *told_wrongly(struct groom *groom, double *frequency)
{
    struct groom_operator *curl = &groom->operators[1];
    ck_assert_int_eq(curl->type, GROOM_OPERATOR_CURL);
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        frequency[o] = (double)curl->parameter[1] + (double)curl->parameter[2] * (double)curl->random[0][o];
        curl->random[0][o] = (float)((frequency[o] - (double)curl->parameter[1] - 2) / (3 * (double)curl->parameter[2]));
    }
    curl->parameter[1] += 2;
    curl->parameter[2] *= 3;
    return curl;
}

static void restate(struct groom *groom, struct groom_operator *curl, double apart)
{
    struct groom_diag diag = {0};
    uint32_t n = groom->n_operator_guides;
    float (*half)[2] = malloc(n * sizeof *half);
    for (uint32_t o = 0; o < n; o++)
        for (int h = 0; h < 2; h++)
            half[o][h] = curl->random[0][o] + (float)(h ? apart : -apart);
    ck_assert_int_eq(frequencies_restate(groom, curl, (const float (*)[2])half, memory_allocator(NULL), &diag), GROOM_OK);
    free(half);
}

START_TEST(frequencies_that_are_found_tell_their_law)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_COILY, 2000, M, 3, NULL);
    struct groom *groom = sample->truth;
    double *frequency = malloc(groom->n_operator_guides * sizeof *frequency);
    double right = (double)groom->operators[1].parameter[1], random = (double)groom->operators[1].parameter[2];
    struct groom_operator *curl = told_wrongly(groom, frequency);
    ck_assert_int_eq(frequencies_tell(groom), 1);
    restate(groom, curl, 0);
    ck_assert_double_eq_tol((double)curl->parameter[1], right, 0.02 * right);
    ck_assert_double_eq_tol((double)curl->parameter[2], random, 0.1 * random);
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) /* but for those at the law's ends */
        ck_assert_double_eq_tol((double)curl->parameter[1] + (double)curl->parameter[2] * (double)curl->random[0][o], frequency[o], 0.15 * random);
    free(frequency);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(what_halves_of_the_strands_do_not_agree_on_is_no_difference_of_curls)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_COILY, 2000, M, 3, NULL);
    double *frequency = malloc(sample->truth->n_operator_guides * sizeof *frequency);
    double random = (double)sample->truth->operators[1].parameter[2];
    struct groom_operator *curl = told_wrongly(sample->truth, frequency);
    restate(sample->truth, curl, 0.1);
    ck_assert_double_lt((double)curl->parameter[2], 0.9 * random);
    ck_assert_double_gt((double)curl->parameter[2], 0.4 * random);
    free(frequency);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(the_stage_has_the_same_bits_for_any_threads)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_WAVY, 220, M, 3, NULL);
    struct groom_fit *one = fit_of(sample, 2), *three = fit_of(sample, 2);
    struct groom_context context = three_threads();
    finish(one, NULL);
    finish(three, &context);
    same_grooms(one->groom, three->groom);
    ck_assert_mem_eq(&one->report, &three->report, sizeof one->report);
    groom_fit_destroy(one);
    groom_fit_destroy(three);
    groom_sample_destroy(sample);
    groom_pool_destroy(context.pool);
}
END_TEST

/* After each of its steps saved, and taken up by a fit that has done nothing. */
START_TEST(the_stage_can_be_interrupted_anywhere)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_WAVY, 220, M, 3, NULL);
    struct groom_fit *whole = fit_of(sample, 2), *other = fit_of(sample, 2);
    int steps = 0;
    whole->options.stages.randoms.refinements = other->options.stages.randoms.refinements = 1;
    finish(whole, NULL);
    for (; !groom_fit_done(other); steps++) {
        struct groom_fit *next = fit_of(sample, 2);
        next->options.stages.randoms.refinements = 1;
        ck_ok(groom_fit_step(other, NULL, NULL));
        other = fits_pass_on(other, next);
    }
    ck_assert_int_gt(steps, 5);
    same_grooms(whole->groom, other->groom);
    groom_fit_destroy(whole);
    groom_fit_destroy(other);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(a_step_without_memory_changes_nothing)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_WAVY, 100, M, 3, NULL);
    struct groom_fit *whole = fit_of(sample, 1), *poor = fit_of(sample, 1);
    finish(whole, NULL);
    ck_assert_uint_gt(fits_finish_without_memory(poor), 20);
    same_grooms(whole->groom, poor->groom);
    groom_fit_destroy(whole);
    groom_fit_destroy(poor);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(no_rounds_leave_the_numbers_as_they_were_drawn)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 100, M, 3, NULL);
    struct groom_fit *fit = fit_of(sample, 0);
    struct groom *before;
    ck_ok(groom_clone(fit->groom, NULL, &before, NULL));
    finish(fit, NULL);
    same_grooms(before, fit->groom);
    groom_destroy(before);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

static void count_round(void *user, const char *name, uint64_t iteration, double value)
{
    uint64_t *rounds = user;
    (void)name, (void)value;
    *rounds = iteration > *rounds ? iteration : *rounds;
}

static uint64_t rounds_of(groom_sample_style style)
{
    struct groom_sample *sample = guides_sample(style, 200, M, 3, NULL);
    struct groom_fit *fit = fit_of(sample, 2);
    uint64_t rounds = 0;
    struct groom_progress progress = {.user = &rounds, .loss = count_round};
    struct groom_context context = {.progress = &progress};
    finish(fit, &context);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    return rounds;
}

START_TEST(curls_of_a_few_strands_a_guide_take_another_round)
{
    ck_assert_uint_eq(rounds_of(GROOM_SAMPLE_COILY), 3); /* two strands a guide */
    ck_assert_uint_eq(rounds_of(GROOM_SAMPLE_SHORT), 2);
}
END_TEST

/* --- the paper's method --------------------------------------------------------------------- */

/* Eq. 19's gradient is what differences say it is. */
START_TEST(the_papers_gradient_is_that_of_its_loss)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_WAVY, 40, M, 3, NULL);
    struct groom_fit *fit = fit_of(sample, 1);
    struct gradient_strands *strands;
    struct groom_gradient *gradient, *other;
    double loss, up, down, h = 5e-4;
    ck_ok(gradient_strands_create(fit, NULL, &strands, NULL));
    ck_ok(groom_gradient_create(fit->groom, NULL, &gradient, NULL));
    ck_ok(groom_gradient_create(fit->groom, NULL, &other, NULL));
    ck_ok(gradient_strands_evaluate(strands, gradient, &loss, NULL, NULL));
    for (uint32_t o = 0; o < fit->groom->n_operators; o++)
        for (uint32_t r = 0; r < groom_operator_random_arrays(fit->groom->operators[o].type); r++) {
            const float *slopes = gradient->operators[o].random[r];
            uint32_t steepest = 0; /* of the first few: floats tell its differences best */
            for (uint32_t i = 1; i < 4; i++)
                steepest = fabsf(slopes[i]) > fabsf(slopes[steepest]) ? i : steepest;
            float *u = &fit->groom->operators[o].random[r][steepest], kept = *u, slope = slopes[steepest];
            *u = kept + (float)h;
            ck_ok(gradient_strands_evaluate(strands, other, &up, NULL, NULL));
            *u = kept - (float)h;
            ck_ok(gradient_strands_evaluate(strands, other, &down, NULL, NULL));
            *u = kept;
            ck_assert_double_eq_tol((double)slope, (up - down) / (2 * h), 0.03 * fabs((double)slope) + 0.05);
        }
    groom_gradient_destroy(gradient);
    groom_gradient_destroy(other);
    gradient_strands_destroy(strands);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

static struct groom_fit *paper_fit(const struct groom_sample *sample, uint32_t iterations)
{
    struct groom_fit *fit = fit_of(sample, 1);
    fit->options.stages.randoms.method = GROOM_FIT_PAPER;
    fit->options.stages.randoms.iterations = iterations;
    return fit;
}

START_TEST(the_papers_steps_go_down)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_BENT, 60, M, 3, NULL);
    struct groom_fit *fit = paper_fit(sample, 150);
    finish(fit, NULL);
    ck_assert_double_lt(fits_loss(fit, "randoms", "L_rand")->after, 0.6 * fits_loss(fit, "randoms", "L_rand")->before);
    ck_assert_uint_eq(fit->n_moments, 0);
    ck_ok(groom_validate(fit->groom, NULL));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* 2 000 strands: 30 gradients a step. */
START_TEST(the_papers_steps_can_be_interrupted_and_know_no_threads)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_SHORT, 2000, 12, 3, NULL);
    struct groom_fit *whole = paper_fit(sample, 50), *other = paper_fit(sample, 50);
    struct groom_context context = three_threads();
    finish(whole, &context);
    for (int steps = 0; steps < 2; steps++) /* a measurement, and the first 30 */
        ck_ok(groom_fit_step(other, NULL, NULL));
    ck_assert_uint_eq(other->iteration, 30);
    other = fits_pass_on(other, paper_fit(sample, 50));
    finish(other, NULL);
    same_grooms(whole->groom, other->groom);
    groom_fit_destroy(whole);
    groom_fit_destroy(other);
    groom_sample_destroy(sample);
    groom_pool_destroy(context.pool);
}
END_TEST

START_TEST(the_papers_steps_without_memory_change_nothing)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 40, M, 3, NULL);
    struct groom_fit *whole = paper_fit(sample, 3), *poor = paper_fit(sample, 3);
    finish(whole, NULL);
    ck_assert_uint_gt(fits_finish_without_memory(poor), 10);
    same_grooms(whole->groom, poor->groom);
    groom_fit_destroy(whole);
    groom_fit_destroy(poor);
    groom_sample_destroy(sample);
}
END_TEST

/* --- cancelled ------------------------------------------------------------------------------ */

static int after_a_while(void *user) { return (*(int *)user)-- <= 0; }

/* Nowhere in a step, between guides and the parameters for them neither: what a worker keeps that is asked to end is what
 * the next one goes on with. */
START_TEST(a_cancelled_step_changes_nothing)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_WAVY, 300, M, 6, NULL);
    struct groom_fit_options *options = malloc(sizeof *options);
    int left, n_cancelled = 0;
    struct groom_progress progress = {.cancelled = after_a_while, .user = &left};
    struct groom_context context = {.progress = &progress};
    groom_fit_options_init(GROOM_FIT_STANDARD, options);
    options->vertices = M;
    options->guides = 30;
    struct groom_fit *fit = guides_fit(sample, options, "randoms", NULL);
    for (int polls = 0; !groom_fit_done(fit); polls += 1 + polls / 4) {
        struct fits_state before = fits_save(fit);
        left = polls;
        groom_status st = groom_fit_step(fit, &context, NULL);
        ck_assert(st == GROOM_OK || st == GROOM_ECANCELLED);
        if (st == GROOM_ECANCELLED) {
            struct fits_state after = fits_save(fit);
            ck_assert_uint_eq(before.n, after.n);
            ck_assert_mem_eq(before.bytes, after.bytes, before.n);
            free(after.bytes);
            n_cancelled++;
        } else {
            polls = -1; /* the next step, from its first question on */
        }
        free(before.bytes);
    }
    ck_assert_int_gt(n_cancelled, 10);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    free(options);
}
END_TEST

TEST_SUITE("fit_randoms", the_error_is_none_on_the_same_curve_however_its_vertices_stand,
           the_error_does_not_jump_where_vertices_pass_corners,
           the_error_has_the_same_bits_in_all_variants, the_losses_are_those_of_their_equation,
           numbers_of_bent_hair_are_found, numbers_of_spiky_hair_are_found, numbers_of_curls_are_found,
           guides_of_straight_hair_follow_known_numbers, guides_of_wavy_hair_follow_known_numbers,
           guides_turn_out_of_the_scalp_as_hair_does, few_places_in_the_noise_are_missed_where_guides_are_wrong,
           what_scales_have_in_common_goes_to_the_guides, frequencies_that_are_found_tell_their_law,
           what_halves_of_the_strands_do_not_agree_on_is_no_difference_of_curls, the_stage_has_the_same_bits_for_any_threads, the_stage_can_be_interrupted_anywhere,
           a_cancelled_step_changes_nothing,
           a_step_without_memory_changes_nothing, no_rounds_leave_the_numbers_as_they_were_drawn, curls_of_a_few_strands_a_guide_take_another_round,
           the_papers_gradient_is_that_of_its_loss, the_papers_steps_go_down,
           the_papers_steps_can_be_interrupted_and_know_no_threads, the_papers_steps_without_memory_change_nothing)
