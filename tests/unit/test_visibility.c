/* what cameras see of strands, and a fit that leaves out what they do not */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/assign.h"
#include "fit/state.h"
#include "fit/visibility.h"
#include "groom/groom.h"
#include "groom/sample.h"
#include "groom/strands.h"
#include "tests/support/test.h"

#define M 20

/* Vertical strands of 10 cm at z, 1 mm apart, from x = 0 on. */
static void curtain(float (*points)[3], uint32_t n, float z)
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < M; j++) {
            float *p = points[i * M + j];
            p[0] = 0.001f * (float)i;
            p[1] = -0.1f * (float)j / (M - 1);
            p[2] = z;
        }
}

static struct groom_camera camera_at(double x, double y, double z)
{
    struct groom_camera camera;
    groom_camera_look_at((double[3]){x, y, z}, (double[3]){0.05, -0.05, 0}, 0.4, 400, 400, &camera);
    return camera;
}

START_TEST(strands_behind_others_are_not_seen)
{
    float (*points)[3] = malloc(200 * M * sizeof *points), share[200];
    struct visibility_scene scene = {.points = (const float (*)[3])points, .scale = 1, .n = 200, .m = M, .ordinary = 1};
    struct groom_camera front = camera_at(0.05, -0.05, 1), both[2] = {front, camera_at(0.05, -0.05, -1)};
    curtain(points, 100, 0.02f);
    curtain(points + 100 * M, 100, -0.02f);
    ck_ok(visibility_shares(&scene, &front, 1, share, NULL, NULL));
    for (uint32_t i = 0; i < 100; i++)
        ck_assert_float_eq(share[i], 1);
    for (uint32_t i = 110; i < 190; i++) /* perspective shows a little of the others past the edges */
        ck_assert_float_eq(share[i], 0);
    ck_ok(visibility_shares(&scene, both, 2, share, NULL, NULL));
    for (uint32_t i = 0; i < 200; i++)
        ck_assert_float_eq(share[i], 1);
    free(points);
}
END_TEST

START_TEST(the_head_hides_what_is_behind_it)
{
    float points[20 * M][3], share[20];
    float corners[4][3] = {{-1, -1, 0.01f}, {1, -1, 0.01f}, {1, 1, 0.01f}, {-1, 1, 0.01f}};
    uint32_t faces[2][3] = {{0, 1, 2}, {0, 2, 3}};
    struct groom_mesh wall = {.n_vertices = 4, .n_triangles = 2, .points = corners, .triangles = faces};
    struct visibility_scene scene = {.points = (const float (*)[3])points, .scale = 1, .n = 20, .m = M, .head = &wall, .ordinary = 1};
    struct groom_camera front = camera_at(0.05, -0.05, 1), back = camera_at(0.05, -0.05, -1), away = front;
    curtain(points, 20, 0);
    ck_ok(visibility_shares(&scene, &front, 1, share, NULL, NULL));
    ck_assert_float_eq(share[10], 0);
    ck_ok(visibility_shares(&scene, &back, 1, share, NULL, NULL));
    ck_assert_float_eq(share[10], 1);
    away.translation[2] = -1;
    ck_ok(visibility_shares(&scene, &away, 1, share, NULL, NULL));
    ck_assert_float_eq(share[10], 0);
}
END_TEST

START_TEST(what_is_out_of_the_picture_is_not_seen)
{
    float points[20 * M][3], share[20];
    struct visibility_scene scene = {.points = (const float (*)[3])points, .scale = 1, .n = 20, .m = M, .ordinary = 1};
    struct groom_camera camera = camera_at(0.05, -0.05, 1);
    curtain(points, 20, 0);
    camera.cx -= 1e5;
    ck_ok(visibility_shares(&scene, &camera, 1, share, NULL, NULL));
    for (int i = 0; i < 20; i++)
        ck_assert_float_eq(share[i], 0);
}
END_TEST

/* --- in a fit ------------------------------------------------------------------------------ */

/* Curls of which the inner ones were made up: cut short, and straight. */
static struct groom_sample *junk_inside(void)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    groom_sample_options_init(GROOM_SAMPLE_CURLY, &options);
    options.n_strands = 2500;
    options.n_vertices = 60;
    options.n_guides = 80;
    options.n_operator_guides = 20;
    options.inner_short = 0.4;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    struct groom_strands *capture = sample->capture;
    for (uint32_t i = 0; i < capture->n_strands; i++) {
        uint32_t n = capture->first[i + 1] - capture->first[i];
        float (*p)[3] = capture->points + capture->first[i];
        for (uint32_t j = 1; n < 50 && j < n; j++)
            for (int c = 0; c < 3; c++)
                p[j][c] = p[0][c] + (p[n - 1][c] - p[0][c]) * (float)j / (float)(n - 1);
    }
    return sample;
}

static struct groom_fit *make_fit(const struct groom_sample *sample, int with_cameras)
{
    struct groom_fit_options *options = malloc(sizeof *options);
    struct groom_fit *fit;
    groom_fit_options_init(GROOM_FIT_STANDARD, options);
    options->vertices = 60;
    options->guides = 80;
    options->operator_guides = 20;
    options->n_cameras = with_cameras ? sample->n_cameras : 0;
    memcpy(options->cameras, sample->cameras, options->n_cameras * sizeof *options->cameras);
    ck_ok(groom_fit_create(sample->capture, sample->head, options, NULL, &fit, NULL));
    free(options);
    return fit;
}

static struct groom *groom_of(struct groom_fit *fit, uint32_t last_stage)
{
    struct groom *groom;
    while (!groom_fit_done(fit) && fit->stage <= last_stage)
        ck_ok(groom_fit_step(fit, NULL, NULL));
    ck_ok(groom_fit_result(fit, NULL, &groom, NULL));
    return groom;
}

static const struct groom_operator *operator_of(const struct groom *groom, groom_operator_type type)
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (groom->operators[o].type == type)
            return &groom->operators[o];
    ck_abort_msg("no %s", groom_operator_name(type));
    return NULL;
}

/* Mean relative error of all parameters. */
static double error_of(const struct groom *groom, const struct groom *truth)
{
    double sum = 0;
    uint32_t n_all = 0;
    for (uint32_t o = 0; o < truth->n_operators; o++) {
        const struct groom_operator *right = &truth->operators[o], *found = operator_of(groom, right->type);
        uint32_t n;
        groom_operator_parameters(right->type, &n);
        for (uint32_t p = 0; p < n; p++, n_all++)
            sum += fabs(found->parameter[p] - right->parameter[p]) / right->parameter[p];
    }
    return sum / n_all;
}

/* In the end, as a user gets them: stage `operators` alone has a handful of curls to tell their variance from. */
START_TEST(with_cameras_operators_are_closer_to_the_truth)
{
    struct groom_sample *sample = junk_inside();
    struct groom_fit *fit[2];
    struct groom *groom[2];
    for (int k = 0; k < 2; k++) {
        fit[k] = make_fit(sample, k);
        groom[k] = groom_of(fit[k], FIT_STAGE_randoms);
        ck_ok(groom_validate(groom[k], NULL));
        ck_assert_uint_eq(groom[k]->n_strands, sample->capture->n_strands);
    }
    ck_assert_uint_eq(groom_fit_get_report(fit[0])->n_unseen, 0);
    ck_assert_uint_gt(groom_fit_get_report(fit[1])->n_unseen, 200);
    ck_assert_uint_lt(groom_fit_get_report(fit[1])->n_unseen, 1000);
    double without = error_of(groom[0], sample->truth), with = error_of(groom[1], sample->truth);
    ck_assert_msg(with < 0.7 * without, "%g with cameras, %g without", with, without);
    for (int k = 0; k < 2; k++) {
        groom_destroy(groom[k]);
        groom_fit_destroy(fit[k]);
    }
    groom_sample_destroy(sample);
}
END_TEST

static double length_of(const struct groom_fit *fit, const struct groom *groom, uint32_t i)
{
    float points[60][3];
    (void)fit;
    ck_ok(groom_evaluate(groom, i, 1, points, NULL, NULL));
    return groom_polyline_length((const float (*)[3])points, 60);
}

START_TEST(strands_that_were_left_out_get_the_hair_around_them)
{
    struct groom_sample *sample = junk_inside();
    struct groom_fit *fit = make_fit(sample, 1);
    struct groom *groom = groom_of(fit, FIT_STAGE_guides), *alone;
    double unseen = 0, captured = 0;
    uint32_t k = 0, n = 0;
    ck_ok(groom_clone(fit->groom, NULL, &alone, NULL));
    for (uint32_t i = 0; i < groom->n_strands; i++)
        if (k < fit->n && fit->all.seen[k] == i) {
            ck_assert_double_eq_tol(length_of(fit, groom, i), length_of(fit, alone, k), 1e-6);
            k++;
        } else {
            unseen += length_of(fit, groom, i);
            captured += groom_polyline_length((const float (*)[3])sample->capture->points + sample->capture->first[i],
                                              sample->capture->first[i + 1] - sample->capture->first[i]);
            n++;
        }
    ck_assert_uint_eq(k, fit->n);
    ck_assert_uint_eq(n, groom_fit_get_report(fit)->n_unseen);
    ck_assert_double_gt(unseen, 1.5 * captured); /* no longer cut short */
    groom_destroy(alone);
    groom_destroy(groom);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* As they are drawn, 137 of 565 lie in the head; about a tenth of those are left, in the middle of strands of which no
 * neighbour's way leads out from their roots. */
START_TEST(strands_that_were_left_out_stay_out_of_the_head)
{
    struct groom_sample *sample = junk_inside();
    struct groom_fit *fit = make_fit(sample, 1);
    struct groom *groom = groom_of(fit, FIT_STAGE_randoms);
    uint32_t k = 0, n_in = 0;
    float x[60][3];
    for (uint32_t i = 0; i < groom->n_strands; i++)
        if (k < fit->n && fit->all.seen[k] == i) {
            k++;
        } else {
            ck_ok(groom_evaluate(groom, i, 1, x, NULL, NULL));
            n_in += assign_buried(fit->bvh, (const float (*)[3])x, 60, 0.001f) > 0;
        }
    ck_assert_uint_lt(k, groom->n_strands);
    ck_assert_uint_le(n_in, 20);
    groom_destroy(groom);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(cameras_that_see_nothing_leave_all_strands_in)
{
    struct groom_sample *sample = junk_inside();
    for (uint32_t k = 0; k < sample->n_cameras; k++)
        sample->cameras[k].translation[2] -= 100; /* all behind */
    struct groom_fit *fit = make_fit(sample, 1);
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    int said = 0;
    ck_assert_uint_eq(fit->n, sample->capture->n_strands);
    ck_assert_uint_eq(report->n_unseen, 0);
    for (uint32_t k = 0; k < report->n_notes; k++)
        said |= strstr(report->notes[k], "No camera sees") != NULL;
    ck_assert(said);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(the_bits_do_not_depend_on_threads)
{
    struct groom_sample *sample = junk_inside();
    uint32_t n = sample->capture->n_strands;
    float (*points)[3] = malloc((size_t)n * M * sizeof *points), *share[2];
    ck_ok(groom_strands_resample(sample->capture, M, points, NULL, NULL));
    struct visibility_scene scene = {.points = (const float (*)[3])points, .scale = 1, .n = n, .m = M, .head = sample->head, .ordinary = 1};
    for (uint32_t k = 0; k < 2; k++) {
        struct groom_pool *pool;
        ck_ok(groom_pool_create(k == 0 ? 1 : 3, &pool));
        struct groom_context context = {.pool = pool};
        share[k] = malloc(n * sizeof *share[k]);
        ck_ok(visibility_shares(&scene, sample->cameras, sample->n_cameras, share[k], &context, NULL));
        groom_pool_destroy(pool);
    }
    ck_assert_int_eq(memcmp(share[0], share[1], n * sizeof *share[0]), 0);
    free(share[0]);
    free(share[1]);
    free(points);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(no_failing_allocation_leaks)
{
    struct groom_sample_options sample_options;
    struct groom_sample *sample;
    struct groom_fit_options *options = malloc(sizeof *options);
    groom_status st = GROOM_ENOMEM;
    groom_sample_options_init(GROOM_SAMPLE_CURLY, &sample_options);
    sample_options.n_strands = 150;
    sample_options.n_vertices = 20;
    sample_options.n_guides = sample_options.n_operator_guides = 4;
    sample_options.n_cameras = 1;
    ck_ok(groom_sample_create(&sample_options, NULL, &sample, NULL));
    groom_fit_options_init(GROOM_FIT_DRAFT, options);
    options->vertices = 20;
    options->least_seen = 0.5;
    options->n_cameras = 1;
    options->cameras[0] = sample->cameras[0];
    for (size_t fail_at = 0; st != GROOM_OK; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_fit *fit = NULL;
        struct groom *groom = NULL;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        st = groom_fit_create(sample->capture, sample->head, options, &context, &fit, NULL);
        while (st == GROOM_OK && fit->stage == 0)
            st = groom_fit_step(fit, &context, NULL);
        if (st == GROOM_OK)
            st = groom_fit_result(fit, &context, &groom, NULL);
        if (st == GROOM_OK)
            ck_assert_uint_gt(groom->n_strands, fit->n);
        ck_assert(st == GROOM_OK || st == GROOM_ENOMEM);
        groom_destroy(groom);
        groom_fit_destroy(fit);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert_uint_lt(fail_at, 2000);
    }
    free(options);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("visibility", strands_behind_others_are_not_seen, the_head_hides_what_is_behind_it,
           what_is_out_of_the_picture_is_not_seen, with_cameras_operators_are_closer_to_the_truth,
           strands_that_were_left_out_get_the_hair_around_them, strands_that_were_left_out_stay_out_of_the_head,
           cameras_that_see_nothing_leave_all_strands_in, the_bits_do_not_depend_on_threads, no_failing_allocation_leaks)
