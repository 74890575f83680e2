/* Layers of a chain on whole dense strands */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/layers.h"
#include "groom/spatial.h"
#include "tests/support/grooms.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

#define M 61

/* Coils as they would be uploaded. */
static struct groom *coils(uint32_t n, uint64_t seed)
{
    struct groom_superhelices *h = superhelix_coils(n, 30, seed, 0);
    struct groom_strands *strands;
    struct groom *groom;
    ck_ok(groom_strands_create(n, (uint64_t)n * M, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++)
        strands->first[i + 1] = M * (i + 1);
    ck_ok(groom_superhelices_sample(h, M, strands->points, NULL, NULL));
    ck_ok(groom_create_of_strands(strands, NULL, &groom, NULL));
    groom_strands_destroy(strands);
    groom_superhelices_destroy(h);
    return groom;
}

static struct groom_operator *append(struct groom *groom, groom_operator_type type, uint64_t seed)
{
    ck_ok(groom_insert_operator(groom, groom->n_operators, type, seed, NULL));
    return &groom->operators[groom->n_operators - 1];
}

static struct groom_strands *evaluate(const struct groom *groom)
{
    struct groom_strands *strands = NULL;
    struct groom_diag diag = {0};
    groom_status status = groom_layers_evaluate(groom, NULL, &strands, &diag);
    ck_assert_msg(status == GROOM_OK, "%s at %s: %s", groom_status_name(status), diag.pointer, diag.detail);
    return strands;
}

static int same_strand(const struct groom_strands *a, const struct groom_strands *b, uint32_t i)
{
    return memcmp(a->points + a->first[i], b->points + b->first[i], (a->first[i + 1] - a->first[i]) * sizeof *a->points) == 0;
}

static uint32_t n_different(const struct groom_strands *a, const struct groom_strands *b)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < a->n_strands; i++)
        n += !same_strand(a, b, i);
    return n;
}

static double distance(const float a[3], const float b[3])
{
    return sqrt(pow((double)(a[0] - b[0]), 2) + pow((double)(a[1] - b[1]), 2) + pow((double)(a[2] - b[2]), 2));
}

static double length_of(const struct groom_strands *s, uint32_t i)
{
    return groom_polyline_length((const float(*)[3])s->points + s->first[i], s->first[i + 1] - s->first[i]);
}

/* --- sculpt ------------------------------------------------------------------------------- */

/* The tips of strands 2 and 5 are to go 2 cm aside. */
static void pull_two(struct groom *groom, struct groom_operator *op)
{
    struct groom_layer_anchors *anchors = &op->layer->anchors;
    ck_ok(groom_layer_anchors_resize(anchors, 2, groom->allocator));
    for (uint32_t k = 0; k < 2; k++) {
        anchors->strand[k] = k ? 5 : 2;
        anchors->at[k] = 1.0f;
        memcpy(anchors->position[k], groom->base[groom->first[anchors->strand[k] + 1] - 1], sizeof(float[3]));
        anchors->position[k][0] += 0.02f;
    }
    op->parameter[0] = 0.05f; /* soft */
}

START_TEST(sculpt_moves_what_is_pulled_and_nothing_else)
{
    struct groom *groom = coils(9, 3);
    struct groom_strands *rest = evaluate(groom), *after;
    struct groom_layer_report report;
    pull_two(groom, append(groom, GROOM_OPERATOR_SCULPT, 1));
    ck_ok(groom_validate(groom, NULL));
    ck_ok(groom_layer_apply(groom, 0, rest, NULL, NULL, &after, &report, NULL));
    ck_assert_uint_eq(n_different(rest, after), 2);
    ck_assert_uint_eq(report.n_strands, 2);
    ck_assert_uint_eq(report.n_changed, 2);
    ck_assert_uint_eq(report.sculpt.n_anchors, 2);
    ck_assert(report.sculpt.anchor_error_max_m < 0.002);
    ck_assert(report.sculpt.energy_after < report.sculpt.energy_before);
    ck_assert_uint_ge(report.sculpt.iterations_max, report.sculpt.iterations_median);
    const struct groom_layer_anchors *anchors = &groom->operators[0].layer->anchors;
    for (uint32_t k = 0; k < 2; k++) {
        uint32_t i = anchors->strand[k];
        double miss = distance(after->points[after->first[i + 1] - 1], anchors->position[k]);
        ck_assert_double_le(miss, 1.1 * report.sculpt.anchor_error_max_m + 1e-6);
        ck_assert_double_eq_tol(length_of(after, i), length_of(rest, i), 0.005 * length_of(rest, i));
        ck_assert_mem_eq(after->points[after->first[i]], rest->points[rest->first[i]], sizeof(float[3]));
    }
    groom_strands_destroy(rest);
    groom_strands_destroy(after);
    groom_destroy(groom);
}
END_TEST

START_TEST(an_input_kept_from_before_gives_the_same_bits)
{
    struct groom *groom = coils(9, 3);
    struct groom_strands *rest = evaluate(groom), *fresh, *reused;
    struct groom_layer_input *input;
    struct groom_operator *op = append(groom, GROOM_OPERATOR_SCULPT, 1);
    pull_two(groom, op);
    ck_ok(groom_layer_input_create(groom, 0, rest, NULL, &input, NULL));
    uint32_t n;
    const uint32_t *strands = groom_layer_input_strands(input, &n);
    ck_assert(n == 2 && strands[0] == 2 && strands[1] == 5);
    op->layer->anchors.position[0][1] += 0.01f;
    op->parameter[0] = 3.0f;
    ck_assert_int_eq(groom_layer_input_serves(input, groom, 0), 1);
    ck_ok(groom_layer_apply(groom, 0, rest, input, NULL, &reused, NULL, NULL));
    ck_ok(groom_layer_apply(groom, 0, rest, NULL, NULL, &fresh, NULL, NULL));
    ck_assert_uint_eq(n_different(fresh, reused), 0);
    op->layer->anchors.strand[0] = 3;
    ck_assert_int_eq(groom_layer_input_serves(input, groom, 0), 0);
    op->layer->anchors.strand[0] = 2;
    op->layer->n_elements = 20;
    ck_assert_int_eq(groom_layer_input_serves(input, groom, 0), 0);
    groom_layer_input_destroy(input);
    groom_strands_destroy(rest);
    groom_strands_destroy(fresh);
    groom_strands_destroy(reused);
    groom_destroy(groom);
}
END_TEST

static void shift_cluster(struct groom *groom, struct groom_operator *op, uint32_t count, uint32_t cluster)
{
    op->layer->grouping = (struct groom_grouping){.kind = GROOM_GROUPING_CLUSTERS, .count = count, .seed = 3};
    op->parameter[0] = 0.05f;
    ck_ok(groom_layer_frames_resize(op->layer, 1, groom->allocator));
    op->layer->frames[0] = (struct groom_layer_frame){cluster, 0.8f, {{1, 0, 0, 0.015f}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
}

/* Some strands by their own anchors, listed from the last to the first, others by two frames of their clusters. */
static void pull_many(struct groom *groom, struct groom_operator *op, uint32_t n)
{
    struct groom_layer_anchors *anchors = &op->layer->anchors;
    shift_cluster(groom, op, 5, 2);
    ck_ok(groom_layer_frames_resize(op->layer, 2, groom->allocator));
    for (uint32_t k = 0; k < 2; k++)
        op->layer->frames[k] = (struct groom_layer_frame){1 + 2 * k, 0.8f, {{1, 0, 0, 0.01f}, {0, 1, 0, 0}, {0, 0, 1, 0.01f}}};
    ck_ok(groom_layer_anchors_resize(anchors, n / 3, groom->allocator));
    for (uint32_t k = 0; k < n / 3; k++) {
        uint32_t i = anchors->strand[k] = n - 1 - 3 * k;
        anchors->at[k] = 1.0f;
        memcpy(anchors->position[k], groom->base[groom->first[i + 1] - 1], sizeof(float[3]));
        anchors->position[k][1] += 0.015f;
    }
    ck_ok(groom_validate(groom, NULL));
}

START_TEST(many_strands_change_the_same_fresh_kept_and_in_place)
{
    enum { N = 300 }; /* some blocks, the last one short */
    struct groom *groom = coils(N, 9);
    struct groom_strands *rest = evaluate(groom), *fresh, *kept;
    struct groom_layer_input *input;
    struct groom_layer_report reports[3];
    struct groom_context context = {0};
    ck_ok(groom_pool_create(3, &context.pool));
    pull_many(groom, append(groom, GROOM_OPERATOR_SCULPT, 1), N);
    ck_ok(groom_layer_apply(groom, 0, rest, NULL, NULL, &fresh, &reports[0], NULL));
    ck_ok(groom_layer_input_create(groom, 0, rest, &context, &input, NULL));
    ck_ok(groom_layer_apply(groom, 0, rest, input, &context, &kept, &reports[1], NULL));
    ck_ok(groom_layer_change(groom, 0, rest, NULL, &context, &reports[2], NULL));
    ck_assert_uint_eq(n_different(fresh, kept), 0);
    ck_assert_uint_eq(n_different(fresh, rest), 0);
    ck_assert_uint_gt(reports[0].n_changed, N / 3);
    ck_assert_uint_gt(reports[0].sculpt.n_anchors, reports[0].n_changed); /* some strands have both */
    for (int k = 1; k < 3; k++)
        ck_assert_mem_eq(&reports[k], &reports[0], sizeof reports[0]);
    groom_layer_input_destroy(input);
    groom_pool_destroy(context.pool);
    groom_strands_destroy(rest);
    groom_strands_destroy(fresh);
    groom_strands_destroy(kept);
    groom_destroy(groom);
}
END_TEST

START_TEST(a_frame_that_takes_strands_too_far_is_named)
{
    struct groom *groom = coils(300, 9);
    struct groom_operator *op = append(groom, GROOM_OPERATOR_SCULPT, 1);
    struct groom_strands *strands = NULL;
    struct groom_diag diag = {0};
    pull_many(groom, op, 300);
    op->layer->frames[1].transform[2][3] = INFINITY;
    ck_status(groom_layers_evaluate(groom, NULL, &strands, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/operators/0/frames/1/transform");
    groom_destroy(groom);
}
END_TEST

static void note_fraction(void *user, double fraction)
{
    double *last = user;
    ck_assert(fraction > *last && fraction <= 1.0);
    *last = fraction;
}

static int after_a_tenth(void *user) { return *(double *)user > 0.1; }

START_TEST(a_large_layer_tells_how_far_it_is_and_can_be_stopped)
{
    enum { N = 20000 };
    struct groom *groom = coils(N, 9);
    struct groom_strands *rest = evaluate(groom);
    double last = 0.0;
    struct groom_progress progress = {.report = note_fraction, .cancelled = after_a_tenth, .user = &last};
    struct groom_context context = {.progress = &progress};
    pull_many(groom, append(groom, GROOM_OPERATOR_SCULPT, 1), N);
    groom->operators[0].layer->n_elements = 6;
    ck_status(groom_layer_change(groom, 0, rest, NULL, &context, NULL, NULL), GROOM_ECANCELLED);
    ck_assert(last > 0.1 && last < 1.0);
    groom_strands_destroy(rest);
    groom_destroy(groom);
}
END_TEST

START_TEST(a_moved_frame_takes_its_cluster_along)
{
    struct groom *groom = coils(40, 4);
    struct groom_strands *rest = evaluate(groom), *after;
    struct groom_layer_input *input;
    struct groom_layer_report report;
    shift_cluster(groom, append(groom, GROOM_OPERATOR_SCULPT, 1), 5, 2);
    ck_ok(groom_validate(groom, NULL));
    ck_ok(groom_layer_input_create(groom, 0, rest, NULL, &input, NULL));
    ck_ok(groom_layer_apply(groom, 0, rest, input, NULL, &after, &report, NULL));
    uint32_t n;
    const uint32_t *strands = groom_layer_input_strands(input, &n);
    ck_assert(n > 0 && n < 40);
    ck_assert_uint_eq(report.sculpt.n_anchors, n);
    ck_assert_uint_eq(n_different(rest, after), n);
    for (uint32_t k = 0; k < n; k++) {
        uint32_t v = rest->first[strands[k]] + (M - 1) * 8 / 10;
        ck_assert_double_eq_tol((double)(after->points[v][0] - rest->points[v][0]), 0.015, 0.004);
    }
    groom_layer_input_destroy(input);
    groom_strands_destroy(rest);
    groom_strands_destroy(after);
    groom_destroy(groom);
}
END_TEST

START_TEST(an_empty_cluster_is_refused_with_its_frame)
{
    struct groom *groom = coils(6, 4);
    struct groom_strands *after = NULL;
    struct groom_diag diag = {0};
    for (uint32_t i = 1; i < 6; i++) /* all in one place */
        memcpy(groom->base + groom->first[i], groom->base, M * sizeof *groom->base);
    struct groom_operator *op = append(groom, GROOM_OPERATOR_SCULPT, 1);
    groom_status status = GROOM_OK;
    for (uint32_t cluster = 0; cluster < 3 && status == GROOM_OK; cluster++) {
        shift_cluster(groom, op, 3, cluster);
        status = groom_layers_evaluate(groom, NULL, &after, &diag);
        groom_strands_destroy(status == GROOM_OK ? after : NULL);
    }
    ck_assert_int_eq(status, GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/operators/0/frames/0/cluster");
    groom_destroy(groom);
}
END_TEST

/* --- ruffle, curl_scale, interpolate --------------------------------------------------------- */

START_TEST(another_seed_ruffles_to_another_head)
{
    struct groom *groom = coils(200, 5);
    struct groom_strands *rest = evaluate(groom), *one, *two;
    struct groom_operator *op = append(groom, GROOM_OPERATOR_RUFFLE, 1);
    one = evaluate(groom);
    ck_assert_uint_gt(n_different(rest, one), 150);
    groom_draw_random(groom, op, 2);
    two = evaluate(groom);
    ck_assert_uint_gt(n_different(one, two), 150);
    groom_strands_destroy(two);
    op->parameter[0] = 0.0f;
    two = evaluate(groom);
    ck_assert_uint_eq(n_different(rest, two), 0);
    groom_strands_destroy(two);
    op->enabled = 0;
    two = evaluate(groom);
    ck_assert_uint_eq(n_different(rest, two), 0);
    groom_strands_destroy(rest);
    groom_strands_destroy(one);
    groom_strands_destroy(two);
    groom_destroy(groom);
}
END_TEST

START_TEST(ruffling_stays_within_groups)
{
    struct groom *groom = coils(60, 5);
    struct groom_operator *op = append(groom, GROOM_OPERATOR_RUFFLE, 1);
    op->layer->grouping.kind = GROOM_GROUPING_GIVEN;
    op->layer->grouping.count = 60;
    op->layer->grouping.of_strand = groom->allocator->allocate(groom->allocator->user, 60 * sizeof(uint32_t));
    for (uint32_t i = 0; i < 60; i++)
        op->layer->grouping.of_strand[i] = i;
    ck_ok(groom_validate(groom, NULL));
    struct groom_strands *alone = evaluate(groom);
    for (uint32_t i = 0; i < 60; i++) /* each is a group of its own: there is nobody to exchange with */
        ck_assert_mem_eq(alone->points + alone->first[i], groom->base + groom->first[i], M * sizeof *groom->base);
    groom_strands_destroy(alone);
    groom_destroy(groom);
}
END_TEST

START_TEST(curls_of_one_group_are_widened)
{
    struct groom *groom = coils(40, 6);
    struct groom_strands *rest = evaluate(groom), *after;
    struct groom_operator *op = append(groom, GROOM_OPERATOR_CURL_SCALE, 1);
    op->parameter[0] = 1.5f;
    op->layer->grouping = (struct groom_grouping){.kind = GROOM_GROUPING_CLUSTERS, .count = 4, .seed = 3};
    op->layer->by_group = 1;
    op->layer->group = 1;
    ck_ok(groom_validate(groom, NULL));
    after = evaluate(groom);
    uint32_t n = n_different(rest, after);
    ck_assert(n > 0 && n < 40);
    groom_strands_destroy(after);
    op->layer->by_group = 0;
    after = evaluate(groom);
    ck_assert_uint_eq(n_different(rest, after), 40);
    for (uint32_t i = 0; i < 40; i++)
        ck_assert_double_eq_tol(length_of(after, i), length_of(rest, i), 0.03 * length_of(rest, i));
    groom_strands_destroy(rest);
    groom_strands_destroy(after);
    groom_destroy(groom);
}
END_TEST

START_TEST(interpolation_ends_at_both_grooms)
{
    struct groom *a = coils(30, 7), *b = coils(30, 8);
    for (uint32_t i = 0; i < 30; i++) { /* the same roots */
        const float *to = a->base[a->first[i]], from[3] = {b->base[b->first[i]][0], b->base[b->first[i]][1], b->base[b->first[i]][2]};
        for (uint32_t v = b->first[i]; v < b->first[i + 1]; v++)
            for (int c = 0; c < 3; c++)
                b->base[v][c] += to[c] - from[c];
    }
    struct groom_strands *own = evaluate(a), *other = evaluate(b), *between;
    struct groom_operator *op = append(a, GROOM_OPERATOR_INTERPOLATE, 1);
    op->layer->target = other;
    op->parameter[0] = 0.0f;
    between = evaluate(a);
    ck_assert_uint_eq(n_different(own, between), 0);
    groom_strands_destroy(between);
    op->parameter[0] = 1.0f;
    between = evaluate(a);
    for (uint32_t v = 0; v < other->n_vertices; v++)
        ck_assert_double_le(distance(other->points[v], between->points[v]), 2e-4);
    groom_strands_destroy(between);
    groom_strands_destroy(own);
    groom_destroy(a);
    groom_destroy(b);
}
END_TEST

/* --- chains --------------------------------------------------------------------------------------- */

/* Operators, layers and operators again, on a groom of guides. */
static struct groom *long_chain(void)
{
    struct groom *groom = test_groom((struct groom_shape){150, 40, 20, 5, 3}, 11);
    append(groom, GROOM_OPERATOR_SCALE, 1);
    append(groom, GROOM_OPERATOR_CURL, 2);
    groom->operators[1].parameter[0] = 0.006f;
    groom->operators[1].parameter[3] = 0.0f;
    append(groom, GROOM_OPERATOR_RUFFLE, 3)->layer->grouping.kind = GROOM_GROUPING_OPERATOR_GUIDES;
    append(groom, GROOM_OPERATOR_CLUMP, 4);
    append(groom, GROOM_OPERATOR_CURL_SCALE, 5)->parameter[0] = 1.4f;
    append(groom, GROOM_OPERATOR_FRIZZ, 6);
    ck_ok(groom_validate(groom, NULL));
    return groom;
}

START_TEST(a_chain_with_layers_is_the_same_for_any_pool)
{
    struct groom *groom = long_chain();
    struct groom_strands *alone = evaluate(groom), *three;
    struct groom_context context = {0};
    ck_ok(groom_pool_create(3, &context.pool));
    ck_ok(groom_layers_evaluate(groom, &context, &three, NULL));
    ck_assert_uint_eq(n_different(alone, three), 0);
    for (uint32_t v = 0; v < alone->n_vertices; v++)
        ck_assert(isfinite(alone->points[v][0]) && isfinite(alone->points[v][1]) && isfinite(alone->points[v][2]));
    groom_pool_destroy(context.pool);
    groom_strands_destroy(alone);
    groom_strands_destroy(three);
    groom_destroy(groom);
}
END_TEST

/* What stands behind the last layer can be had for some strands alone, from what comes out of it. */
START_TEST(behind_layers_a_range_has_the_bits_of_the_whole)
{
    struct groom *groom = long_chain();
    struct groom_strands *whole = evaluate(groom), *before, *after, *again;
    float some[7 * 40][3];
    uint32_t first = groom_next_layer(groom, 0), second = groom_next_layer(groom, first + 1);
    ck_assert(first == 2 && second == 4 && groom_next_layer(groom, 5) == 6);
    ck_ok(groom_evaluate_between(groom, 0, first, NULL, NULL, &before, NULL));
    ck_ok(groom_layer_apply(groom, first, before, NULL, NULL, &after, NULL, NULL));
    ck_ok(groom_evaluate_between(groom, first + 1, second, after, NULL, &again, NULL));
    groom_strands_destroy(after);
    ck_ok(groom_layer_apply(groom, second, again, NULL, NULL, &after, NULL, NULL));
    struct groom rest = groom_with_base(groom, after, second + 1, groom->n_operators);
    ck_ok(groom_evaluate(&rest, 100, 7, some, NULL, NULL));
    ck_assert_mem_eq(some, whole->points + 100 * 40, sizeof some);
    struct groom *selected;
    ck_ok(groom_select(&rest, (uint32_t[]){99, 103, 4}, 3, NULL, &selected, NULL));
    ck_ok(groom_evaluate(selected, 1, 1, some, NULL, NULL));
    ck_assert_mem_eq(some, whole->points + 103 * 40, 40 * sizeof *some);
    groom_destroy(selected);
    groom_strands_destroy(whole);
    groom_strands_destroy(before);
    groom_strands_destroy(after);
    groom_strands_destroy(again);
    groom_destroy(groom);
}
END_TEST

START_TEST(running_out_of_memory_leaks_nothing)
{
    struct groom *groom = coils(12, 9);
    append(groom, GROOM_OPERATOR_RUFFLE, 3)->layer->n_elements = 12;
    pull_two(groom, append(groom, GROOM_OPERATOR_SCULPT, 1));
    shift_cluster(groom, &groom->operators[1], 3, 0);
    for (size_t at = 0;; at += at < 40 ? 1 : 7) {
        struct test_failing_allocator failing;
        struct groom_allocator allocator;
        struct groom_strands *strands = NULL;
        test_failing_allocator_init(&failing, at, &allocator);
        const struct groom_context context = {.allocator = &allocator};
        groom_status status = groom_layers_evaluate(groom, &context, &strands, NULL);
        ck_assert(status == GROOM_OK || status == GROOM_ENOMEM);
        groom_strands_destroy(strands);
        ck_assert_uint_eq(failing.outstanding_bytes, 0);
        if (failing.n_allocations <= at)
            break;
    }
    groom_destroy(groom);
}
END_TEST

/* --- contact ------------------------------------------------------------------------------------------ */

/* An octahedron about the origin: a pointed head of 0.1 m. */
static struct groom_mesh *octahedron(void)
{
    static const float points[6][3] = {{0.1f, 0, 0}, {-0.1f, 0, 0}, {0, 0.1f, 0}, {0, -0.1f, 0}, {0, 0, 0.1f}, {0, 0, -0.1f}};
    static const uint32_t triangles[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    struct groom_mesh *mesh;
    ck_ok(groom_mesh_create(6, 8, 0, NULL, &mesh, NULL));
    memcpy(mesh->points, points, sizeof points);
    memcpy(mesh->triangles, triangles, sizeof triangles);
    return mesh;
}

/* Straight strands up from the side of the head, and tips that are pulled across to its other side. */
static struct groom *standing(uint32_t n)
{
    struct groom_strands *strands;
    struct groom *groom;
    ck_ok(groom_strands_create(n, n * 31, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++) {
        strands->first[i + 1] = 31 * (i + 1);
        for (uint32_t j = 0; j < 31; j++) {
            float *p = strands->points[31 * i + j];
            p[0] = 0.06f + 0.006f * (float)j, p[1] = 0.04f, p[2] = 0.004f * (float)(i % 4);
        }
    }
    ck_ok(groom_create_of_strands(strands, NULL, &groom, NULL));
    groom_strands_destroy(strands);
    struct groom_layer_anchors *anchors = &append(groom, GROOM_OPERATOR_SCULPT, 1)->layer->anchors;
    ck_ok(groom_layer_anchors_resize(anchors, n, groom->allocator));
    for (uint32_t i = 0; i < n; i++) {
        anchors->strand[i] = i;
        anchors->at[i] = 1.0f;
        anchors->position[i][0] = -0.08f;
        anchors->position[i][1] = 0.03f;
        anchors->position[i][2] = 0.004f * (float)(i % 4);
    }
    return groom;
}

START_TEST(contact_is_kept_in_the_layer)
{
    enum { N = 140 }; /* more than a block */
    struct groom *groom = standing(N);
    struct groom_mesh *mesh = octahedron();
    struct groom_bvh *bvh;
    struct groom_strands *rest, *outside, *again;
    struct groom_layer_report report, later;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    ck_ok(groom_evaluate_between(groom, 0, 0, NULL, NULL, &rest, NULL));
    ck_ok(groom_layer_apply_outside(groom, 0, rest, NULL, bvh, NULL, &outside, &report, NULL));
    ck_assert_uint_eq(report.contact.n_checked, N);
    ck_assert_uint_gt(report.contact.n_entered, 0);
    const struct groom_layer_anchors *contact = &groom->operators[0].layer->contact;
    ck_assert_uint_gt(contact->n, 0);
    for (uint32_t k = 1; k < contact->n; k++)
        ck_assert_uint_le(contact->strand[k - 1], contact->strand[k]);
    ck_assert_uint_gt(contact->strand[contact->n - 1], 130);
    ck_assert(report.contact.depth_after_m < 0.25f * report.contact.depth_before_m);
    ck_assert_uint_eq(report.sculpt.n_anchors, N);
    ck_ok(groom_validate(groom, NULL));
    ck_ok(groom_layer_apply(groom, 0, rest, NULL, NULL, &again, &later, NULL)); /* no head here */
    ck_assert_uint_eq(n_different(outside, again), 0);
    groom_strands_destroy(rest);
    groom_strands_destroy(outside);
    groom_strands_destroy(again);
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
    groom_destroy(groom);
}
END_TEST

TEST_SUITE("layers", sculpt_moves_what_is_pulled_and_nothing_else, an_input_kept_from_before_gives_the_same_bits,
           many_strands_change_the_same_fresh_kept_and_in_place, a_frame_that_takes_strands_too_far_is_named,
           a_large_layer_tells_how_far_it_is_and_can_be_stopped,
           a_moved_frame_takes_its_cluster_along, an_empty_cluster_is_refused_with_its_frame,
           another_seed_ruffles_to_another_head, ruffling_stays_within_groups, curls_of_one_group_are_widened,
           interpolation_ends_at_both_grooms, a_chain_with_layers_is_the_same_for_any_pool,
           behind_layers_a_range_has_the_bits_of_the_whole, running_out_of_memory_leaks_nothing,
           contact_is_kept_in_the_layer)
