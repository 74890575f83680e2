/* the generator of reconstructions */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "geometry/camera_json.h"
#include "groom/groom.h"
#include "groom/mesh.h"
#include "groom/strands.h"
#include "sample/parts.h"
#include "tests/support/test.h"

static struct groom_sample_options small(groom_sample_style style)
{
    struct groom_sample_options options;
    groom_sample_options_init(style, &options);
    options.n_strands = 300;
    options.n_vertices = 20;
    options.n_guides = 40;
    options.n_operator_guides = 10;
    options.n_cameras = 4;
    return options;
}

static struct groom_sample *sample_of(const struct groom_sample_options *options)
{
    struct groom_sample *sample;
    struct groom_diag diag = {0};
    groom_status st = groom_sample_create(options, NULL, &sample, &diag);
    ck_assert_msg(st == GROOM_OK, "%s: %s", diag.pointer, diag.detail);
    return sample;
}

START_TEST(a_capture_without_defects_is_the_truth)
{
    for (int style = 0; style < GROOM_SAMPLE_STYLE_COUNT; style++) {
        struct groom_sample_options options = small((groom_sample_style)style);
        struct groom_sample *sample = sample_of(&options);
        size_t bytes = (size_t)options.n_strands * options.n_vertices * 3 * sizeof(float);
        float (*points)[3] = malloc(bytes);
        ck_ok(groom_evaluate(sample->truth, 0, options.n_strands, points, NULL, NULL));
        ck_assert_uint_eq(sample->capture->n_strands, options.n_strands);
        ck_assert_mem_eq(points, sample->capture->points, bytes);
        free(points);
        groom_sample_destroy(sample);
    }
}
END_TEST

START_TEST(the_same_options_give_the_same_bits_for_one_thread_and_three)
{
    struct groom_sample_options options;
    struct groom_sample *a, *b;
    struct groom_pool *pool;
    groom_sample_options_capture(GROOM_SAMPLE_CURLY, &options);
    options.n_strands = 700;
    options.n_guides = options.n_operator_guides = 60;
    ck_ok(groom_pool_create(3, &pool));
    ck_ok(groom_sample_create(&options, NULL, &a, NULL));
    ck_ok(groom_sample_create(&options, &(struct groom_context){.pool = pool}, &b, NULL));
    ck_assert_uint_eq(a->capture->n_vertices, b->capture->n_vertices);
    ck_assert_mem_eq(a->capture->points, b->capture->points, a->capture->n_vertices * sizeof *a->capture->points);
    groom_sample_destroy(b);
    options.seed++;
    b = sample_of(&options);
    ck_assert(a->capture->n_vertices != b->capture->n_vertices ||
              memcmp(a->capture->points, b->capture->points, a->capture->n_vertices * sizeof *a->capture->points) != 0);
    groom_sample_destroy(a);
    groom_sample_destroy(b);
    groom_pool_destroy(pool);
}
END_TEST

START_TEST(the_head_is_closed_and_a_good_mesh)
{
    struct groom_mesh *head;
    ck_ok(sample_head_create(NULL, &head, NULL));
    ck_ok(groom_mesh_validate(head, NULL));
    /* every edge once each way: the sum of (from - to) products cancels */
    uint32_t *balance = calloc(head->n_vertices, sizeof *balance);
    for (uint32_t t = 0; t < head->n_triangles; t++)
        for (int i = 0; i < 3; i++) {
            balance[head->triangles[t][i]] += head->triangles[t][(i + 1) % 3];
            balance[head->triangles[t][(i + 1) % 3]] -= head->triangles[t][i];
        }
    for (uint32_t v = 0; v < head->n_vertices; v++)
        ck_assert_uint_eq(balance[v], 0);
    /* and outwards: the signed volume is that of a head with a neck */
    double volume = 0;
    for (uint32_t t = 0; t < head->n_triangles; t++) {
        const float *a = head->points[head->triangles[t][0]], *b = head->points[head->triangles[t][1]];
        const float *c = head->points[head->triangles[t][2]];
        volume += (a[0] * ((double)b[1] * c[2] - (double)b[2] * c[1]) + a[1] * ((double)b[2] * c[0] - (double)b[0] * c[2]) +
                   a[2] * ((double)b[0] * c[1] - (double)b[1] * c[0])) / 6;
    }
    ck_assert_double_gt(volume, 0.003);
    ck_assert_double_lt(volume, 0.008);
    free(balance);
    groom_mesh_destroy(head);
}
END_TEST

static double above_head(const float p[3])
{
    double d[3], r = 0;
    for (int c = 0; c < 3; c++) {
        d[c] = p[c] - sample_head_centre[c];
        r += d[c] * d[c];
    }
    r = sqrt(r);
    for (int c = 0; c < 3; c++)
        d[c] /= r;
    return r - sample_head_radius(d);
}

START_TEST(guides_grow_from_the_scalp_and_stay_out_of_the_head)
{
    for (int style = 0; style < GROOM_SAMPLE_STYLE_COUNT; style++) {
        struct groom_sample_options options = small((groom_sample_style)style);
        struct groom_sample *sample = sample_of(&options);
        const struct groom *truth = sample->truth;
        for (uint32_t g = 0; g < truth->n_guides; g++)
            for (uint32_t j = 0; j < truth->n_vertices; j++) {
                double above = above_head(truth->guides[(size_t)g * truth->n_vertices + j]);
                if (j == 0)
                    ck_assert_double_lt(fabs(above), 1e-5);
                ck_assert_double_gt(above, -0.0015); /* a chord between vertices cuts under the curve */
            }
        for (uint32_t i = 0; i < truth->n_strands; i++) {
            double d[3], r = 0;
            for (int c = 0; c < 3; c++) {
                d[c] = truth->roots[i][c] - sample_head_centre[c];
                r += d[c] * d[c];
            }
            for (int c = 0; c < 3; c++)
                d[c] /= sqrt(r);
            ck_assert(d[1] > -0.5); /* no hair on face or neck: asked of the hairline with room for rounding */
            ck_assert(!(d[2] > 0.9 && d[1] < 0.4));
        }
        groom_sample_destroy(sample);
    }
}
END_TEST

START_TEST(roots_are_spread_evenly)
{
    enum { N = 500 };
    static float roots[N][3];
    double nearest_mean = 0, nearest_least = 1;
    sample_head_roots(N, 0.1, roots);
    for (int i = 0; i < N; i++) {
        double least = 1;
        for (int j = 0; j < N; j++) {
            double d = 0;
            for (int c = 0; c < 3; c++)
                d += (roots[i][c] - roots[j][c]) * (roots[i][c] - roots[j][c]);
            least = i == j ? least : fmin(least, sqrt(d));
        }
        nearest_mean += least / N;
        nearest_least = fmin(nearest_least, least);
    }
    /* random points would come as near as a fiftieth of the mean */
    ck_assert_double_gt(nearest_least, 0.35 * nearest_mean);
}
END_TEST

START_TEST(defects_are_as_many_as_asked)
{
    struct groom_sample_options options = small(GROOM_SAMPLE_STRAIGHT);
    options.missing = 0.25;
    options.inner_short = 0.2;
    options.duplicates = 0.3;
    options.off_scalp_m = 0.004;
    struct groom_sample *sample = sample_of(&options);
    const struct groom_strands *capture = sample->capture;
    uint32_t n_left = 225, n_short = 0, n_off = 0;
    ck_assert_uint_gt(capture->n_strands, n_left + 40);
    ck_assert_uint_lt(capture->n_strands, n_left + 95);
    for (uint32_t s = 0; s < capture->n_strands; s++) {
        uint32_t n = capture->first[s + 1] - capture->first[s], i = sample->strand_of[s];
        ck_assert_uint_ge(n, 2);
        if (s >= n_left) /* again the same */
            continue;
        n_short += n < 16;
        n_off += memcmp(capture->points[capture->first[s]], sample->truth->roots[i], sizeof capture->points[0]) != 0;
        ck_assert_double_lt(above_head(capture->points[capture->first[s]]), 0.01);
    }
    ck_assert_uint_gt(n_short, 20);
    ck_assert_uint_lt(n_short, 61);
    ck_assert_uint_gt(n_off, 200);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(noise_has_the_size_asked)
{
    struct groom_sample_options options = small(GROOM_SAMPLE_STRAIGHT);
    struct groom_sample *clean = sample_of(&options);
    options.noise_m = 0.002;
    struct groom_sample *noisy = sample_of(&options);
    double square = 0;
    for (uint32_t v = 0; v < clean->capture->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            square += pow(noisy->capture->points[v][c] - clean->capture->points[v][c], 2);
    ck_assert_double_eq_tol(sqrt(square / (3.0 * clean->capture->n_vertices)), 0.002, 0.0002);
    groom_sample_destroy(clean);
    groom_sample_destroy(noisy);
}
END_TEST

static void refused(struct groom_sample_options options, const char *pointer)
{
    struct groom_sample *sample;
    struct groom_diag diag = {0};
    ck_status(groom_sample_create(&options, NULL, &sample, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, pointer);
}

START_TEST(options_out_of_range_are_refused_by_name)
{
    struct groom_sample_options good = small(GROOM_SAMPLE_WAVY), o;
    groom_sample_style style;
    o = good, o.n_strands = 0;
    refused(o, "/n_strands");
    o = good, o.n_vertices = 2;
    refused(o, "/n_vertices");
    o = good, o.n_guides = good.n_strands + 1;
    refused(o, "/n_guides");
    o = good, o.missing = 1;
    refused(o, "/missing");
    o = good, o.noise_m = NAN;
    refused(o, "/noise_m");
    ck_status(groom_sample_style_parse("curled", &style, NULL), GROOM_EINVAL);
    ck_ok(groom_sample_style_parse("coily", &style, NULL));
    ck_assert_int_eq(style, GROOM_SAMPLE_COILY);
}
END_TEST

START_TEST(the_smallest_sample_is_one_strand)
{
    struct groom_sample_options options = small(GROOM_SAMPLE_SPIKY);
    options.n_strands = options.n_guides = options.n_operator_guides = 1;
    options.n_vertices = 3;
    options.inner_short = 1;
    options.off_scalp_m = 0.05;
    options.n_cameras = 0;
    groom_sample_destroy(sample_of(&options));
}
END_TEST

START_TEST(cameras_see_the_head_and_print_as_json)
{
    struct groom_sample_options options = small(GROOM_SAMPLE_SHORT);
    struct groom_sample *sample = sample_of(&options);
    char *text;
    ck_ok(groom_sample_cameras_print(sample, &text, NULL));
    cJSON *json = cJSON_Parse(text), *item, *array = cJSON_GetObjectItem(json, "cameras");
    int n = 0;
    cJSON_ArrayForEach(item, array) {
        struct groom_camera camera;
        double pixel[2], depth;
        float centre[3] = {0, 1.64f, 0};
        ck_ok(camera_from_json(item, "", &camera, NULL));
        ck_assert_mem_eq(&camera, &sample->cameras[n], sizeof camera);
        n++;
        ck_assert(groom_camera_project(&camera, centre, pixel, &depth));
        ck_assert(pixel[0] > 256 && pixel[0] < 768 && pixel[1] > 256 && pixel[1] < 768);
    }
    ck_assert_int_eq(n, 4);
    cJSON_Delete(json);
    free(text);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(a_sample_survives_each_failing_allocation)
{
    struct groom_sample_options options = small(GROOM_SAMPLE_WAVY);
    options.n_strands = 20;
    options.n_guides = options.n_operator_guides = 4;
    for (size_t at = 0;; at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_sample *sample = NULL;
        test_failing_allocator_init(&state, at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = groom_sample_create(&options, &context, &sample, NULL);
        groom_sample_destroy(sample);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
    }
}
END_TEST

TEST_SUITE("sample", a_capture_without_defects_is_the_truth,
           the_same_options_give_the_same_bits_for_one_thread_and_three, the_head_is_closed_and_a_good_mesh,
           guides_grow_from_the_scalp_and_stay_out_of_the_head, roots_are_spread_evenly, defects_are_as_many_as_asked,
           noise_has_the_size_asked, options_out_of_range_are_refused_by_name, the_smallest_sample_is_one_strand,
           cameras_see_the_head_and_print_as_json, a_sample_survives_each_failing_allocation)
