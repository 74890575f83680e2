/* how alike two sets of strands are: known cases, and the grid behind them */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/mesh.h"
#include "groom/quality.h"
#include "groom/random.h"
#include "groom/sample.h"
#include "groom/groom.h"
#include "groom/strands.h"
#include "quality/segment_grid.h"
#include "tests/support/test.h"

#define DEGREE (3.14159265358979323846 / 180)

typedef void point_of(uint32_t strand, double t, double p[3]); /* t = 0..1 */

static struct groom_strands *make(uint32_t n, uint32_t m, point_of *point)
{
    struct groom_strands *strands;
    ck_ok(groom_strands_create(n, (uint64_t)n * m, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < m; j++) {
            double p[3];
            point(i, (double)j / (m - 1), p);
            strands->first[i + 1] = (i + 1) * m;
            for (int c = 0; c < 3; c++)
                strands->points[(size_t)i * m + j][c] = (float)p[c];
        }
    return strands;
}

static void add(struct groom_strands *strands, float x, float y, float z)
{
    for (uint32_t v = 0; v < strands->n_vertices; v++) {
        strands->points[v][0] += x;
        strands->points[v][1] += y;
        strands->points[v][2] += z;
    }
}

/* 10 cm down, 2 cm apart */
static void line(uint32_t i, double t, double p[3])
{
    p[0] = 0.02 * (i % 8);
    p[1] = -0.1 * t;
    p[2] = 0.02 * (i / 8);
}

static void longer_line(uint32_t i, double t, double p[3]) { line(i, 1.25 * t, p); }
static void line_upwards(uint32_t i, double t, double p[3]) { line(i, 1 - t, p); }

static const struct groom_quality_options small = {.strands = 500, .places = 5000};

static struct groom_quality compare(struct groom_strands *target, struct groom_strands *groom)
{
    struct groom_quality_target *made;
    struct groom_quality quality;
    ck_ok(groom_quality_target_create(target, NULL, &small, NULL, &made, NULL));
    ck_ok(groom_quality_compare(made, groom, NULL, &quality, NULL));
    groom_quality_target_destroy(made);
    groom_strands_destroy(target);
    groom_strands_destroy(groom);
    return quality;
}

START_TEST(a_set_is_like_itself)
{
    struct groom_quality q = compare(make(32, 20, line), make(32, 20, line));
    ck_assert_double_le(q.to_target.mean, 1e-6);
    ck_assert_double_le(q.to_groom.p95, 1e-6);
    ck_assert_double_le(q.spectra.distance, 1e-5);
    ck_assert_double_le(q.curvature.distance, 1e-2);
    for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++) {
        ck_assert_double_eq(q.scores[k].f_score, 1);
        ck_assert_double_eq(q.scores[k].nearest_f_score, 1);
        ck_assert_double_eq(q.scores[k].floor, 0); /* half of the lines are 2 cm from the other half */
    }
    ck_assert_int_eq(q.has_pairs, 1);
    ck_assert_double_le(q.pair_distance, 1e-6);
    ck_assert_int_eq(q.has_head, 0);
}
END_TEST

START_TEST(a_shift_shows_as_its_distance)
{
    struct groom_strands *groom = make(32, 20, line);
    add(groom, 0.0015f, 0, 0);
    struct groom_quality q = compare(make(32, 20, line), groom);
    ck_assert_double_eq_tol(q.to_target.mean, 0.0015, 1e-6);
    ck_assert_double_eq_tol(q.to_groom.p95, 0.0015, 1e-6);
    ck_assert_double_eq(q.scores[0].f_score, 0);
    ck_assert_double_eq(q.scores[1].f_score, 1);
    ck_assert_double_eq_tol(q.pair_distance, 0.0015, 1e-6);
    ck_assert_double_le(q.segments.distance, 1e-5); /* shapes are the same */
}
END_TEST

START_TEST(vertex_counts_do_not_matter)
{
    struct groom_quality q = compare(make(32, 2, line), make(32, 777, line));
    ck_assert_double_le(q.to_target.mean, 1e-6);
    ck_assert_double_le(q.pair_distance, 1e-6);
    ck_assert_double_eq(q.scores[0].nearest_f_score, 1);
}
END_TEST

START_TEST(direction_counts_from_root_to_tip)
{
    struct groom_quality q = compare(make(32, 20, line), make(32, 20, line_upwards));
    ck_assert_double_le(q.to_target.mean, 1e-6);
    for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++)
        ck_assert_double_eq(q.scores[k].f_score, 0);
    ck_assert_double_eq_tol(q.pair_direction, 180 * DEGREE, 1e-5);
}
END_TEST

static void short_line(uint32_t i, double t, double p[3])
{
    line(i, 0, p);
    p[1] = 0.001 * (t - 0.5);
}

static void turned_line(uint32_t i, double t, double p[3])
{
    line(i, 0, p);
    p[0] += 0.001 * (t - 0.5) * sin(15 * DEGREE);
    p[1] = 0.001 * (t - 0.5) * cos(15 * DEGREE);
}

START_TEST(an_angle_passes_the_tolerances_above_it)
{
    struct groom_quality q = compare(make(32, 20, short_line), make(32, 20, turned_line));
    ck_assert_double_eq(q.scores[0].f_score, 0);
    ck_assert_double_eq(q.scores[1].f_score, 1);
    ck_assert_double_eq(q.scores[2].nearest_f_score, 1);
    ck_assert_double_eq_tol(q.pair_direction, 15 * DEGREE, 1e-4);
}
END_TEST

/* A straight line, and 2 mm beside it one across: near, but along no line of the target. */
static void crossed(uint32_t i, double t, double p[3])
{
    line(i / 2, t, p);
    if (i % 2) {
        p[0] += 0.001 * (2 * t - 1);
        p[1] = -0.05;
        p[2] += 0.0015;
    }
}

START_TEST(precision_and_recall_tell_which_has_more)
{
    struct groom_quality q = compare(make(32, 20, line), make(64, 20, crossed));
    double extra = 0.002 / 0.102; /* of the groom's length */
    ck_assert_double_eq_tol(q.scores[2].precision, 1 - extra, 2e-3);
    ck_assert_double_eq(q.scores[2].recall, 1);
    ck_assert_double_eq_tol(q.scores[2].f_score, 2 * (1 - extra) / (2 - extra), 2e-3);
    ck_assert_int_eq(q.has_pairs, 0);
}
END_TEST

START_TEST(the_nearest_segment_alone_is_the_stricter_reading)
{
    /* the target has a line across in front of each line; the groom's lines run where the target's do, but
     * 1.2 mm further to the front, so that the nearest segment there is the one across */
    struct groom_strands *groom = make(32, 20, line);
    add(groom, 0, 0, 0.0012f);
    struct groom_quality q = compare(make(64, 20, crossed), groom);
    ck_assert_double_eq(q.scores[1].precision, 1);
    ck_assert_double_lt(q.scores[1].nearest_precision, 1);
    ck_assert_double_gt(q.scores[1].nearest_precision, 0.95);
}
END_TEST

START_TEST(length_is_compared_in_metres)
{
    struct groom_quality q = compare(make(32, 20, line), make(32, 20, longer_line));
    ck_assert_double_eq_tol(q.length.distance, 0.025, 1e-6);
    ck_assert_double_le(q.length.floor, 1e-6);
    ck_assert_double_eq_tol(q.length_groom / q.length_target, 1.25, 1e-6);
    ck_assert_double_eq_tol(q.to_target.p95, 0.02, 2e-3); /* a fifth sticks out by up to 25 mm */
    ck_assert_double_eq_tol(q.scores[0].precision, 0.8 + 0.001 / 0.125, 2e-3);
    ck_assert_double_eq(q.scores[0].recall, 1);
}
END_TEST

/* radius 4 mm, 3 turns of 10 mm */
static void helix(uint32_t i, double t, double p[3])
{
    double angle = 3 * 2 * 180 * DEGREE * t + i;
    p[0] = 0.02 * i + 0.004 * cos(angle);
    p[1] = -0.03 * t;
    p[2] = 0.004 * sin(angle);
}
static void mirrored_helix(uint32_t i, double t, double p[3])
{
    helix(i, t, p);
    p[2] = -p[2];
}

START_TEST(curvature_and_torsion_are_those_of_a_helix)
{
    double rise = 0.01 / (2 * 180 * DEGREE), square = 0.004 * 0.004 + rise * rise;
    double curvature = 0.004 / square, torsion = rise / square;
    struct groom_quality q = compare(make(32, 20, line), make(32, 2000, helix));
    ck_assert_double_eq_tol(q.curvature.distance, curvature, 0.03 * curvature);
    q = compare(make(32, 2000, mirrored_helix), make(32, 2000, helix));
    ck_assert_double_eq_tol(q.torsion.distance, 2 * torsion, 0.1 * torsion); /* the other hand */
    ck_assert_double_le(q.curvature.distance, 0.01 * curvature);
}
END_TEST

/* A quarter of a circle of 0.1 m; of nine vertices it is eight straight pieces, which are curved all the same. */
static void arc(uint32_t i, double t, double p[3])
{
    p[0] = 0.02 * i + 0.1 * cos(90 * DEGREE * t);
    p[1] = -0.1 * sin(90 * DEGREE * t);
    p[2] = 0.01 * i;
}

START_TEST(curvature_is_looked_at_as_closely_as_the_target_was_made)
{
    struct groom_quality q = compare(make(32, 9, arc), make(32, 300, arc));
    ck_assert_uint_eq(q.bend_vertices, 9);
    ck_assert_double_le(q.curvature.distance, 0.03 * 10);
    q = compare(make(32, 300, arc), make(32, 9, line));
    ck_assert_uint_eq(q.bend_vertices, 100);
    ck_assert_double_eq_tol(q.curvature.distance, 10, 0.1);
}
END_TEST

START_TEST(histograms_hold_most_values)
{
    struct groom_quality q = compare(make(32, 2000, helix), make(32, 2000, helix));
    double target = 0, groom = 0;
    for (int b = 0; b < GROOM_QUALITY_BINS; b++) {
        target += q.lengths.target[b];
        groom += q.curvatures.groom[b];
    }
    ck_assert_double_eq_tol(target, 1, 1e-9);
    ck_assert_double_ge(groom, 0.97);
    ck_assert_double_eq(q.curvatures.low, 0);
    ck_assert_double_gt(q.curvatures.high, 0);
}
END_TEST

/* --- the floor ------------------------------------------------------------------------- */

static struct groom_sample *sample_of(uint64_t seed)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    groom_sample_options_init(GROOM_SAMPLE_CURLY, &options);
    options.n_strands = 1500;
    options.n_vertices = 60;
    options.n_guides = 60;
    options.n_operator_guides = 60;
    options.seed = seed;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    return sample;
}

static struct groom_strands *evaluate(const struct groom *groom)
{
    struct groom_strands *strands;
    ck_ok(groom_strands_create(groom->n_strands, (uint64_t)groom->n_strands * groom->n_vertices, NULL, &strands, NULL));
    for (uint32_t i = 0; i <= groom->n_strands; i++)
        strands->first[i] = i * groom->n_vertices;
    ck_ok(groom_evaluate(groom, 0, groom->n_strands, strands->points, NULL, NULL));
    return strands;
}

START_TEST(the_truth_with_other_random_numbers_scores_its_floor)
{
    struct groom_sample *sample = sample_of(4);
    struct groom_strands *first = evaluate(sample->truth), *second;
    for (uint32_t o = 0; o < sample->truth->n_operators; o++)
        if (!groom_operator_random_per_guide(sample->truth->operators[o].type))
            groom_draw_random(sample->truth, &sample->truth->operators[o], 99);
    second = evaluate(sample->truth);
    struct groom_quality q = compare(first, second);
    ck_assert_double_eq_tol(q.spectra.distance / q.spectra.floor, 1, 0.15);
    ck_assert_double_eq_tol(q.segments.distance / q.segments.floor, 1, 0.15);
    ck_assert_double_le(q.length.distance, 2.5 * q.length.floor);
    ck_assert_double_gt(q.pair_distance, 1e-3); /* strand by strand they differ */
    ck_assert_double_gt(q.scores[2].floor, 0.3);
    groom_sample_destroy(sample);
}
END_TEST

/* --- the head --------------------------------------------------------------------------- */

/* A cube from -0.1 to 0.1. */
static struct groom_mesh *cube(void)
{
    static const uint32_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    struct groom_mesh *mesh;
    ck_ok(groom_mesh_create(8, 12, 0, NULL, &mesh, NULL));
    for (int v = 0; v < 8; v++)
        for (int c = 0; c < 3; c++)
            mesh->points[v][c] = v >> c & 1 ? 0.1f : -0.1f;
    memcpy(mesh->triangles, faces, sizeof faces);
    return mesh;
}

/* Strands of 20 cm across the top at y = 0.1: every fourth 4 mm below it, one 0.5 mm. */
static void across_top(uint32_t i, double t, double p[3])
{
    p[0] = 0.2 * t - 0.0999;
    p[1] = i % 4 == 0 ? 0.096 : i == 1 ? 0.0995 : 0.11;
    p[2] = 0.002 * i - 0.03;
}

START_TEST(strands_in_the_head_are_counted)
{
    struct groom_mesh *head = cube();
    struct groom_strands *strands = make(32, 101, across_top);
    struct groom_quality_target *target;
    struct groom_quality q;
    ck_ok(groom_quality_target_create(strands, head, &small, NULL, &target, NULL));
    ck_ok(groom_quality_compare(target, strands, NULL, &q, NULL));
    ck_assert_int_eq(q.has_head, 1);
    ck_assert_uint_eq(q.head_groom.strands, 8);
    ck_assert_double_eq_tol(q.head_groom.deepest, 0.004, 1e-6);
    ck_assert_double_eq_tol(q.head_groom.share, 0.25, 0.01);
    ck_assert_int_eq(memcmp(&q.head_groom, &q.head_target, sizeof q.head_groom), 0);
    groom_quality_target_destroy(target);
    groom_strands_destroy(strands);
    groom_mesh_destroy(head);
}
END_TEST

/* --- the grid ---------------------------------------------------------------------------- */

static const struct groom_random_key key = {5, 77};

static void wild(uint32_t i, double t, double p[3])
{
    for (int c = 0; c < 3; c++)
        p[c] = 0.2 * groom_random_uniform(key, i, (uint32_t)c) +
               t * 0.1 * groom_random_normal(key, i, 10 + (uint32_t)c) * (i == 3 ? 30 : 1);
}

static double brute_force(const struct quality_set *set, const float p[3])
{
    double least = INFINITY;
    for (uint32_t i = 0; i < set->n; i++)
        for (uint32_t j = 0; j + 1 < set->m; j++) {
            const float *a = set->points[i * set->m + j], *b = a + 3;
            double dot = 0, square = 0, distance = 0;
            for (int c = 0; c < 3; c++) {
                dot += ((double)p[c] - a[c]) * ((double)b[c] - a[c]);
                square += ((double)b[c] - a[c]) * ((double)b[c] - a[c]);
            }
            double t = square > 0 ? fmin(fmax(dot / square, 0), 1) : 0;
            for (int c = 0; c < 3; c++) {
                double d = p[c] - (a[c] + t * ((double)b[c] - a[c]));
                distance += d * d;
            }
            least = fmin(least, distance);
        }
    return sqrt(least);
}

START_TEST(the_grid_finds_what_looking_at_all_segments_finds)
{
    struct groom_strands *strands = make(200, 12, wild);
    struct quality_set set;
    struct segment_grid grid;
    ck_ok(quality_set_init(&set, strands, 12, NULL, NULL));
    ck_ok(segment_grid_init(&grid, &set, NULL, NULL));
    for (uint32_t k = 0; k < 600; k++) {
        struct quality_place place = {.direction = {1, 0, 0}};
        float squared, cosine;
        double reach = k % 3 == 0 ? 0.3 : k % 3 == 1 ? 4 : 1000; /* among them, around them, far away */
        for (int c = 0; c < 3; c++)
            place.position[c] = (float)(reach * (groom_random_uniform(key, k, 20 + (uint32_t)c) - 0.3));
        segment_grid_nearest(&grid, &place, &squared, &cosine);
        double expected = brute_force(&set, place.position);
        ck_assert_double_eq_tol(sqrt(squared), expected, 1e-6 + 1e-5 * expected);
        ck_assert(fabsf(cosine) <= 1.00001f);
    }
    segment_grid_finish(&grid);
    quality_set_finish(&set);
    groom_strands_destroy(strands);
}
END_TEST

/* --- as a whole ---------------------------------------------------------------------------- */

START_TEST(the_bits_do_not_depend_on_threads)
{
    struct groom_sample *sample = sample_of(2);
    struct groom_strands *strands = evaluate(sample->truth);
    struct groom_quality found[2];
    memset(found, 0, sizeof found);
    for (uint32_t k = 0; k < 2; k++) {
        struct groom_pool *pool;
        struct groom_quality_target *target;
        ck_ok(groom_pool_create(k == 0 ? 1 : 3, &pool));
        struct groom_context context = {.pool = pool};
        ck_ok(groom_quality_target_create(sample->capture, sample->head, &small, &context, &target, NULL));
        ck_ok(groom_quality_compare(target, strands, &context, &found[k], NULL));
        groom_quality_target_destroy(target);
        groom_pool_destroy(pool);
    }
    char *text[2];
    for (int k = 0; k < 2; k++)
        ck_ok(groom_quality_print(&found[k], &found[k], &text[k], NULL));
    ck_assert_str_eq(text[0], text[1]);
    free(text[0]);
    free(text[1]);
    groom_strands_destroy(strands);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(what_cannot_be_compared_is_refused)
{
    struct groom_strands *one = make(1, 5, line), *points = make(8, 5, line), *lines = make(8, 5, line);
    struct groom_quality_target *target = NULL;
    struct groom_quality quality;
    struct groom_quality_options few = {.vertices = 3};
    ck_status(groom_quality_target_create(one, NULL, NULL, NULL, &target, NULL), GROOM_EEMPTY);
    memset(points->points, 0, 40 * sizeof *points->points);
    ck_status(groom_quality_target_create(points, NULL, NULL, NULL, &target, NULL), GROOM_EEMPTY);
    points->points[7][1] = NAN;
    ck_status(groom_quality_target_create(points, NULL, NULL, NULL, &target, NULL), GROOM_EINVAL);
    ck_status(groom_quality_target_create(lines, NULL, &few, NULL, &target, NULL), GROOM_EINVAL);
    ck_assert_ptr_null(target);
    ck_ok(groom_quality_target_create(lines, NULL, &small, NULL, &target, NULL));
    ck_status(groom_quality_compare(target, one, NULL, &quality, NULL), GROOM_EEMPTY);
    ck_status(groom_quality_compare(target, points, NULL, &quality, NULL), GROOM_EINVAL);
    groom_quality_target_destroy(target);
    groom_strands_destroy(one);
    groom_strands_destroy(points);
    groom_strands_destroy(lines);
}
END_TEST

START_TEST(no_failing_allocation_leaks)
{
    struct groom_strands *target = make(32, 20, line), *groom = make(32, 20, helix);
    struct groom_mesh *head = cube();
    struct groom_quality_options smaller = {.vertices = 6, .places = 100};
    groom_status st = GROOM_ENOMEM;
    for (size_t fail_at = 0; st != GROOM_OK; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_quality_target *made = NULL;
        struct groom_quality quality;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        st = groom_quality_target_create(target, head, &smaller, &context, &made, NULL);
        if (st == GROOM_OK)
            st = groom_quality_compare(made, groom, &context, &quality, NULL);
        ck_assert(st == GROOM_OK || st == GROOM_ENOMEM);
        groom_quality_target_destroy(made);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert_uint_lt(fail_at, 500);
    }
    groom_strands_destroy(target);
    groom_strands_destroy(groom);
    groom_mesh_destroy(head);
}
END_TEST

TEST_SUITE("quality", a_set_is_like_itself, a_shift_shows_as_its_distance, vertex_counts_do_not_matter,
           direction_counts_from_root_to_tip, an_angle_passes_the_tolerances_above_it,
           precision_and_recall_tell_which_has_more, the_nearest_segment_alone_is_the_stricter_reading,
           length_is_compared_in_metres, curvature_and_torsion_are_those_of_a_helix,
           curvature_is_looked_at_as_closely_as_the_target_was_made, histograms_hold_most_values,
           the_truth_with_other_random_numbers_scores_its_floor, strands_in_the_head_are_counted,
           the_grid_finds_what_looking_at_all_segments_finds, the_bits_do_not_depend_on_threads,
           what_cannot_be_compared_is_refused, no_failing_allocation_leaks)
