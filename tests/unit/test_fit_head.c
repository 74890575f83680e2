/* the head in a fit: what planes beside strands tell, what depth costs, and that strands stay out where their targets are */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/head_clear.h"
#include "fit/head_planes.h"
#include "fit/state.h"
#include "fit/strand_error.h"
#include "groom/strands.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

enum { M = 100, N = 600 };

/* --- planes ------------------------------------------------------------------------------- */

/* Of a point off the strand, 2 mm each way, as the mesh has it; where there is no plane, the strand is far out. */
START_TEST(planes_tell_how_deep_points_near_a_strand_are)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_WAVY, 100, M, 3, NULL);
    struct groom_bvh *head;
    struct head_plane plane[M];
    uint32_t n_planes = 0;
    ck_ok(groom_bvh_create(sample->head, NULL, &head, NULL));
    for (uint32_t i = 0; i < sample->capture->n_strands; i++) {
        const float (*x)[3] = (const float (*)[3])sample->capture->points + sample->capture->first[i];
        head_planes_find(head, x, M, 0.01f, plane);
        for (uint32_t k = 0; k < head_planes_of(M); k++) {
            const float *v = x[head_plane_vertex(k, M)], *n = plane[k].normal;
            if (n[0] == 0 && n[1] == 0 && n[2] == 0) {
                ck_assert_float_ge(groom_bvh_signed_distance(head, v), 0.01f);
                continue;
            }
            for (int c = 0; c < 3; c++, n_planes++) {
                float p[3] = {v[0] + (c == 0 ? 0.002f : 0), v[1] + (c == 1 ? 0.002f : 0), v[2] + (c == 2 ? 0.002f : 0)};
                float told = plane[k].offset;
                for (int d = 0; d < 3; d++)
                    told += n[d] * (p[d] - x[0][d]);
                ck_assert_float_eq_tol(told, groom_bvh_signed_distance(head, p), 0.0008f);
            }
        }
    }
    ck_assert_uint_gt(n_planes, 500);
    ck_assert_uint_eq(head_plane_vertex(head_planes_of(M) - 1, M), M - 1);
    groom_bvh_destroy(head);
    groom_sample_destroy(sample);
}
END_TEST

/* Straight down from the root, the surface 50 mm below it: the mean square of what is deeper. */
START_TEST(depth_costs_its_mean_square)
{
    static lanes x[3 * M], target_x[3 * M], plane[4 * M], scratch[STRAND_ERROR_SCRATCH(M)];
    struct strand_error_target target = {.point = target_x, .plane = plane};
    struct strand_error_weights weights = {.depth = 4};
    lanes error;
    double expected = 0;
    for (uint32_t j = 0; j < M; j++)
        for (int l = 0; l < LANES; l++)
            x[3 * j + 1][l] = target_x[3 * j + 1][l] = -0.1f * (float)j / (M - 1);
    for (uint32_t k = 0; k < head_planes_of(M); k++) {
        for (int l = 0; l < LANES; l++)
            plane[4 * k + 1][l] = 1, plane[4 * k + 3][l] = 0.05f;
        expected += pow(fmax(0.1 * head_plane_vertex(k, M) / (M - 1) - 0.05, 0), 2) / head_planes_of(M);
    }
    strand_error_measure(M, &target);
    strand_error(kernel_best_variant(), M, (const lanes *)x, &target, &weights, scratch, error);
    for (int l = 0; l < LANES; l++)
        ck_assert_double_eq_tol((double)error[l], 4 * expected, 1e-6);
    target.plane = NULL;
    strand_error(kernel_best_variant(), M, (const lanes *)x, &target, &weights, scratch, error);
    ck_assert_float_eq(error[0], 0);
}
END_TEST

/* --- fits ------------------------------------------------------------------------------------ */

static float depth_of(const struct groom_bvh *head, const float (*x)[3])
{
    float depth = 0;
    for (uint32_t j = 1; j < M; j++)
        depth = fmaxf(depth, -groom_bvh_signed_distance(head, x[j]));
    return depth;
}

/* How much deeper in the head than its target; metres. */
static float beyond_of(const struct groom_fit *fit, uint32_t i, const float (*x)[3])
{
    float target[M][3], depth = depth_of(fit->bvh, x);
    for (uint32_t j = 0; j < M; j++)
        for (int c = 0; c < 3; c++)
            target[j][c] = fit->centre[c] + fit->scale * fit->target[(size_t)i * M + j][c];
    return depth > 0.001f ? depth - depth_of(fit->bvh, (const float (*)[3])target) : 0;
}

/* The capture pressed to the scalp: what is `by` off it comes half of the way to it, what is far from it stays. */
static void press(struct groom_sample *sample, float by)
{
    struct groom_bvh *head;
    struct groom_strands *strands = sample->capture;
    ck_ok(groom_bvh_create(sample->head, NULL, &head, NULL));
    for (uint32_t v = 0; v < strands->n_vertices; v++) {
        struct groom_surface_point near;
        float *x = strands->points[v];
        if (by > 0 && groom_bvh_closest(head, x, INFINITY, &near) && !groom_bvh_inside(head, x))
            for (int c = 0; c < 3; c++)
                x[c] += by / (near.distance + by) * (near.position[c] - x[c]);
    }
    groom_bvh_destroy(head);
}

/* The report tells what is left in. */
static void is_told(const struct groom_fit_report *report, uint32_t n_beyond)
{
    int said = 0;
    for (uint32_t k = 0; k < report->n_notes; k++)
        said |= strstr(report->notes[k], "deep in the head") != NULL;
    ck_assert_int_eq(said, report->n_in_head > 0);
    ck_assert_uint_le(n_beyond, report->n_beyond_target);
    ck_assert_uint_le(report->n_beyond_target, report->n_in_head);
}

static void stays_out(groom_sample_style style, float pressed, uint32_t most)
{
    struct groom_sample *sample = guides_sample(style, N, M, 5, NULL);
    struct groom_fit_options options;
    uint32_t n_in = 0;
    float worst = 0;
    press(sample, pressed);
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.vertices = M;
    struct groom_fit *fit = guides_fit(sample, &options, "end", NULL);
    float (*x)[3] = malloc((size_t)fit->n * M * sizeof *x);
    ck_ok(groom_evaluate(fit->groom, 0, fit->n, x, NULL, NULL));
    for (uint32_t i = 0; i < fit->n; i++) {
        float beyond = beyond_of(fit, i, (const float (*)[3])(x + (size_t)i * M));
        n_in += beyond > 0.001f;
        worst = fmaxf(worst, beyond);
    }
    ck_assert_msg(n_in <= most, "%u of %u strands are more than 1 mm deeper in the head than their targets, %.1f mm the deepest",
                  n_in, fit->n, 1000 * (double)worst);
    is_told(groom_fit_get_report(fit), n_in);
    free(x);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

/* None is left in; without the last pass 7, 37, 4 and 62 of 600. */
START_TEST(waves_stay_out_of_the_head) { stays_out(GROOM_SAMPLE_WAVY, 0, 0); } END_TEST
START_TEST(curls_near_the_scalp_stay_out_of_the_head) { stays_out(GROOM_SAMPLE_CURLY, 0.01f, 1); } END_TEST
START_TEST(coils_on_the_scalp_stay_out_of_the_head) { stays_out(GROOM_SAMPLE_COILY, 0.004f, 0); } END_TEST
START_TEST(straight_hair_that_lies_on_the_scalp_stays_out_of_the_head) { stays_out(GROOM_SAMPLE_STRAIGHT, 0.01f, 1); } END_TEST

/* Turns the guides nearest to a strand upside down, so that all of them go through the head. */
static void turn_guides_in(struct groom *groom, uint32_t strand, uint32_t n)
{
    struct groom_neighbours *index;
    uint32_t *near = malloc(n * sizeof *near);
    ck_ok(groom_neighbours_create(groom->guide_uv[0], groom->n_guides, 2, NULL, &index, NULL));
    ck_ok(groom_neighbours_find(index, groom->root_uv[strand], 1, n, near, NULL, NULL, NULL));
    for (uint32_t k = 0; k < n; k++) {
        float (*x)[3] = groom->guides + (size_t)near[k] * groom->n_vertices;
        for (uint32_t j = 1; j < groom->n_vertices; j++)
            for (int c = 0; c < 3; c++)
                x[j][c] = 2 * x[0][c] - x[j][c];
    }
    groom_neighbours_destroy(index);
    free(near);
}

static uint32_t count_beyond(const struct groom_fit *fit)
{
    float (*x)[3] = malloc((size_t)fit->n * M * sizeof *x);
    uint32_t n = 0;
    ck_ok(groom_evaluate(fit->groom, 0, fit->n, x, NULL, NULL));
    for (uint32_t i = 0; i < fit->n; i++)
        n += beyond_of(fit, i, (const float (*)[3])(x + (size_t)i * M)) > 0.001f;
    free(x);
    return n;
}

static struct head_left clear(struct groom_fit *fit, struct groom_context *context, groom_status expected)
{
    struct random_search search;
    struct head_left left = {0};
    ck_ok(random_search_init(&search, fit, NULL, NULL));
    search.weights = (struct strand_error_weights){1, 1e4f, 0, 1e5f};
    ck_assert_int_eq(head_clear(&search, 0, fit->n, &left, context, NULL), expected);
    random_search_finish(&search);
    return left;
}

/* A hundred of the guides around a strand go through the head: it follows others. */
START_TEST(strands_that_no_guide_near_them_keeps_out_follow_others)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, N, M, 5, NULL);
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.vertices = M;
    options.guides = 400;
    struct groom_fit *fit = guides_fit(sample, &options, "randoms", NULL);
    turn_guides_in(fit->groom, 0, 100);
    ck_assert_uint_gt(count_beyond(fit), 100);
    struct head_left left = clear(fit, NULL, GROOM_OK);
    ck_assert_uint_eq(left.n_beyond, 0);
    ck_assert_uint_eq(count_beyond(fit), 0);
    ck_ok(groom_validate(fit->groom, NULL));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* A look that runs out of memory leaves the strands as they were. */
START_TEST(a_look_that_fails_changes_nothing)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, 60, M, 5, NULL);
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.vertices = M;
    struct groom_fit *fit = guides_fit(sample, &options, "randoms", NULL);
    struct groom *groom = fit->groom;
    size_t n = (size_t)groom->n_strands * groom->n_instancing;
    uint32_t *guide = malloc(n * sizeof *guide);
    turn_guides_in(groom, 0, 1 + groom->n_guides / 2);
    memcpy(guide, groom->instancing_guide, n * sizeof *guide);
    for (size_t fail_at = 0; fail_at < 30; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        clear(fit, &context, GROOM_ENOMEM);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert_mem_eq(groom->instancing_guide, guide, n * sizeof *guide);
    }
    free(guide);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_head", planes_tell_how_deep_points_near_a_strand_are, depth_costs_its_mean_square, waves_stay_out_of_the_head,
           curls_near_the_scalp_stay_out_of_the_head, coils_on_the_scalp_stay_out_of_the_head,
           straight_hair_that_lies_on_the_scalp_stays_out_of_the_head, strands_that_no_guide_near_them_keeps_out_follow_others,
           a_look_that_fails_changes_nothing)
