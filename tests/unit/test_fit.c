/* the fit as an object, and its stage `initialize` */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/assign.h"
#include "fit/state.h"
#include "groom/mesh.h"
#include "groom/random.h"
#include "groom/sample.h"
#include "groom/strands.h"
#include "tests/support/fits.h"
#include "tests/support/test.h"

/* --- inputs ---------------------------------------------------------------------- */

static struct groom_sample *sample_of(groom_sample_style style, uint32_t n_strands, int defects)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    if (defects)
        groom_sample_options_capture(style, &options);
    else
        groom_sample_options_init(style, &options);
    options.n_strands = n_strands;
    options.n_vertices = 24;
    options.n_guides = n_strands < 60 ? n_strands : 60;
    options.n_operator_guides = options.n_guides < 20 ? options.n_guides : 20;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    return sample;
}

static struct groom_fit_options options_of(uint32_t guides, uint32_t operator_guides, uint32_t vertices)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.guides = guides;
    options.operator_guides = operator_guides;
    options.vertices = vertices;
    return options;
}

static struct groom_fit *fit_of(const struct groom_strands *strands, const struct groom_mesh *head,
                                const struct groom_fit_options *options, const struct groom_context *context)
{
    struct groom_fit *fit;
    struct groom_diag diag = {0};
    groom_status st = groom_fit_create(strands, head, options, context, &fit, &diag);
    ck_assert_msg(st == GROOM_OK, "%s: %s", groom_status_name(st), diag.detail);
    return fit;
}

static void run(struct groom_fit *fit, const struct groom_context *context)
{
    struct groom_diag diag = {0};
    while (!groom_fit_done(fit)) {
        groom_status st = groom_fit_step(fit, context, &diag);
        ck_assert_msg(st == GROOM_OK, "%s: %s", groom_status_name(st), diag.detail);
    }
}

/* The stages before this one. */
static void run_to(struct groom_fit *fit, uint32_t stage)
{
    while (fit->stage < stage)
        ck_ok(groom_fit_step(fit, NULL, NULL));
}

static struct groom *groom_of(const struct groom_strands *strands, const struct groom_mesh *head,
                              const struct groom_fit_options *options, const struct groom_context *context)
{
    struct groom *groom;
    struct groom_fit *fit = fit_of(strands, head, options, context);
    run(fit, context);
    ck_ok(groom_fit_result(fit, context, &groom, NULL));
    groom_fit_destroy(fit);
    return groom;
}

static struct groom_strands *strands_of(uint32_t n, uint32_t m, const float (*points)[3])
{
    struct groom_strands *strands;
    ck_ok(groom_strands_create(n, (uint64_t)n * m, NULL, &strands, NULL));
    for (uint32_t i = 0; i <= n; i++)
        strands->first[i] = i * m;
    memcpy(strands->points, points, (size_t)n * m * sizeof *points);
    return strands;
}

static void same_bits(const struct groom *a, const struct groom *b)
{
    size_t n = a->n_strands, k = a->n_instancing, n_g = a->n_guides;
    ck_assert_uint_eq(a->n_guides, b->n_guides);
    ck_assert_uint_eq(a->n_operator_guides, b->n_operator_guides);
    ck_assert_uint_eq(a->n_operators, b->n_operators);
    ck_assert_mem_eq(a->roots, b->roots, n * sizeof *a->roots);
    ck_assert_mem_eq(a->root_uv, b->root_uv, n * sizeof *a->root_uv);
    ck_assert_mem_eq(a->guides, b->guides, n_g * a->n_vertices * sizeof *a->guides);
    ck_assert_mem_eq(a->guide_uv, b->guide_uv, n_g * sizeof *a->guide_uv);
    ck_assert_mem_eq(a->instancing_guide, b->instancing_guide, n * k * sizeof *a->instancing_guide);
    ck_assert_mem_eq(a->instancing_weight, b->instancing_weight, n * k * sizeof *a->instancing_weight);
    ck_assert_mem_eq(a->operator_guide, b->operator_guide, a->n_operator_guides * sizeof *a->operator_guide);
    ck_assert_mem_eq(a->operator_guide_of, b->operator_guide_of, n * sizeof *a->operator_guide_of);
    for (uint32_t o = 0; o < a->n_operators; o++) {
        const struct groom_operator *p = &a->operators[o], *q = &b->operators[o];
        ck_assert_mem_eq(p->parameter, q->parameter, sizeof p->parameter);
        for (uint32_t r = 0; r < groom_operator_random_arrays(p->type); r++) {
            size_t count = groom_operator_random_per_guide(p->type) ? a->n_operator_guides : n;
            ck_assert_mem_eq(p->random[r], q->random[r], count * sizeof *p->random[r]);
        }
    }
}

static void is_finite(const struct groom *groom)
{
    size_t points = (size_t)groom->n_strands * groom->n_vertices;
    float (*dense)[3] = malloc(points * sizeof *dense);
    ck_ok(groom_validate(groom, NULL));
    ck_ok(groom_evaluate(groom, 0, groom->n_strands, dense, NULL, NULL));
    for (size_t v = 0; v < points; v++)
        ck_assert(isfinite(dense[v][0]) && isfinite(dense[v][1]) && isfinite(dense[v][2]));
    free(dense);
}

/* --- the object --------------------------------------------------------------------- */

START_TEST(a_fit_goes_through_its_stages_and_ends)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_WAVY, 300, 1);
    struct groom_fit_options options = options_of(40, 10, 24);
    struct groom_fit *fit = fit_of(sample->capture, sample->head, &options, NULL);
    struct groom_fit_progress progress;
    struct groom *groom;
    double last = -1;
    ck_status(groom_fit_result(fit, NULL, &groom, NULL), GROOM_EINVAL);
    while (!groom_fit_done(fit)) {
        groom_fit_progress(fit, &progress);
        ck_assert_str_eq(progress.stage, groom_fit_stage_name(progress.index));
        ck_assert_double_ge(progress.fraction, last);
        ck_assert_double_le(progress.fraction, 1);
        last = progress.fraction;
        ck_ok(groom_fit_step(fit, NULL, NULL));
    }
    groom_fit_progress(fit, &progress);
    ck_assert_double_eq_tol(progress.fraction, 1, 1e-12);
    ck_assert_ptr_null(groom_fit_stage_name(progress.count));
    ck_status(groom_fit_step(fit, NULL, NULL), GROOM_EINVAL);
    ck_ok(groom_fit_result(fit, NULL, &groom, NULL));
    ck_assert_uint_eq(groom->n_strands, sample->capture->n_strands);
    ck_assert_uint_eq(groom->n_guides, 40);
    ck_assert_uint_eq(groom->n_operator_guides, 10);
    ck_assert_uint_eq(groom->n_operators, 5);
    is_finite(groom);
    groom_destroy(groom);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(the_report_counts_and_prints)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 300, 1);
    struct groom_fit_options options = options_of(40, 10, 24);
    struct groom_fit *fit = fit_of(sample->capture, sample->head, &options, NULL);
    char *json;
    run(fit, NULL);
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    ck_assert_uint_eq(report->n_guides, 40);
    ck_assert_uint_gt(report->n_joined, 100);
    ck_assert_uint_ge(report->n_losses, 4);
    ck_assert_str_eq(report->losses[0].name, "cluster");
    ck_assert_str_eq(report->losses[2].name, "L_x");
    ck_assert_str_eq(report->losses[3].name, "L_g");
    ck_assert_double_lt(report->losses[2].after, report->losses[2].before);
    ck_assert_double_lt(report->losses[0].after, report->losses[0].before);
    ck_assert_double_le(report->losses[1].after, report->losses[1].before);
    ck_ok(groom_fit_report_print(fit, &json, NULL));
    ck_assert_ptr_nonnull(strstr(json, "\"cluster\""));
    free(json);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(one_thread_and_three_give_the_same_bits)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_CURLY, 1500, 1);
    struct groom_fit_options options = options_of(GROOM_FIT_AUTO, GROOM_FIT_AUTO, 30);
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom *a = groom_of(sample->capture, sample->head, &options, NULL);
    struct groom *b = groom_of(sample->capture, sample->head, &options, &(struct groom_context){.pool = pool});
    same_bits(a, b);
    groom_destroy(a);
    groom_destroy(b);
    groom_pool_destroy(pool);
    groom_sample_destroy(sample);
}
END_TEST

/* What is drawn; where numbers are found in place of that, it makes no difference (test_fit_invariance). */
START_TEST(the_seed_decides_what_is_drawn)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 200, 0);
    struct groom_fit_options options = options_of(20, 5, 24);
    options.stages.randoms.rounds = 0;
    struct groom *a = groom_of(sample->capture, sample->head, &options, NULL);
    options.seed = 2;
    struct groom *b = groom_of(sample->capture, sample->head, &options, NULL);
    ck_assert_mem_ne(a->operators[0].random[0], b->operators[0].random[0], a->n_strands * sizeof(float));
    groom_destroy(a);
    groom_destroy(b);
    groom_sample_destroy(sample);
}
END_TEST

/* --- checkpoints ------------------------------------------------------------------------ */

START_TEST(a_fit_taken_up_after_any_step_ends_with_the_same_bits)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_WAVY, 250, 1);
    struct groom_fit_options options = options_of(30, 8, 24);
    options.stages.operators.refinements = 3;
    struct groom_fit *fit = fit_of(sample->capture, sample->head, &options, NULL);
    struct groom *whole = groom_of(sample->capture, sample->head, &options, NULL), *groom;
    for (int step = 0;; step++) {
        struct fits_state file = fits_save(fit);
        struct groom_fit *other = fit_of(sample->capture, sample->head, &options, NULL);
        ck_ok(fits_load(other, &file, NULL));
        ck_assert_int_eq(groom_fit_done(other), groom_fit_done(fit));
        run(other, NULL);
        ck_ok(groom_fit_result(other, NULL, &groom, NULL));
        same_bits(whole, groom);
        groom_destroy(groom);
        groom_fit_destroy(other);
        free(file.bytes);
        if (groom_fit_done(fit))
            break;
        ck_ok(groom_fit_step(fit, NULL, NULL));
    }
    groom_destroy(whole);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(a_checkpoint_may_be_loaded_over_a_later_state)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 100, 0);
    struct groom_fit_options options = options_of(10, 3, 12);
    struct groom_fit *fit = fit_of(sample->capture, NULL, &options, NULL);
    struct fits_state file = fits_save(fit);
    run(fit, NULL);
    ck_ok(fits_load(fit, &file, NULL));
    ck_assert_int_eq(groom_fit_done(fit), 0);
    run(fit, NULL);
    free(file.bytes);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(a_checkpoint_of_something_else_is_refused_and_changes_nothing)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 100, 0);
    struct groom_fit_options options = options_of(10, 3, 12);
    struct groom_fit *fit = fit_of(sample->capture, sample->head, &options, NULL);
    ck_ok(groom_fit_step(fit, NULL, NULL));
    ck_ok(groom_fit_step(fit, NULL, NULL));
    struct fits_state file = fits_save(fit);
    struct groom_diag diag = {0};

    options.seed = 9;
    struct groom_fit *other = fit_of(sample->capture, sample->head, &options, NULL);
    ck_status(fits_load(other, &file, &diag), GROOM_ECONFLICT);
    groom_fit_destroy(other);
    options.seed = 1;
    other = fit_of(sample->capture, NULL, &options, NULL);
    ck_status(fits_load(other, &file, &diag), GROOM_ECONFLICT);
    groom_fit_destroy(other);

    for (size_t at = 0; at < file.n; at += at < 200 ? 1 : 61) { /* one bit over */
        file.bytes[at] ^= 0x10;
        groom_status st = fits_load(fit, &file, &diag);
        ck_assert_msg(st == GROOM_EFORMAT || st == GROOM_ECONFLICT || st == GROOM_ETRUNCATED, "%zu", at);
        file.bytes[at] ^= 0x10;
    }
    size_t n = file.n;
    for (file.n = 0; file.n < n; file.n += file.n < 200 ? 1 : 97)
        ck_status(fits_load(fit, &file, &diag), GROOM_ETRUNCATED);
    file.n = n;
    ck_ok(fits_load(fit, &file, &diag));
    run(fit, NULL);
    free(file.bytes);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

static groom_status refuse_writing(void *user, const void *bytes, size_t n)
{
    (void)bytes;
    (void)n;
    return (*(int *)user)-- > 0 ? GROOM_OK : GROOM_ENOSPC;
}

START_TEST(a_full_disk_is_reported_by_save)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 50, 0);
    struct groom_fit_options options = options_of(10, 3, 12);
    struct groom_fit *fit = fit_of(sample->capture, NULL, &options, NULL);
    run(fit, NULL);
    for (int writes = 0; writes < 12; writes++) {
        int left = writes;
        ck_status(groom_fit_save(fit, (struct groom_sink){refuse_writing, &left}, NULL), GROOM_ENOSPC);
    }
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- what goes wrong ------------------------------------------------------------------------ */

/* Eight triangles: the head of a test that indexes it hundreds of times, under sanitizers too. */
static struct groom_mesh *small_head(void)
{
    struct groom_mesh *head;
    ck_ok(groom_mesh_create(6, 8, 0, NULL, &head, NULL));
    for (int v = 0; v < 6; v++)
        for (int c = 0; c < 3; c++)
            head->points[v][c] = (c == 1 ? 1.64f : 0) + (v / 2 == c ? (v % 2 ? -0.14f : 0.14f) : 0);
    for (uint32_t t = 0; t < 8; t++) {
        uint32_t x = t & 1, y = 2 + (t >> 1 & 1), z = 4 + (t >> 2), odd = (x ^ y ^ z) & 1;
        head->triangles[t][0] = x;
        head->triangles[t][1] = odd ? z : y;
        head->triangles[t][2] = odd ? y : z;
    }
    return head;
}

START_TEST(each_failing_allocation_leaves_a_fit_that_can_go_on)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_WAVY, 40, 1);
    struct groom_fit_options options = options_of(8, 3, 10);
    groom_mesh_destroy(sample->head);
    sample->head = small_head();
    options.stages.operators.refinements = 1;
    options.stages.operators.batches_late = 2;
    struct groom *whole = groom_of(sample->capture, sample->head, &options, NULL), *groom;
    for (size_t at = 0;; at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_fit *fit = NULL;
        test_failing_allocator_init(&state, at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = groom_fit_create(sample->capture, sample->head, &options, &context, &fit, NULL);
        int failed = st != GROOM_OK;
        while (st == GROOM_OK && !groom_fit_done(fit)) {
            groom_status step = groom_fit_step(fit, &context, NULL);
            ck_assert_msg(step == GROOM_OK || step == GROOM_ENOMEM, "%s", groom_status_name(step));
            ck_assert(!(failed && step != GROOM_OK)); /* only one allocation fails; the step is tried again */
            failed |= step != GROOM_OK;
        }
        if (st == GROOM_OK) {
            ck_ok(groom_fit_result(fit, NULL, &groom, NULL));
            same_bits(whole, groom);
            groom_destroy(groom);
        }
        groom_fit_destroy(fit);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (!failed)
            break;
    }
    groom_destroy(whole);
    groom_sample_destroy(sample);
}
END_TEST

static int at_once(void *user)
{
    ++*(int *)user;
    return 1;
}

START_TEST(a_cancelled_fit_stops_and_can_go_on)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 200, 0);
    struct groom_fit_options options = options_of(20, 5, 24);
    int asked = 0;
    struct groom_progress progress = {.cancelled = at_once, .user = &asked};
    struct groom_context context = {.progress = &progress};
    struct groom_fit *fit = NULL;
    ck_status(groom_fit_create(sample->capture, sample->head, &options, &context, &fit, NULL), GROOM_ECANCELLED);
    fit = fit_of(sample->capture, sample->head, &options, NULL);
    while (!groom_fit_done(fit)) {
        asked = 0;
        ck_status(groom_fit_step(fit, &context, NULL), GROOM_ECANCELLED);
        ck_assert_int_eq(asked, 1);
        ck_ok(groom_fit_step(fit, NULL, NULL));
    }
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(what_cannot_be_fitted_is_refused)
{
    struct groom_fit_options options = options_of(1, 1, 5);
    struct groom_fit *fit;
    struct groom_strands *none, *nan;
    ck_ok(groom_strands_create(0, 0, NULL, &none, NULL));
    ck_status(groom_fit_create(none, NULL, &options, NULL, &fit, NULL), GROOM_EEMPTY);
    nan = strands_of(1, 2, (const float[2][3]){{0, 0, 0}, {0, NAN, 0}});
    ck_status(groom_fit_create(nan, NULL, &options, NULL, &fit, NULL), GROOM_EINVAL);
    nan->points[1][1] = 1;
    nan->first[1] = 1;
    ck_status(groom_fit_create(nan, NULL, &options, NULL, &fit, NULL), GROOM_EINVAL);
    groom_strands_destroy(none);
    groom_strands_destroy(nan);
}
END_TEST

/* --- initialize ------------------------------------------------------------------------------ */

START_TEST(few_strands_make_a_groom)
{
    float points[3][2][3] = {{{0, 0, 0}, {0, -0.1f, 0}}, {{0.01f, 0, 0}, {0.01f, -0.1f, 0.02f}}, {{0, 0, 0.01f}, {0.05f, -0.1f, 0}}};
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 20, 0);
    for (uint32_t n = 1; n <= 3; n++) {
        struct groom_strands *strands = strands_of(n, 2, (const float (*)[3])points[0]);
        for (int with_head = 0; with_head < 2; with_head++) {
            struct groom_fit_options options = options_of(500, 125, n == 2 ? 3 : 20);
            struct groom *groom = groom_of(strands, with_head ? sample->head : NULL, &options, NULL);
            ck_assert_uint_le(groom->n_guides, n);
            is_finite(groom);
            groom_destroy(groom);
            options = options_of(GROOM_FIT_AUTO, GROOM_FIT_AUTO, 4);
            groom = groom_of(strands, with_head ? sample->head : NULL, &options, NULL);
            is_finite(groom);
            groom_destroy(groom);
        }
        groom_strands_destroy(strands);
    }
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(strands_all_alike_make_one_guide)
{
    float points[12][4][3];
    for (int i = 0; i < 12; i++)
        for (int j = 0; j < 4; j++)
            for (int c = 0; c < 3; c++)
                points[i][j][c] = c == 1 ? -0.05f * (float)j : 0.1f;
    struct groom_strands *strands = strands_of(12, 4, (const float (*)[3])points[0]);
    struct groom_fit_options options = options_of(5, 2, 10);
    struct groom_fit *fit = fit_of(strands, NULL, &options, NULL);
    struct groom *groom;
    run(fit, NULL);
    ck_ok(groom_fit_result(fit, NULL, &groom, NULL));
    ck_assert_uint_eq(groom->n_guides, 1);
    ck_assert_uint_gt(groom_fit_get_report(fit)->n_notes, 0);
    is_finite(groom);
    groom_destroy(groom);
    groom_fit_destroy(fit);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(strands_without_length_or_from_one_root_are_survived)
{
    float points[10][3][3];
    for (int i = 0; i < 10; i++)
        for (int j = 0; j < 3; j++)
            for (int c = 0; c < 3; c++)
                points[i][j][c] = i < 2 ? 0 : 0.03f * (float)(j * ((i * 7 + c * 5) % 4));
    struct groom_strands *strands = strands_of(10, 3, (const float (*)[3])points[0]);
    struct groom_fit_options options = options_of(4, 2, 10);
    struct groom *groom = groom_of(strands, NULL, &options, NULL);
    is_finite(groom);
    groom_destroy(groom);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(no_operators_and_operators_by_table_values)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 100, 0);
    struct groom_fit_options options = options_of(10, 3, 12);
    options.operators_auto = 0;
    options.n_operators = 0;
    struct groom *groom = groom_of(sample->capture, sample->head, &options, NULL);
    ck_assert_uint_eq(groom->n_operators, 0);
    is_finite(groom);
    groom_destroy(groom);
    options.n_operators = 1;
    options.operators[0] = GROOM_OPERATOR_FRIZZ;
    options.stages.initialize.estimate_operators = 0;
    options.stages.operators.refinements = 0;
    groom = groom_of(sample->capture, sample->head, &options, NULL);
    uint32_t n;
    const struct groom_operator_parameter *table = groom_operator_parameters(GROOM_OPERATOR_FRIZZ, &n);
    ck_assert_float_eq(groom->operators[0].parameter[0], table[0].initial);
    ck_assert_float_eq(groom->operators[0].parameter[1], table[1].initial);
    groom_destroy(groom);
    groom_sample_destroy(sample);
}
END_TEST

/* The same capture in centimetres that say they are metres: the same groom, a hundred times as large. */
START_TEST(the_unit_changes_nothing_but_the_size)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_WAVY, 400, 1);
    struct groom_fit_options options = options_of(40, 10, 24);
    options.stages.operators.refinements = 0; /* they stop at what a document may hold: 0.2 m of radius */
    struct groom *small = groom_of(sample->capture, sample->head, &options, NULL);
    for (uint32_t v = 0; v < sample->capture->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            sample->capture->points[v][c] *= 128;
    for (uint32_t v = 0; v < sample->head->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            sample->head->points[v][c] *= 128;
    struct groom *large = groom_of(sample->capture, sample->head, &options, NULL);
    double error = 0, size = 0;
    for (uint32_t v = 0; v < small->n_guides * small->n_vertices; v++)
        for (int c = 0; c < 3; c++) {
            error = fmax(error, fabs(large->guides[v][c] / 128 - small->guides[v][c]));
            size = fmax(size, fabs(small->guides[v][c]));
        }
    ck_assert_double_lt(error, 1e-5 * size);
    for (uint32_t o = 0; o < small->n_operators; o++) {
        static const double power[GROOM_OPERATOR_COUNT][4] = {
            [GROOM_OPERATOR_CURL] = {1, -1, -1, 0}, [GROOM_OPERATOR_FRIZZ] = {-1, 1}};
        const struct groom_operator *p = &small->operators[o], *q = &large->operators[o];
        uint32_t n;
        const struct groom_operator_parameter *table = groom_operator_parameters(p->type, &n);
        for (uint32_t a = 0; a < n; a++) {
            double expected = p->parameter[a] * pow(128, power[p->type][a]);
            if (expected < table[a].maximum)
                ck_assert_double_eq_tol(q->parameter[a], expected, 1e-3 * expected + 1e-9);
        }
    }
    groom_destroy(small);
    groom_destroy(large);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(roots_lie_on_the_scalp)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_BENT, 300, 1);
    struct groom_fit_options options = options_of(40, 10, 24);
    struct groom *groom = groom_of(sample->capture, sample->head, &options, NULL);
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(sample->head, NULL, &bvh, NULL));
    for (uint32_t i = 0; i < groom->n_strands; i++)
        ck_assert_float_lt(fabsf(groom_bvh_signed_distance(bvh, groom->roots[i])), 2e-4f);
    for (uint32_t g = 0; g < groom->n_guides; g++)
        ck_assert_float_lt(fabsf(groom_bvh_signed_distance(bvh, groom->guides[(size_t)g * groom->n_vertices])), 2e-4f);
    groom_bvh_destroy(bvh);
    groom_destroy(groom);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(guides_are_smoothed_means_of_their_clusters)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 200, 0);
    struct groom_fit_options options = options_of(20, 5, 24);
    options.stages.initialize.n_smooth = 0;
    options.operators_auto = 0; /* nor curl nor clump: no guide is moved to the middle of a bundle */
    options.operators[0] = GROOM_OPERATOR_SCALE;
    options.n_operators = 1;
    struct groom_fit *fit = fit_of(sample->capture, sample->head, &options, NULL);
    run_to(fit, FIT_STAGE_instance_weights);
    for (uint32_t g = 0; g < fit->n_guides; g++)
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++) {
                double mean = 0, n = 0;
                for (uint32_t i = 0; i < fit->n; i++)
                    if (fit->cluster_of[i] == g) {
                        const float (*x)[3] = (const float (*)[3])(fit->target + (size_t)i * fit->m);
                        mean += x[j][c] - x[0][c];
                        n++;
                    }
                const float (*guide)[3] = (const float (*)[3])(fit->groom->guides + (size_t)g * fit->m);
                ck_assert_double_eq_tol(guide[j][c] - guide[0][c], fit->scale * mean / n, 2e-6);
            }
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- instance_weights ------------------------------------------------------------------------- */

/* Eq. 5, by brute force, of the guides' clusters' means as they are instanced. */
static double brute_loss(const struct groom_fit *fit)
{
    const struct groom *groom = fit->groom;
    double sum = 0;
    for (uint32_t i = 0; i < fit->n; i++)
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++) {
                double x = 0;
                for (uint32_t s = 0; s < groom->n_instancing; s++) {
                    const float (*mean)[3] =
                        (const float (*)[3])(fit->centroids + (size_t)groom->instancing_guide[i * groom->n_instancing + s] * fit->m);
                    x += groom->instancing_weight[i * groom->n_instancing + s] * ((double)mean[j][c] - mean[0][c]);
                }
                x -= (double)fit->target[(size_t)i * fit->m + j][c] - fit->target[(size_t)i * fit->m][c];
                sum += x * x;
            }
    return sum * fit->scale * fit->scale / ((double)fit->n * fit->m);
}

START_TEST(instance_weights_report_the_papers_loss_and_lower_it)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 500, 0);
    struct groom_fit_options options = options_of(50, 12, 24);
    options.stages.operators.refinements = 0;
    struct groom_fit *fit = fit_of(sample->capture, sample->head, &options, NULL);
    run_to(fit, FIT_STAGE_instance_weights);
    double before = brute_loss(fit);
    run_to(fit, FIT_STAGE_guides);
    const struct groom_fit_loss *loss = &fit->report.losses[fit->report.n_losses - 1];
    ck_assert_double_eq_tol(loss->before, before, 1e-5 * before);
    ck_assert_double_eq_tol(loss->after, brute_loss(fit), 1e-5 * before);
    ck_assert_double_lt(loss->after, 0.8 * loss->before);
    for (uint32_t i = 0; i < fit->n; i++) {
        float sum = 0;
        for (uint32_t s = 0; s < 3; s++) {
            float weight = fit->groom->instancing_weight[3 * i + s];
            ck_assert(weight >= 0 && weight <= 1.00001f);
            sum += weight;
            for (uint32_t t = 0; t < s; t++)
                ck_assert_uint_ne(fit->groom->instancing_guide[3 * i + s], fit->groom->instancing_guide[3 * i + t]);
        }
        ck_assert_float_eq_tol(sum, 1, 1e-5f);
    }
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* All but those near guides that are unlike them. */
START_TEST(a_strong_pull_keeps_the_weights_by_distance)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_COILY, 200, 0);
    struct groom_fit_options options = options_of(20, 5, 24);
    options.stages.instance_weights.distance_pull = 1e6;
    options.stages.randoms.rounds = 0; /* which moves weights, too */
    struct groom_fit *fit = fit_of(sample->capture, sample->head, &options, NULL);
    while (fit->stage == 0)
        ck_ok(groom_fit_step(fit, NULL, NULL));
    struct groom *before = fit->groom, *after;
    uint32_t n_kept = 0;
    ck_ok(groom_clone(fit->groom, NULL, &before, NULL));
    run(fit, NULL);
    after = fit->groom;
    for (uint32_t i = 0; i < fit->n; i++) {
        uint32_t same = 0;
        for (uint32_t s = 0; s < 3; s++)
            for (uint32_t t = 0; t < 3; t++)
                same += before->instancing_guide[3 * i + s] == after->instancing_guide[3 * i + t] &&
                        fabsf(before->instancing_weight[3 * i + s] - after->instancing_weight[3 * i + t]) < 1e-4f;
        n_kept += same == 3;
    }
    ck_assert_uint_gt(n_kept, fit->n * 3 / 4);
    groom_destroy(before);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- assignment ------------------------------------------------------------------------------- */

START_TEST(buried_vertices_are_those_deep_inside)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 20, 0);
    struct groom_bvh *bvh;
    struct groom_random_key key = {3, 3};
    ck_ok(groom_bvh_create(sample->head, NULL, &bvh, NULL));
    for (uint32_t walk = 0; walk < 100; walk++) {
        float points[40][3];
        uint32_t expected = 0;
        for (uint32_t j = 0; j < 40; j++)
            for (uint32_t c = 0; c < 3; c++)
                points[j][c] = j == 0 ? (c == 1 ? 1.6f : 0.05f)
                                      : points[j - 1][c] + 0.012f * (float)groom_random_normal(key, walk, 3 * j + c);
        for (uint32_t j = 1; j < 40; j++)
            expected += groom_bvh_signed_distance(bvh, points[j]) < -0.003f;
        ck_assert_uint_eq(assign_buried(bvh, (const float (*)[3])points, 40, 0.003f), expected);
    }
    groom_bvh_destroy(bvh);
    groom_sample_destroy(sample);
}
END_TEST

/* A strand on the left whose nearest operator guide hangs on the right: clumped to it, it would go
 * through the head. */
START_TEST(a_strand_leaves_the_operator_guide_that_pulls_it_into_the_head)
{
    struct groom_sample *sample = sample_of(GROOM_SAMPLE_STRAIGHT, 20, 0);
    struct groom_shape shape = {1, 20, 2, 2, 1};
    struct groom_bvh *bvh;
    struct groom *groom;
    struct assign_counts counts = {0};
    ck_ok(groom_bvh_create(sample->head, NULL, &bvh, NULL));
    ck_ok(groom_create(shape, NULL, &groom, NULL));
    for (int g = 0; g < 2; g++)
        for (int j = 0; j < 20; j++) {
            float *p = groom->guides[g * 20 + j];
            p[0] = (g ? -1.0f : 1.0f) * fminf(0.02f * (float)j, 0.12f);
            p[1] = 1.752f - (j > 6 ? 0.02f * (float)(j - 6) : 0);
        }
    groom->operator_guide[1] = 1;
    groom->instancing_guide[0] = 1; /* its shape is the left one's */
    groom->instancing_weight[0] = 1;
    memcpy(groom->roots[0], groom->guides[20], sizeof groom->roots[0]);
    groom->root_uv[0][0] = 0.51f;
    groom->guide_uv[0][0] = 0.52f;
    groom->guide_uv[1][0] = 0.48f;
    ck_ok(assign_nearest(groom, NULL, NULL));
    ck_assert_uint_eq(groom->operator_guide_of[0], 0);
    ck_ok(assign_out_of_head(groom, bvh, 2, 0.002f, 0, 1, NULL, &counts, NULL));
    ck_assert_uint_eq(groom->operator_guide_of[0], 1);
    ck_assert_uint_eq(counts.n_reassigned, 1);
    ck_assert_uint_eq(counts.n_penetrating, 0);
    groom_destroy(groom);
    groom_bvh_destroy(bvh);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit", a_fit_goes_through_its_stages_and_ends, the_report_counts_and_prints,
           one_thread_and_three_give_the_same_bits, the_seed_decides_what_is_drawn,
           a_fit_taken_up_after_any_step_ends_with_the_same_bits, a_checkpoint_may_be_loaded_over_a_later_state,
           a_checkpoint_of_something_else_is_refused_and_changes_nothing, a_full_disk_is_reported_by_save,
           each_failing_allocation_leaves_a_fit_that_can_go_on, a_cancelled_fit_stops_and_can_go_on,
           what_cannot_be_fitted_is_refused, few_strands_make_a_groom, strands_all_alike_make_one_guide,
           strands_without_length_or_from_one_root_are_survived, no_operators_and_operators_by_table_values,
           the_unit_changes_nothing_but_the_size, roots_lie_on_the_scalp, guides_are_smoothed_means_of_their_clusters,
           instance_weights_report_the_papers_loss_and_lower_it, a_strong_pull_keeps_the_weights_by_distance,
           buried_vertices_are_those_deep_inside, a_strand_leaves_the_operator_guide_that_pulls_it_into_the_head)
