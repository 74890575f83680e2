/* What kind of hair: radius, step, frequency, handedness, beta, centre curves, switchbacks, summaries. */
#include <cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "curvature/centre.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

static struct groom_analysis *analyze(const struct groom_superhelices *h)
{
    struct groom_analysis_options options = groom_analysis_options_default();
    struct groom_analysis *a;
    ck_ok(groom_superhelices_analyze(h, &options, NULL, &a, NULL));
    return a;
}

static void check_shapes(const struct cJSON *object)
{
    struct groom_superhelices *h = superhelix_from_case(object);
    struct groom_analysis *a = analyze(h);
    const struct cJSON *R = vectors_get(object, "R"), *omega = vectors_get(object, "omega"), *hand = vectors_get(object, "hand");
    for (uint32_t j = 0; j < h->n_elements; j++) {
        const struct groom_element_shape *s = &a->elements[j];
        double want = cJSON_GetArrayItem(R, (int)j)->valuedouble;
        ck_assert_double_eq_tol((double)s->radius_m, want, 1e-6 * fmax(1.0, fabs(want)));
        ck_assert_double_eq((double)s->hand, cJSON_GetArrayItem(hand, (int)j)->valuedouble);
        const struct cJSON *w = cJSON_GetArrayItem(omega, (int)j);
        if (cJSON_IsNull(w))
            ck_assert(isinf(s->omega));
        else
            ck_assert_double_eq_tol((double)s->omega, w->valuedouble, 1e-6 * fabs(w->valuedouble));
    }
    groom_analysis_destroy(a);
    groom_superhelices_destroy(h);
}

START_TEST(radii_frequencies_and_hands_meet_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-sculpt.json");
    if (!json)
        return;
    const struct cJSON *object;
    cJSON_ArrayForEach(object, vectors_get(json, "cases")) check_shapes(object);
    cJSON_Delete(json);
}
END_TEST

START_TEST(the_centre_curve_and_beta_meet_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    enum { N = 65 };
    const struct cJSON *object = vectors_get(json, "beta");
    struct groom_superhelices *h = superhelix_from_case(object);
    double s[N], beta[N], want[N][3], points[N][3], centre[N][3], wave[2 * N], frames[N][3][3];
    vectors_read(vectors_get(object, "s"), s, N);
    vectors_read(vectors_get(object, "beta"), beta, N);
    vectors_read(vectors_get(object, "center"), want[0], 3 * N);
    groom_superhelix_sample(h, 0, s, N, points, frames);
    centre_wave(N, wave);
    centre_curve((const double(*)[3])points, N, 3, wave, centre);
    for (int i = 0; i < N; i++)
        for (int c = 0; c < 3; c++)
            ck_assert_double_eq_tol(centre[i][c], want[i][c], 1e-10);
    uint32_t first[2] = {0, N}, element[N];
    float at[N];
    for (int i = 0; i < N; i++)
        at[i] = (float)(i / (N - 1.0));
    groom_superhelices_elements_at(h, first, at, element, NULL);
    for (int i = 0; i < N; i++) {
        double t[3], omega[3], tt = 0.0, oo = 0.0, dot = 0.0;
        for (int c = 0; c < 3; c++) {
            t[c] = centre[i < N - 1 ? i + 1 : i][c] - centre[i ? i - 1 : 0][c];
            omega[c] = 0.0;
            for (int axis = 0; axis < 3; axis++)
                omega[c] += frames[i][axis][c] * h->q[element[i]][axis];
            tt += t[c] * t[c], oo += omega[c] * omega[c], dot += t[c] * omega[c];
        }
        ck_assert_double_eq_tol(dot / sqrt(tt * oo), beta[i], 1e-9);
    }
    groom_superhelices_destroy(h);
    cJSON_Delete(json);
}
END_TEST

/* Turns of radius 6 mm and 3 mm rise a radian; hand 1 or -1. */
static struct groom_superhelices *one_coil(uint32_t n, int hand)
{
    const double R = 0.006, rise = 0.002, square = R * R + rise * rise;
    struct groom_superhelices *h = superhelix_straight(n, 0.2);
    for (uint32_t j = 0; j < n; j++)
        h->q[j][0] = hand * rise / square, h->q[j][1] = R / square;
    return h;
}

START_TEST(a_perfect_helix_has_beta_of_its_hand)
{
    for (int hand = -1; hand <= 1; hand += 2) {
        struct groom_superhelices *h = one_coil(40, hand);
        struct groom_analysis *a = analyze(h);
        for (uint32_t j = 3; j < 37; j++) {
            ck_assert_double_ge(hand * (double)a->elements[j].beta, 0.8);
            ck_assert_int_eq(a->elements[j].kind, GROOM_HAIR_COILED);
            ck_assert_int_eq(a->elements[j].hand, hand);
            ck_assert_float_eq_tol(a->elements[j].radius_m, 0.006f, 1e-6f);
            ck_assert_float_eq_tol(a->elements[j].step_m, (float)(hand * 2.0 * M_PI * 0.002), 1e-6f);
        }
        ck_assert_float_eq_tol(a->turns[0], (float)(0.2 / (2.0 * M_PI * sqrt(0.006 * 0.006 + 0.002 * 0.002))), 1e-4f);
        ck_assert_uint_eq(a->n_switchbacks, 0);
        ck_assert_double_eq_tol(a->summary.length_m, 0.2, 1e-12);
        ck_assert_double_ge(a->summary.share[GROOM_HAIR_COILED], 0.9);
        ck_assert_double_eq_tol(a->summary.radius_mean_m, 0.006, 1e-6);
        groom_analysis_destroy(a);
        groom_superhelices_destroy(h);
    }
}
END_TEST

START_TEST(straight_and_wavy_hair_are_told_apart)
{
    struct groom_superhelices *h = superhelix_straight(60, 0.2);
    struct groom_analysis *a = analyze(h);
    ck_assert_double_eq(a->summary.share[GROOM_HAIR_STRAIGHT], 1.0);
    groom_analysis_destroy(a);
    for (uint32_t j = 0; j < 60; j++) /* a planar wave: six elements one way, six back */
        h->q[j][1] = j / 6 % 2 ? -60.0 : 60.0;
    a = analyze(h);
    ck_assert_double_ge(a->summary.share[GROOM_HAIR_WAVY], 0.95);
    for (uint32_t j = 0; j < 60; j++)
        ck_assert(isinf(a->elements[j].omega));
    groom_analysis_destroy(a);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(switchbacks_are_found_and_short_flips_are_not)
{
    struct groom_superhelices *h = one_coil(40, 1);
    for (uint32_t j = 25; j < 40; j++)
        h->q[j][0] = -h->q[j][0];
    h->q[10][0] = -h->q[10][0]; /* one element is a fifth of a turn */
    struct groom_analysis *a = analyze(h);
    ck_assert_uint_eq(a->n_switchbacks, 1);
    ck_assert_uint_eq(a->switchbacks[0].strand, 0);
    ck_assert_uint_eq(a->switchbacks[0].element, 25);
    ck_assert_float_eq_tol(a->switchbacks[0].at, 0.625f, 1e-6f);
    groom_analysis_destroy(a);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(histograms_hold_all_that_winds)
{
    struct groom_superhelices *h = superhelix_coils(50, 30, 3, 0);
    struct groom_analysis *a = analyze(h);
    double metres = 0.0, strands = 0.0, winding = a->summary.length_m * (1.0 - a->summary.share[GROOM_HAIR_STRAIGHT]);
    for (int k = 0; k < GROOM_HISTOGRAM_BINS; k++) {
        metres += a->summary.radius.weight[k];
        strands += a->summary.turns.weight[k];
    }
    ck_assert_double_eq_tol(metres, winding, 1e-9);
    ck_assert_double_eq(strands, 50.0);
    groom_analysis_destroy(a);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(the_same_bits_for_any_pool)
{
    struct groom_superhelices *h = superhelix_coils(200, 30, 4, 1);
    struct groom_analysis_options options = groom_analysis_options_default();
    struct groom_pool *pool;
    struct groom_analysis *a = analyze(h), *b;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_superhelices_analyze(h, &options, &context, &b, NULL));
    ck_assert_mem_eq(a->centre, b->centre, 200 * 65 * sizeof *a->centre);
    for (uint32_t j = 0; j < h->n_elements; j++)
        ck_assert(a->elements[j].beta == b->elements[j].beta);
    ck_assert_mem_eq(&a->summary, &b->summary, sizeof a->summary);
    groom_analysis_destroy(a), groom_analysis_destroy(b);
    groom_pool_destroy(pool);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(a_strand_of_no_length_is_straight)
{
    struct groom_superhelices *h = superhelix_straight(2, 0.0);
    struct groom_analysis *a = analyze(h);
    ck_assert_float_eq(a->turns[0], 0.0f);
    ck_assert_int_eq(a->elements[0].kind, GROOM_HAIR_STRAIGHT);
    ck_assert_float_eq(a->elements[0].beta, 0.0f);
    groom_analysis_destroy(a);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(each_allocation_may_fail)
{
    struct groom_superhelices *h = superhelix_coils(3, 10, 1, 1);
    struct groom_analysis_options options = groom_analysis_options_default();
    for (size_t n = 0;; n++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, n, &allocator);
        struct groom_context context = {.allocator = &allocator};
        struct groom_analysis *a = NULL;
        groom_status st = groom_superhelices_analyze(h, &options, &context, &a, NULL);
        groom_analysis_destroy(a);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_uint_lt(n, 100);
    }
    options.n_bins = 0;
    struct groom_analysis *a;
    ck_status(groom_superhelices_analyze(h, &options, NULL, &a, NULL), GROOM_EINVAL);
    groom_superhelices_destroy(h);
}
END_TEST

TEST_SUITE("analysis", radii_frequencies_and_hands_meet_the_vectors, the_centre_curve_and_beta_meet_the_vectors,
           a_perfect_helix_has_beta_of_its_hand, straight_and_wavy_hair_are_told_apart,
           switchbacks_are_found_and_short_flips_are_not, histograms_hold_all_that_winds,
           the_same_bits_for_any_pool, a_strand_of_no_length_is_straight, each_allocation_may_fail)
