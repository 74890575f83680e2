/* The super-helix representation and the way back to points: shared vectors, analytic cases,
 * bad input, memory. */
#include <cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "curvature/element.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

START_TEST(trigonometric_functions_meet_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-primitives.json");
    if (!json)
        return;
    const struct cJSON *row;
    cJSON_ArrayForEach(row, vectors_get(vectors_get(json, "trig5"), "rows"))
    {
        double want[6];
        vectors_read(row, want, 6);
        trig5 f = trig5_of(want[0]);
        double got[5] = {f.A, f.B, f.C, f.B1, f.C1};
        for (int k = 0; k < 5; k++)
            ck_assert_msg(fabs(got[k] - want[k + 1]) <= 2e-15, "x %g function %d: %.17g, not %.17g", want[0], k,
                          got[k], want[k + 1]);
    }
    cJSON_Delete(json);
}
END_TEST

START_TEST(the_series_and_the_closed_form_agree_at_their_border)
{
    trig5 f = trig5_of(TRIG_SERIES_LIMIT), g = trig5_of(TRIG_SERIES_LIMIT * (1.0 + 1e-15));
    ck_assert_double_eq_tol(f.A, g.A, 1e-13);
    ck_assert_double_eq_tol(f.B, g.B, 1e-13);
    ck_assert_double_eq_tol(f.C, g.C, 1e-13);
    ck_assert_double_eq_tol(f.B1, g.B1, 1e-13);
    ck_assert_double_eq_tol(f.C1, g.C1, 1e-13);
}
END_TEST

static void check_case(const struct cJSON *object)
{
    struct groom_superhelices *h = superhelix_from_case(object);
    uint32_t n = (uint32_t)vectors_size(vectors_get(object, "s"));
    double *s = calloc(n, sizeof *s), (*want)[3] = calloc(n, sizeof *want), (*got)[3] = calloc(n, sizeof *got);
    double(*rows)[3][3] = calloc(n, sizeof *rows), (*frames)[3][3] = calloc(n, sizeof *frames);
    const char *name = vectors_get(object, "name")->valuestring;
    vectors_read(vectors_get(object, "s"), s, n);
    vectors_read(vectors_get(object, "points"), want[0], (size_t)n * 3);
    vectors_read(vectors_get(object, "frames_rows"), rows[0][0], (size_t)n * 9);
    groom_superhelix_sample(h, 0, s, n, got, frames);
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            ck_assert_msg(fabs(got[i][k] - want[i][k]) <= 1e-10, "%s, point %u", name, i);
            for (int axis = 0; axis < 3; axis++)
                ck_assert_msg(fabs(frames[i][axis][k] - rows[i][k][axis]) <= 1e-10, "%s, frame %u", name, i);
        }
    free(s), free(want), free(got), free(rows), free(frames);
    groom_superhelices_destroy(h);
}

START_TEST(points_and_frames_meet_the_vectors)
{
    struct cJSON *json = vectors_load("superhelix-sculpt.json");
    if (!json)
        return;
    const struct cJSON *object;
    cJSON_ArrayForEach(object, vectors_get(json, "cases")) check_case(object);
    cJSON_Delete(json);
}
END_TEST

START_TEST(an_untwisted_element_is_an_arc)
{
    struct groom_superhelices *h = superhelix_straight(1, M_PI_2 * 0.03);
    h->q[0][2] = 1.0 / 0.03; /* about v: from t towards u */
    double s = h->length[0], p[3], f[1][3][3];
    groom_superhelix_sample(h, 0, &s, 1, &p, f);
    ck_assert_double_eq_tol(p[0], 0.03, 1e-15);
    ck_assert_double_eq_tol(p[1], 0.03, 1e-15);
    ck_assert_double_eq_tol(f[0][0][1], 1.0, 1e-14);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(a_helix_keeps_its_radius_and_its_step)
{
    const double R = 0.01, rise = 0.004, square = R * R + rise * rise; /* rise a radian */
    struct groom_superhelices *h = superhelix_straight(7, 6 * M_PI * sqrt(square));
    for (int j = 0; j < 7; j++)
        h->q[j][0] = rise / square, h->q[j][2] = R / square;
    double s[2] = {0.0, h->length[0] * 7}, p[2][3];
    groom_superhelix_sample(h, 0, s, 2, p, NULL);
    double reach = sqrt(p[1][0] * p[1][0] + p[1][1] * p[1][1] + p[1][2] * p[1][2]);
    ck_assert_double_eq_tol(reach, 6 * M_PI * rise, 1e-14); /* three turns: straight along the axis */
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(stations_in_any_order_and_past_the_ends)
{
    struct groom_superhelices *h = superhelix_coils(1, 9, 3, 0);
    double s[6] = {0.2, 0.05, 0.15, -1.0, 0.05, 7.0}, one[1], p[6][3], q[3];
    groom_superhelix_sample(h, 0, s, 6, p, NULL);
    for (int i = 0; i < 6; i++) {
        one[0] = fmin(fmax(s[i], 0.0), 0.2);
        groom_superhelix_sample(h, 0, one, 1, &q, NULL);
        for (int k = 0; k < 3; k++)
            ck_assert_double_eq_tol(p[i][k], q[k], 1e-15);
    }
    ck_assert_mem_eq(p[3], h->root[0], sizeof p[3]);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(sampling_reaches_root_and_tip)
{
    struct groom_superhelices *h = superhelix_coils(5, 12, 4, 0);
    float(*out)[3] = calloc(5 * 30, sizeof *out);
    ck_ok(groom_superhelices_sample(h, 30, out, NULL, NULL));
    for (uint32_t i = 0; i < 5; i++) {
        double ends[2] = {0.0, groom_superhelix_length(h, i)}, p[2][3];
        groom_superhelix_sample(h, i, ends, 2, p, NULL);
        for (int k = 0; k < 3; k++) {
            ck_assert_float_eq(out[i * 30][k], (float)p[0][k]);
            ck_assert_float_eq_tol(out[i * 30 + 29][k], (float)p[1][k], 1e-7f);
        }
    }
    ck_status(groom_superhelices_sample(h, 1, out, NULL, NULL), GROOM_EINVAL);
    free(out);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(stations_of_ones_own_equal_uniform_ones)
{
    struct groom_superhelices *h = superhelix_coils(2, 12, 5, 0);
    uint32_t first[3] = {0, 5, 10};
    float at[10] = {0, 0.25f, 0.5f, 0.75f, 1, 0, 0.25f, 0.5f, 0.75f, 1}, a[10][3], b[10][3];
    ck_ok(groom_superhelices_sample_at(h, first, at, a, NULL, NULL));
    ck_ok(groom_superhelices_sample(h, 5, b, NULL, NULL));
    ck_assert_mem_eq(a, b, sizeof a);
    at[7] = NAN;
    struct groom_diag diag;
    ck_status(groom_superhelices_sample_at(h, first, at, a, NULL, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "station 2 of strand 1"));
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(sampling_gives_the_same_bits_for_any_pool)
{
    struct groom_superhelices *h = superhelix_coils(300, 21, 6, 1);
    float(*a)[3] = calloc(300 * 50, sizeof *a), (*b)[3] = calloc(300 * 50, sizeof *b);
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_superhelices_sample(h, 50, a, NULL, NULL));
    ck_ok(groom_superhelices_sample(h, 50, b, &context, NULL));
    ck_assert_mem_eq(a, b, 300 * 50 * sizeof *a);
    groom_pool_destroy(pool);
    free(a), free(b);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(check_names_the_strand_that_is_wrong)
{
    struct groom_superhelices *h = superhelix_coils(3, 4, 7, 0);
    struct groom_diag diag;
    ck_ok(groom_superhelices_check(h, NULL));
    double kept = h->q[5][1];
    h->q[5][1] = NAN;
    ck_status(groom_superhelices_check(h, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "super-helix 1"));
    h->q[5][1] = kept;
    h->length[9] = -0.1;
    ck_status(groom_superhelices_check(h, NULL), GROOM_EINVAL);
    h->length[9] = 0.1;
    for (int k = 0; k < 3; k++)
        h->frame[2][1][k] = -h->frame[2][1][k]; /* left-handed */
    ck_status(groom_superhelices_check(h, NULL), GROOM_EINVAL);
    for (int k = 0; k < 3; k++)
        h->frame[2][1][k] = -h->frame[2][1][k];
    h->first[2] = h->first[1];
    ck_status(groom_superhelices_check(h, NULL), GROOM_EINVAL);
    groom_superhelices_destroy(h);
}
END_TEST

START_TEST(each_allocation_may_fail)
{
    for (size_t n = 0;; n++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, n, &allocator);
        struct groom_context context = {.allocator = &allocator};
        struct groom_superhelices *h = NULL, *copy = NULL;
        groom_status st = groom_superhelices_create(3, 12, &context, &h, NULL);
        if (st == GROOM_OK) {
            for (uint32_t i = 0; i < 3; i++)
                h->first[i + 1] = 4 * (i + 1);
            st = groom_superhelices_copy(h, &context, &copy, NULL);
        }
        groom_superhelices_destroy(copy);
        groom_superhelices_destroy(h);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_uint_lt(n, 100);
    }
}
END_TEST

TEST_SUITE("superhelices", trigonometric_functions_meet_the_vectors,
           the_series_and_the_closed_form_agree_at_their_border, points_and_frames_meet_the_vectors,
           an_untwisted_element_is_an_arc, a_helix_keeps_its_radius_and_its_step,
           stations_in_any_order_and_past_the_ends, sampling_reaches_root_and_tip,
           stations_of_ones_own_equal_uniform_ones, sampling_gives_the_same_bits_for_any_pool,
           check_names_the_strand_that_is_wrong, each_allocation_may_fail)
