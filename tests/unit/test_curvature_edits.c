/* Ruffling, blending and scaling of curls. */
#include <cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "curvature/ruffle.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

static double distance(const double a[3], const double b[3])
{
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

/* The farthest that strand i of both lie apart, at 50 stations. */
static double farthest(const struct groom_superhelices *a, const struct groom_superhelices *b, uint32_t i)
{
    double worst = 0.0, la = groom_superhelix_length(a, i), lb = groom_superhelix_length(b, i);
    for (int k = 0; k < 50; k++) {
        double sa = la * k / 49, sb = lb * k / 49, p[3], q[3];
        groom_superhelix_sample(a, i, &sa, 1, &p, NULL);
        groom_superhelix_sample(b, i, &sb, 1, &q, NULL);
        worst = fmax(worst, distance(p, q));
    }
    return worst;
}

static void assert_same(const struct groom_superhelices *a, const struct groom_superhelices *b)
{
    ck_assert_uint_eq(a->n_elements, b->n_elements);
    ck_assert_mem_eq(a->first, b->first, (a->n_strands + 1) * sizeof *a->first);
    ck_assert_mem_eq(a->root, b->root, a->n_strands * sizeof *a->root);
    ck_assert_mem_eq(a->frame, b->frame, a->n_strands * sizeof *a->frame);
    ck_assert_mem_eq(a->q, b->q, a->n_elements * sizeof *a->q);
    ck_assert_mem_eq(a->length, b->length, a->n_elements * sizeof *a->length);
}

/* --- gauges ------------------------------------------------------------------------------- */

START_TEST(a_turned_gauge_is_the_same_curve_and_is_found)
{
    struct groom_superhelices *a = superhelix_coils(1, 30, 5, 0), *b;
    ck_ok(groom_superhelices_copy(a, NULL, &b, NULL));
    groom_superhelix_turn_gauge(b, 0, 0.7);
    ck_ok(groom_superhelices_check(b, NULL));
    ck_assert_double_le(farthest(a, b, 0), 1e-14);
    ck_assert_double_eq_tol(groom_superhelix_gauge(a, 0, b, 0), -0.7, 1e-12);
    groom_superhelices_destroy(a);
    groom_superhelices_destroy(b);
}
END_TEST

/* --- ruffling ------------------------------------------------------------------------------- */

static struct groom_superhelices *ruffle(const struct groom_superhelices *h, const struct groom_ruffle_options *o)
{
    struct groom_superhelices *out;
    ck_ok(groom_superhelices_ruffle(h, o, NULL, &out, NULL));
    ck_ok(groom_superhelices_check(out, NULL));
    return out;
}

/* The generator of the vectors: splitmix64 over seed, strand, element, use. */
static double vector_draw(void *user, uint32_t strand, uint32_t element, enum ruffle_use use)
{
    const uint64_t words[4] = {*(const uint64_t *)user, strand, element, use == RUFFLE_DONOR};
    uint64_t h = 0;
    for (int k = 0; k < 4; k++) {
        h = (h ^ words[k]) + 0x9E3779B97F4A7C15u;
        h = (h ^ h >> 30) * 0xBF58476D1CE4E5B9u;
        h = (h ^ h >> 27) * 0x94D049BB133111EBu;
        h ^= h >> 31;
    }
    return (double)(h >> 11) * 0x1p-53;
}

/* Strands whose elements tell by their length whose they are. */
static struct groom_superhelices *marked(uint32_t n_strands, uint32_t n_elements)
{
    struct groom_superhelices *h = superhelix_coils(n_strands, n_elements, 3, 0);
    for (uint32_t i = 0; i < n_strands; i++)
        for (uint32_t j = 0; j < n_elements; j++)
            h->length[i * n_elements + j] = 0.001 * (i + 1);
    return h;
}

START_TEST(ruffling_with_the_vectors_numbers_takes_the_vectors_elements)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    const struct cJSON *object = vectors_get(json, "ruffle"), *rows = vectors_get(object, "source_strand");
    uint32_t n = (uint32_t)vectors_number(object, "S"), m = (uint32_t)vectors_number(object, "N");
    uint64_t seed = (uint64_t)vectors_number(object, "seed");
    double *number = calloc(n + m, sizeof *number);
    uint32_t *group = calloc(n, sizeof *group), n_groups = 0;
    vectors_read(vectors_get(object, "group"), number, n);
    for (uint32_t i = 0; i < n; i++) {
        group[i] = (uint32_t)number[i];
        n_groups = group[i] >= n_groups ? group[i] + 1 : n_groups;
    }
    struct groom_ruffle_options o = {.rho = vectors_number(object, "rho"), .blend = 1.0, .group = group, .n_groups = n_groups,
                                     .match_elements = (uint32_t)vectors_number(object, "Nm")};
    const struct ruffle_draws draws = {vector_draw, &seed};
    ck_assert_double_eq_tol(vector_draw(&seed, 0, o.match_elements, RUFFLE_CHANCE), vectors_number(object, "u00"), 1e-16);
    struct groom_superhelices *h = marked(n, m), *out;
    ck_ok(ruffle_with(h, &o, &draws, NULL, &out, NULL));
    for (uint32_t i = 0; i < n; i++) {
        vectors_read(cJSON_GetArrayItem(rows, (int)i), number, m);
        for (uint32_t j = 0; j < m; j++)
            ck_assert_msg(fabs(out->length[i * m + j] - 0.001 * (number[j] + 1)) < 1e-9, "strand %u, element %u", i, j);
    }
    groom_superhelices_destroy(h);
    groom_superhelices_destroy(out);
    free(number), free(group);
    cJSON_Delete(json);
}
END_TEST

START_TEST(rho_0_and_blend_0_change_nothing)
{
    struct groom_superhelices *h = superhelix_coils(20, 30, 5, 0), *a, *b;
    struct groom_ruffle_options none = {.rho = 0.0, .blend = 1.0, .seed = 1}, faint = {.rho = 1.0, .blend = 0.0, .seed = 1};
    a = ruffle(h, &none), b = ruffle(h, &faint);
    assert_same(h, a);
    assert_same(h, b);
    groom_superhelices_destroy(h), groom_superhelices_destroy(a), groom_superhelices_destroy(b);
}
END_TEST

/* Each strand's lengths tell whose element it is. */
static struct groom_superhelices *labelled(uint32_t n_strands, uint32_t n_elements)
{
    struct groom_superhelices *h = superhelix_coils(n_strands, n_elements, 5, 0);
    for (uint32_t j = 0; j < h->n_elements; j++)
        h->length[j] = 1.0 + j / n_elements + 1e-3 * (j % n_elements);
    return h;
}

START_TEST(elements_come_from_the_group_with_the_same_index_and_the_asked_chance)
{
    enum { S = 400, N = 40, MATCH = 10 };
    struct groom_superhelices *h = labelled(S, N), *out;
    uint32_t group[S], changed = 0;
    for (uint32_t i = 0; i < S; i++)
        group[i] = i % 4;
    struct groom_ruffle_options o = {.rho = 0.3, .match_elements = MATCH, .blend = 1.0, .seed = 9, .group = group, .n_groups = 4};
    out = ruffle(h, &o);
    for (uint32_t j = 0; j < h->n_elements; j++) {
        uint32_t donor = (uint32_t)out->length[j] - 1, index = (uint32_t)lround(1e3 * (out->length[j] - floor(out->length[j])));
        ck_assert_uint_eq(index, j % N);
        ck_assert_uint_eq(group[donor], group[j / N]);
        if (j % N < MATCH)
            ck_assert_uint_eq(donor, j / N);
        changed += donor != j / N;
        /* the curvature came along, in another gauge */
        double bend = hypot(h->q[donor * N + j % N][1], h->q[donor * N + j % N][2]);
        ck_assert_double_eq_tol(hypot(out->q[j][1], out->q[j][2]), bend, 1e-9 * bend);
        ck_assert_double_eq_tol(out->q[j][0], h->q[donor * N + j % N][0], 1e-9 * bend);
    }
    double share = (double)changed / (S * (N - MATCH)), expected = 0.3 * (1.0 - 4.0 / S);
    ck_assert_double_eq_tol(share, expected, 0.02);
    groom_superhelices_destroy(h), groom_superhelices_destroy(out);
}
END_TEST

START_TEST(short_strands_give_only_what_they_have)
{
    struct groom_superhelices *h = labelled(2, 20), *out;
    h->first[1] = 30; /* 30 and 10 elements */
    struct groom_ruffle_options o = {.rho = 1.0, .blend = 1.0, .seed = 3};
    out = ruffle(h, &o);
    for (uint32_t j = 10; j < 30; j++)
        ck_assert_double_eq(out->length[j], h->length[j]);
    groom_superhelices_destroy(h), groom_superhelices_destroy(out);
}
END_TEST

START_TEST(another_seed_gives_another_head_and_the_same_one_the_same)
{
    struct groom_superhelices *h = superhelix_coils(150, 30, 5, 0), *a, *b, *c;
    struct groom_ruffle_options o = {.rho = 0.2, .match_elements = 5, .blend = 1.0, .seed = 1};
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    a = ruffle(h, &o);
    ck_ok(groom_superhelices_ruffle(h, &o, &context, &b, NULL));
    assert_same(a, b);
    o.seed = 2;
    c = ruffle(h, &o);
    ck_assert_mem_ne(a->q, c->q, a->n_elements * sizeof *a->q);
    groom_pool_destroy(pool);
    groom_superhelices_destroy(h), groom_superhelices_destroy(a), groom_superhelices_destroy(b), groom_superhelices_destroy(c);
}
END_TEST

START_TEST(ruffling_refuses_what_is_not_a_chance_or_a_group)
{
    struct groom_superhelices *h = superhelix_coils(2, 5, 5, 0), *out = NULL;
    uint32_t group[2] = {0, 3};
    struct groom_ruffle_options bad[3] = {{.rho = 1.5, .blend = 1.0}, {.rho = 0.5, .blend = NAN},
                                          {.rho = 0.5, .blend = 1.0, .group = group, .n_groups = 2}};
    const char *pointers[3] = {"/rho", "/blend", "/groups"};
    for (int i = 0; i < 3; i++) {
        struct groom_diag diag;
        ck_status(groom_superhelices_ruffle(h, &bad[i], NULL, &out, &diag), GROOM_EINVAL);
        ck_assert_str_eq(diag.pointer, pointers[i]);
        ck_assert_ptr_null(out);
    }
    groom_superhelices_destroy(h);
}
END_TEST

/* --- blending --------------------------------------------------------------------------------- */

START_TEST(the_ends_of_a_blend_are_the_two_grooms)
{
    struct groom_superhelices *a = superhelix_coils(6, 30, 5, 0), *b = superhelix_coils(6, 41, 6, 1), *out;
    for (int t = 0; t <= 1; t++) {
        ck_ok(groom_superhelices_interpolate(a, b, NULL, t, NULL, &out, NULL));
        ck_ok(groom_superhelices_check(out, NULL));
        for (uint32_t i = 0; i < 6; i++) {
            ck_assert_double_le(farthest(t ? b : a, out, i), 1e-9);
            ck_assert_uint_eq(out->first[i + 1] - out->first[i], 30 + 41 - 1);
        }
        groom_superhelices_destroy(out);
    }
    groom_superhelices_destroy(a), groom_superhelices_destroy(b);
}
END_TEST

START_TEST(between_two_codings_of_one_curve_lies_that_curve)
{
    struct groom_superhelices *a = superhelix_coils(4, 30, 5, 0), *b, *out;
    ck_ok(groom_superhelices_copy(a, NULL, &b, NULL));
    for (uint32_t i = 0; i < 4; i++)
        groom_superhelix_turn_gauge(b, i, 0.9 * (i + 1));
    ck_ok(groom_superhelices_interpolate(a, b, NULL, 0.5, NULL, &out, NULL));
    ck_assert_uint_eq(out->n_elements, a->n_elements);
    for (uint32_t i = 0; i < 4; i++)
        ck_assert_double_le(farthest(a, out, i), 1e-12);
    groom_superhelices_destroy(a), groom_superhelices_destroy(b), groom_superhelices_destroy(out);
}
END_TEST

START_TEST(a_blend_follows_partners_and_half_turns)
{
    struct groom_superhelices *a = superhelix_coils(3, 10, 5, 0), *b, *out;
    const uint32_t partner[3] = {0, 0, 1}, nobody[3] = {0, 1, 3};
    ck_ok(groom_superhelices_copy(a, NULL, &b, NULL));
    for (int c = 0; c < 3; c++) /* half a turn about the tangent of strand 0 */
        b->frame[0][1][c] = -b->frame[0][1][c], b->frame[0][2][c] = -b->frame[0][2][c];
    ck_ok(groom_superhelices_interpolate(a, b, partner, 0.5, NULL, &out, NULL));
    ck_ok(groom_superhelices_check(out, NULL));
    ck_assert_double_eq_tol(out->root[2][0], 0.5 * (a->root[2][0] + b->root[1][0]), 1e-15);
    groom_superhelices_destroy(out);
    ck_status(groom_superhelices_interpolate(a, b, nobody, 0.5, NULL, &out, NULL), GROOM_EINVAL);
    ck_status(groom_superhelices_interpolate(a, b, partner, -0.5, NULL, &out, NULL), GROOM_EINVAL);
    groom_superhelices_destroy(a), groom_superhelices_destroy(b);
}
END_TEST

START_TEST(roots_find_their_nearest)
{
    struct groom_superhelices *a = superhelix_coils(40, 3, 5, 0), *b = superhelix_coils(60, 3, 5, 0);
    uint32_t partner[40];
    ck_ok(groom_superhelices_match_roots(a, b, NULL, partner, NULL)); /* the first 40 are the same */
    for (uint32_t i = 0; i < 40; i++)
        ck_assert_uint_eq(partner[i], i);
    groom_superhelices_destroy(a), groom_superhelices_destroy(b);
}
END_TEST

/* --- scaling of curls ------------------------------------------------------------------------------ */

/* The vectors turn a strand by 0.7: that much must be turned back. */
START_TEST(the_gauge_meets_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    double want = vectors_number(vectors_get(json, "gauge"), "angle_for_0p7");
    struct groom_superhelices *a = superhelix_coils(5, 30, 5, 1), *b;
    ck_ok(groom_superhelices_copy(a, NULL, &b, NULL));
    for (uint32_t i = 0; i < 5; i++) {
        groom_superhelix_turn_gauge(b, i, 0.7);
        ck_assert_double_eq_tol(groom_superhelix_gauge(a, i, b, i), want, 1e-12);
    }
    groom_superhelices_destroy(a), groom_superhelices_destroy(b);
    cJSON_Delete(json);
}
END_TEST

START_TEST(scaled_curls_meet_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    const struct cJSON *object = vectors_get(json, "scale_curl");
    for (int turns = 0; turns < 2; turns++) {
        struct groom_superhelices *h = superhelix_straight(12, 1.0);
        struct groom_curl_scale_options o = groom_curl_scale_options_default();
        double q[12][3], l[12];
        vectors_read(vectors_get(object, "q"), h->q[0], 36);
        vectors_read(vectors_get(object, "l"), h->length, 12);
        vectors_read(vectors_get(object, turns ? "q_out_turns" : "q_out"), q[0], 36);
        vectors_read(vectors_get(object, turns ? "l_out_turns" : "l"), l, 12);
        o.radius = vectors_number(object, "sR"), o.step = vectors_number(object, "sStep");
        o.keep = turns ? GROOM_CURL_KEEP_TURNS : GROOM_CURL_KEEP_LENGTH;
        ck_ok(groom_superhelices_scale_curls(h, &o, NULL, NULL));
        for (int j = 0; j < 12; j++) {
            ck_assert_double_eq_tol(h->length[j], l[j], 1e-12);
            for (int c = 0; c < 3; c++)
                ck_assert_double_eq_tol(h->q[j][c], q[j][c], 1e-12);
        }
        groom_superhelices_destroy(h);
    }
    cJSON_Delete(json);
}
END_TEST

static void tip_direction(const struct groom_superhelices *h, uint32_t i, double out[3])
{
    double s = groom_superhelix_length(h, i), p[3], norm;
    groom_superhelix_sample(h, i, &s, 1, &p, NULL);
    norm = distance(p, h->root[i]);
    for (int c = 0; c < 3; c++)
        out[c] = (p[c] - h->root[i][c]) / norm;
}

START_TEST(a_held_direction_stays_and_roots_too)
{
    struct groom_superhelices *h = superhelix_coils(10, 45, 5, 0), *was;
    struct groom_curl_scale_options o = groom_curl_scale_options_default();
    ck_ok(groom_superhelices_copy(h, NULL, &was, NULL));
    o.radius = 1.6, o.step = 0.8;
    ck_ok(groom_superhelices_scale_curls(h, &o, NULL, NULL));
    ck_ok(groom_superhelices_check(h, NULL));
    for (uint32_t i = 0; i < 10; i++) {
        double a[3], b[3];
        tip_direction(h, i, a), tip_direction(was, i, b);
        ck_assert_double_le(distance(a, b), 1e-12);
        ck_assert_double_eq(groom_superhelix_length(h, i), groom_superhelix_length(was, i));
    }
    groom_superhelices_destroy(h), groom_superhelices_destroy(was);
}
END_TEST

START_TEST(a_ramp_spares_its_zero_end_and_weights_spare_strands)
{
    struct groom_superhelices *h = superhelix_coils(2, 60, 5, 0), *was;
    struct groom_curl_scale_options o = groom_curl_scale_options_default();
    const float weight[2] = {0.0f, 1.0f};
    ck_ok(groom_superhelices_copy(h, NULL, &was, NULL));
    o.radius = 2.0, o.ramp[0] = 0.0, o.weight = weight, o.hold_direction = 0;
    ck_ok(groom_superhelices_scale_curls(h, &o, NULL, NULL));
    for (uint32_t j = 0; j < 60; j++)
        for (int c = 0; c < 3; c++)
            ck_assert_double_eq_tol(h->q[j][c], was->q[j][c], 1e-12 * fabs(was->q[j][c]));
    double near = hypot(h->q[60][1], h->q[60][2]) / hypot(was->q[60][1], was->q[60][2]);
    double far = hypot(h->q[119][1], h->q[119][2]) / hypot(was->q[119][1], was->q[119][2]);
    ck_assert_double_eq_tol(near, 1.0, 0.02);
    ck_assert_double_lt(far, 0.7);
    groom_superhelices_destroy(h), groom_superhelices_destroy(was);
}
END_TEST

START_TEST(wide_bends_and_straight_hair_stay)
{
    struct groom_superhelices *h = superhelix_straight(3, 0.2);
    struct groom_curl_scale_options o = groom_curl_scale_options_default();
    h->q[1][1] = 2.0, h->q[2][1] = 200.0; /* radii 0.5 m and 5 mm */
    o.radius = 2.0, o.largest_radius_m = 0.05;
    ck_ok(groom_superhelices_scale_curls(h, &o, NULL, NULL));
    ck_assert_double_eq(h->q[0][1], 0.0);
    ck_assert_double_eq(h->q[1][1], 2.0);
    ck_assert_double_eq_tol(h->q[2][1], 100.0, 1e-9);
    o.radius = NAN;
    struct groom_diag diag;
    ck_status(groom_superhelices_scale_curls(h, &o, NULL, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/radius");
    groom_superhelices_destroy(h);
}
END_TEST

/* --- memory and threads ------------------------------------------------------------------------------ */

static groom_status all_edits(const struct groom_superhelices *a, const struct groom_superhelices *b,
                              const struct groom_context *context)
{
    struct groom_ruffle_options o = {.rho = 0.5, .blend = 1.0, .seed = 1};
    struct groom_superhelices *ruffled = NULL, *between = NULL;
    uint32_t partner[8];
    groom_status st = groom_superhelices_ruffle(a, &o, context, &ruffled, NULL);
    if (st == GROOM_OK)
        st = groom_superhelices_match_roots(a, b, context, partner, NULL);
    if (st == GROOM_OK)
        st = groom_superhelices_interpolate(ruffled, b, partner, 0.3, context, &between, NULL);
    groom_superhelices_destroy(ruffled);
    groom_superhelices_destroy(between);
    return st;
}

START_TEST(each_allocation_may_fail)
{
    struct groom_superhelices *a = superhelix_coils(8, 10, 5, 0), *b = superhelix_coils(5, 14, 6, 0);
    for (size_t n = 0;; n++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, n, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = all_edits(a, b, &context);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_uint_lt(n, 200);
    }
    groom_superhelices_destroy(a), groom_superhelices_destroy(b);
}
END_TEST

START_TEST(blends_and_scales_have_the_same_bits_for_any_pool)
{
    struct groom_superhelices *a = superhelix_coils(200, 20, 5, 0), *b = superhelix_coils(200, 33, 6, 1), *x, *y;
    struct groom_curl_scale_options o = groom_curl_scale_options_default();
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_superhelices_interpolate(a, b, NULL, 0.4, NULL, &x, NULL));
    ck_ok(groom_superhelices_interpolate(a, b, NULL, 0.4, &context, &y, NULL));
    assert_same(x, y);
    o.radius = 1.3;
    ck_ok(groom_superhelices_scale_curls(x, &o, NULL, NULL));
    ck_ok(groom_superhelices_scale_curls(y, &o, &context, NULL));
    assert_same(x, y);
    groom_pool_destroy(pool);
    groom_superhelices_destroy(a), groom_superhelices_destroy(b), groom_superhelices_destroy(x), groom_superhelices_destroy(y);
}
END_TEST

TEST_SUITE("curvature_edits", ruffling_with_the_vectors_numbers_takes_the_vectors_elements, a_turned_gauge_is_the_same_curve_and_is_found, rho_0_and_blend_0_change_nothing,
           elements_come_from_the_group_with_the_same_index_and_the_asked_chance,
           short_strands_give_only_what_they_have, another_seed_gives_another_head_and_the_same_one_the_same,
           ruffling_refuses_what_is_not_a_chance_or_a_group, the_ends_of_a_blend_are_the_two_grooms,
           between_two_codings_of_one_curve_lies_that_curve, a_blend_follows_partners_and_half_turns,
           roots_find_their_nearest, the_gauge_meets_the_vectors, scaled_curls_meet_the_vectors, a_held_direction_stays_and_roots_too,
           a_ramp_spares_its_zero_end_and_weights_spare_strands, wide_bends_and_straight_hair_stay,
           each_allocation_may_fail, blends_and_scales_have_the_same_bits_for_any_pool)
