/* Polylines to super-helices: shared vectors, the hard strands, noise, memory, threads. */
#include <cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "curvature/helix.h"
#include "curvature/spline.h"
#include "groom/random.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

/* --- the parts, against the vectors --------------------------------------------------- */

START_TEST(helices_through_pairs_meet_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    const struct cJSON *row;
    cJSON_ArrayForEach(row, vectors_get(json, "helix_through"))
    {
        vec3 p0, t0, p1, t1, want;
        vectors_read(vectors_get(row, "p0"), &p0.x, 3);
        vectors_read(vectors_get(row, "t0"), &t0.x, 3);
        vectors_read(vectors_get(row, "p1"), &p1.x, 3);
        vectors_read(vectors_get(row, "t1"), &t1.x, 3);
        vectors_read(vectors_get(row, "Omega"), &want.x, 3);
        struct helix got = helix_through(p0, t0, p1, t1);
        ck_assert_double_eq_tol(got.length, vectors_number(row, "length"), 1e-11);
        vec3 miss = vec_sub(got.omega, want);
        ck_assert_double_le(sqrt(vec_dot(miss, miss)), 1e-10);
    }
    cJSON_Delete(json);
}
END_TEST

START_TEST(floating_points_meet_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    const struct cJSON *object = vectors_get(json, "float_points");
    vec3 p[13], t[13], want[13];
    double work[24];
    vectors_read(vectors_get(object, "X"), &p[0].x, 39);
    vectors_read(vectors_get(object, "T"), &t[0].x, 39);
    vectors_read(vectors_get(object, "out"), &want[0].x, 39);
    helix_float_points(12, p, t, work);
    for (int i = 0; i < 13; i++) {
        vec3 miss = vec_sub(p[i], want[i]);
        ck_assert_double_le(sqrt(vec_dot(miss, miss)), 1e-10);
    }
    cJSON_Delete(json);
}
END_TEST

/* --- strands --------------------------------------------------------------------------- */

/* One strand from a function of 0..1. */
static struct groom_strands *strand_of(uint32_t n, void (*curve)(double u, double out[3]))
{
    struct groom_strands *strands;
    ck_ok(groom_strands_create(1, n, NULL, &strands, NULL));
    strands->first[1] = n;
    for (uint32_t k = 0; k < n; k++) {
        double p[3];
        curve((double)k / (n - 1), p);
        for (int c = 0; c < 3; c++)
            strands->points[k][c] = (float)p[c];
    }
    return strands;
}

static struct groom_conversion *convert(const struct groom_strands *strands, uint32_t n_elements)
{
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_conversion *conversion;
    options.n_elements = n_elements;
    ck_ok(groom_strands_convert(strands, &options, NULL, &conversion, NULL));
    ck_ok(groom_superhelices_check(conversion->helices, NULL));
    return conversion;
}

/* The farthest that a vertex comes back from where it was. */
static double round_trip(const struct groom_strands *strands, const struct groom_conversion *c)
{
    float(*back)[3] = calloc(strands->n_vertices, sizeof *back);
    double worst = 0.0;
    ck_ok(groom_superhelices_sample_at(c->helices, c->first, c->at, back, NULL, NULL));
    for (uint32_t k = 0; k < strands->n_vertices; k++) {
        double square = 0.0;
        for (int i = 0; i < 3; i++)
            square += pow((double)back[k][i] - (double)strands->points[k][i], 2);
        worst = fmax(worst, sqrt(square));
    }
    free(back);
    return worst;
}

static double mean_segment(const struct groom_strands *strands)
{
    return groom_polyline_length((const float(*)[3])strands->points, strands->n_vertices) /
           (strands->n_vertices - 1);
}

static void coil(double u, double p[3])
{
    double turn = 2.0 * M_PI * 6.0 * u, radius = 0.006 * (1.0 - 0.3 * u);
    p[0] = radius * cos(turn) + 0.03 * u * u;
    p[1] = -0.15 * u;
    p[2] = radius * sin(turn) + 0.01 * sin(3.0 * u);
}

static void straight(double u, double p[3]) { p[0] = 0.1 * u, p[1] = 0.2 * u, p[2] = -0.05 * u; }
static void wave(double u, double p[3]) { p[0] = 0.01 * sin(40.0 * u), p[1] = -0.2 * u, p[2] = 0.0; }
static void tiny(double u, double p[3])
{
    coil(u, p);
    for (int i = 0; i < 3; i++)
        p[i] = 0.3 + 1e-3 * p[i];
}
static void kink(double u, double p[3])
{
    p[0] = u < 0.5 ? 0.0 : 0.1 * (u - 0.5), p[1] = u < 0.5 ? -0.1 * u : -0.05 + 0.08 * (u - 0.5), p[2] = 0.01 * u;
}
static void switchback(double u, double p[3])
{
    double turn = 2.0 * M_PI * 8.0 * fabs(u - 0.5);
    p[0] = 0.006 * cos(turn), p[1] = -0.12 * u, p[2] = 0.006 * sin(turn);
}

START_TEST(a_fit_with_the_given_count_meets_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    /* float32 vertices, where the vectors' spline went through float64 ones: 1e-7 of 8 units */
    const struct cJSON *object = vectors_get(json, "fit");
    uint32_t n = (uint32_t)vectors_size(vectors_get(object, "polyline")) / 3;
    double(*points)[3] = calloc(n, sizeof *points), q[12][3], l[12];
    struct groom_strands *strands;
    vectors_read(vectors_get(object, "polyline"), points[0], (size_t)n * 3);
    vectors_read(vectors_get(object, "q"), q[0], 36);
    vectors_read(vectors_get(object, "l"), l, 12);
    ck_ok(groom_strands_create(1, n, NULL, &strands, NULL));
    strands->first[1] = n;
    for (uint32_t k = 0; k < n * 3; k++)
        strands->points[k / 3][k % 3] = (float)points[k / 3][k % 3];
    struct groom_conversion_options options = {.n_elements = 12};
    struct groom_conversion *c;
    ck_ok(groom_strands_convert(strands, &options, NULL, &c, NULL));
    for (int j = 0; j < 12; j++) {
        ck_assert_double_eq_tol(c->helices->length[j], l[j], 1e-5);
        for (int i = 0; i < 3; i++)
            ck_assert_double_eq_tol(c->helices->q[j][i], q[j][i], 1e-4);
    }
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
    free(points);
    cJSON_Delete(json);
}
END_TEST

START_TEST(a_coil_comes_back)
{
    struct groom_strands *strands = strand_of(100, coil);
    struct groom_conversion *c = convert(strands, 0);
    double segment = mean_segment(strands);
    ck_assert_double_le(round_trip(strands, c), 0.0101 * segment);
    ck_assert_float_eq_tol(c->reports[0].length_change, 0.0f, 0.002f);
    ck_assert_double_le(c->reports[0].error_max_m, 0.01 * segment);
    ck_assert_uint_ge(c->reports[0].n_elements, 21);
    ck_assert_uint_le(c->reports[0].n_elements, 70);
    ck_assert_uint_eq(c->reports[0].n_flips, 0);
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(the_root_stays_and_the_root_frame_begins_along_the_strand)
{
    struct groom_strands *strands = strand_of(100, coil);
    struct groom_conversion *c = convert(strands, 45);
    for (int i = 0; i < 3; i++) {
        ck_assert_double_eq(c->helices->root[0][i], (double)strands->points[0][i]);
        double along = ((double)strands->points[1][i] - (double)strands->points[0][i]) / mean_segment(strands);
        ck_assert_double_eq_tol(c->helices->frame[0][0][i], along, 0.3);
    }
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(a_straight_strand_has_no_curvature)
{
    struct groom_strands *strands = strand_of(20, straight);
    struct groom_conversion *c = convert(strands, 0);
    for (uint32_t j = 0; j < c->helices->n_elements; j++)
        for (int i = 0; i < 3; i++)
            ck_assert_double_eq_tol(c->helices->q[j][i], 0.0, 1e-3);
    ck_assert_double_le(round_trip(strands, c), 1e-7);
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(a_planar_wave_comes_back_without_loops)
{
    struct groom_strands *strands = strand_of(80, wave);
    struct groom_conversion *c = convert(strands, 0);
    double length = mean_segment(strands) * 79;
    ck_assert_double_le(round_trip(strands, c), 0.0101 * mean_segment(strands));
    ck_assert_double_le(groom_superhelix_length(c->helices, 0), 1.01 * length);
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(a_tiny_strand_comes_back_to_the_digits_it_has)
{
    struct groom_strands *strands = strand_of(60, tiny); /* 0.2 mm long, 0.3 m from the origin */
    struct groom_conversion *c = convert(strands, 0);
    ck_assert_double_le(round_trip(strands, c), 0.05 * mean_segment(strands));
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(a_kink_is_met_at_its_vertices)
{
    struct groom_strands *strands = strand_of(30, kink);
    struct groom_conversion *c = convert(strands, 0);
    ck_assert_double_le(round_trip(strands, c), 0.05 * mean_segment(strands));
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(an_element_begins_where_handedness_flips)
{
    struct groom_strands *strands = strand_of(120, switchback);
    struct groom_conversion *c = convert(strands, 40);
    ck_assert_uint_eq(c->reports[0].n_flips, 1);
    double arc = 0.0, nearest = 1.0, length = groom_superhelix_length(c->helices, 0);
    for (uint32_t j = 0; j < 40; j++) {
        nearest = fmin(nearest, fabs(arc / length - 0.5));
        arc += c->helices->length[j];
    }
    ck_assert_double_le(nearest, 0.01);
    ck_assert(signbit(c->helices->q[8][0]) != signbit(c->helices->q[31][0]));
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

/* A coil that goes on about an axis beside the first, with the other hand: where it bends straight over, the helix
 * through one pair would go round once too often. */
START_TEST(an_inflection_takes_no_turn_too_many)
{
    enum { M = 161, TURNS = 8 };
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_strands *strands;
    struct groom_conversion *c;
    double turns = 0.0;
    ck_ok(groom_strands_create(1, M, NULL, &strands, NULL));
    strands->first[1] = M;
    for (uint32_t k = 0; k < M; k++) {
        double along = k / (M - 1.0), angle = 2.0 * M_PI * TURNS * along, r = 0.006;
        strands->points[k][0] = (float)(along > 0.5 ? 2.0 * r - r * cos(angle) : r * cos(angle));
        strands->points[k][1] = (float)(0.008 * TURNS * along);
        strands->points[k][2] = (float)(r * sin(angle));
    }
    ck_ok(groom_strands_convert(strands, &options, NULL, &c, NULL));
    for (uint32_t j = 0; j < c->helices->n_elements; j++) {
        const double *q = c->helices->q[j];
        turns += sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) * c->helices->length[j] / (2.0 * M_PI);
    }
    ck_assert_double_eq_tol(turns, TURNS, 0.3);
    ck_assert_float_lt(c->reports[0].error_max_m, 2e-5f);
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(short_and_repeated_and_pointlike_strands_are_converted)
{
    for (uint32_t n = 1; n <= 6; n++)
        for (int kind = 0; kind < 3; kind++) {
            struct groom_strands *strands;
            ck_ok(groom_strands_create(1, n, NULL, &strands, NULL));
            strands->first[1] = n;
            for (uint32_t k = 0; k < n; k++) /* points of one place, pairs of twins, a zigzag */
                for (int i = 0; i < 3; i++)
                    strands->points[k][i] = kind == 0 ? 0.5f : kind == 1 ? 0.01f * (float)(k / 2 * (uint32_t)(i + 1))
                                                                         : 0.01f * (float)(i ? k : k % 2);
            struct groom_conversion *c = convert(strands, 0);
            ck_assert_uint_eq(c->reports[0].degenerate, kind == 0 || n == 1 || (kind == 1 && n == 2));
            ck_assert_double_le(round_trip(strands, c), 1e-3);
            groom_conversion_destroy(c);
            groom_strands_destroy(strands);
        }
}
END_TEST

/* With 0.05 mm of jitter on vertices 2 mm apart, a spline's curvature is ten times too large. */
START_TEST(noise_is_averaged_not_amplified)
{
    struct groom_strands *clean = strand_of(100, coil), *noisy = strand_of(100, coil);
    for (uint32_t k = 1; k < 100; k++)
        for (uint32_t i = 0; i < 3; i++)
            noisy->points[k][i] += (float)(5e-5 * groom_random_normal((struct groom_random_key){9, 1}, k, i));
    struct groom_conversion *a = convert(clean, 24), *b = convert(noisy, 24);
    double bend[2] = {0.0, 0.0};
    for (uint32_t j = 0; j < 24; j++) {
        bend[0] += hypot(a->helices->q[j][1], a->helices->q[j][2]) / 24;
        bend[1] += hypot(b->helices->q[j][1], b->helices->q[j][2]) / 24;
    }
    ck_assert_double_eq_tol(bend[1] / bend[0], 1.0, 0.1);
    ck_assert_double_le(b->reports[0].error_rms_m, 1.2e-4);
    groom_conversion_destroy(a), groom_conversion_destroy(b);
    groom_strands_destroy(clean), groom_strands_destroy(noisy);
}
END_TEST

START_TEST(a_tolerance_decides_the_count)
{
    struct groom_strands *strands = strand_of(100, coil);
    struct groom_conversion_options options = groom_conversion_options_default();
    uint32_t last = 0;
    for (options.tolerance_m = 1e-3; options.tolerance_m > 5e-6; options.tolerance_m *= 0.1) {
        struct groom_conversion *c;
        ck_ok(groom_strands_convert(strands, &options, NULL, &c, NULL));
        ck_assert_double_le(c->reports[0].error_max_m, options.tolerance_m);
        ck_assert_uint_gt(c->reports[0].n_elements, last);
        last = c->reports[0].n_elements;
        groom_conversion_destroy(c);
    }
    groom_strands_destroy(strands);
}
END_TEST

/* --- what goes wrong ---------------------------------------------------------------------- */

static struct groom_strands *many_strands(uint32_t n)
{
    struct groom_superhelices *h = superhelix_coils(n, 30, 11, 1);
    struct groom_strands *strands;
    ck_ok(groom_strands_create(n, (uint64_t)n * 60, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++)
        strands->first[i + 1] = 60 * (i + 1);
    ck_ok(groom_superhelices_sample(h, 60, strands->points, NULL, NULL));
    groom_superhelices_destroy(h);
    return strands;
}

START_TEST(what_is_not_finite_is_refused_by_name)
{
    struct groom_strands *strands = many_strands(3);
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_conversion *c = NULL;
    struct groom_diag diag;
    strands->points[67][1] = NAN;
    ck_status(groom_strands_convert(strands, &options, NULL, &c, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.detail, "vertex 7 of strand 1 is not finite");
    strands->points[67][1] = 0.0f;
    options.tolerance_m = NAN;
    ck_status(groom_strands_convert(strands, &options, NULL, &c, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/tolerance");
    ck_assert_ptr_null(c);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(the_same_bits_for_any_pool)
{
    struct groom_strands *strands = many_strands(200);
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_pool *pool;
    struct groom_conversion *a, *b;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_strands_convert(strands, &options, NULL, &a, NULL));
    ck_ok(groom_strands_convert(strands, &options, &context, &b, NULL));
    ck_assert_uint_eq(a->helices->n_elements, b->helices->n_elements);
    ck_assert_mem_eq(a->helices->q, b->helices->q, a->helices->n_elements * sizeof *a->helices->q);
    ck_assert_mem_eq(a->helices->length, b->helices->length, a->helices->n_elements * sizeof(double));
    ck_assert_mem_eq(a->helices->frame, b->helices->frame, 200 * sizeof *a->helices->frame);
    ck_assert_mem_eq(a->at, b->at, a->n_vertices * sizeof *a->at);
    groom_conversion_destroy(a), groom_conversion_destroy(b);
    groom_pool_destroy(pool);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(each_allocation_may_fail)
{
    struct groom_strands *strands = many_strands(70);
    struct groom_conversion_options options = groom_conversion_options_default();
    for (size_t n = 0;; n++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, n, &allocator);
        struct groom_context context = {.allocator = &allocator};
        struct groom_conversion *c = NULL;
        groom_status st = groom_strands_convert(strands, &options, &context, &c, NULL);
        groom_conversion_destroy(c);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_uint_lt(n, 200);
    }
    groom_strands_destroy(strands);
}
END_TEST

TEST_SUITE("convert", helices_through_pairs_meet_the_vectors, floating_points_meet_the_vectors,
           a_fit_with_the_given_count_meets_the_vectors, a_coil_comes_back,
           the_root_stays_and_the_root_frame_begins_along_the_strand, a_straight_strand_has_no_curvature,
           a_planar_wave_comes_back_without_loops, a_tiny_strand_comes_back_to_the_digits_it_has,
           a_kink_is_met_at_its_vertices, an_element_begins_where_handedness_flips,
           an_inflection_takes_no_turn_too_many, short_and_repeated_and_pointlike_strands_are_converted, noise_is_averaged_not_amplified,
           a_tolerance_decides_the_count, what_is_not_finite_is_refused_by_name, the_same_bits_for_any_pool,
           each_allocation_may_fail)
