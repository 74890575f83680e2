/* the strand container, arc length, resampling, summary, names of formats and units */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/format.h"
#include "groom/strands.h"
#include "tests/support/test.h"

/* a strand along x: (0,0,0) (1,0,0) (1,2,0), and one of a single segment */
static struct groom_strands *two_strands(void)
{
    static const float points[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 0, 5}, {0, 0, 9}};
    struct groom_strands *strands;
    ck_ok(groom_strands_create(2, 5, NULL, &strands, NULL));
    memcpy(strands->points, points, sizeof points);
    strands->first[1] = 3;
    strands->first[2] = 5;
    return strands;
}

/* n strands of pseudo-random walks, 2 to 40 vertices each */
static struct groom_strands *random_strands(uint32_t n)
{
    struct groom_strands *strands;
    srand(1);
    ck_ok(groom_strands_create(n, (uint64_t)n * 21, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++)
        strands->first[i + 1] = strands->first[i] + (i % 2 ? 40 : 2);
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        for (int k = 0; k < 3; k++)
            strands->points[i][k] = (float)rand() / (float)RAND_MAX;
    return strands;
}

START_TEST(create_refuses_more_than_an_index_can_count)
{
    struct groom_strands *strands = NULL;
    struct groom_diag diag;
    ck_status(groom_strands_create(1, UINT64_C(1) << 32, NULL, &strands, &diag), GROOM_ETOOBIG);
    ck_status(groom_strands_create(UINT64_C(1) << 32, 1, NULL, &strands, &diag), GROOM_ETOOBIG);
    ck_assert_ptr_null(strands);
}
END_TEST

START_TEST(create_gives_back_everything_when_memory_ends)
{
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        struct groom_strands *strands = NULL;
        groom_status status = groom_strands_create(3, 10, &context, &strands, NULL);
        groom_strands_destroy(strands);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (status == GROOM_OK)
            break;
        ck_status(status, GROOM_ENOMEM);
    }
}
END_TEST

START_TEST(polyline_length_is_the_sum_of_its_segments)
{
    const float points[3][3] = {{0, 0, 0}, {3, 4, 0}, {3, 4, 2}};
    ck_assert_double_eq(groom_polyline_length(points, 3), 7);
    ck_assert_double_eq(groom_polyline_length(points, 1), 0);
    ck_assert_double_eq(groom_polyline_length(points, 0), 0);
}
END_TEST

START_TEST(resample_is_uniform_in_arc_length)
{
    static const float expected[8][3] = {
        {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 2, 0}, {0, 0, 5}, {0, 0, 5 + 4 / 3.0f}, {0, 0, 5 + 8 / 3.0f},
        {0, 0, 9}};
    float out[8][3];
    struct groom_strands *strands = two_strands();
    ck_ok(groom_strands_resample(strands, 4, out, NULL, NULL));
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            ck_assert_float_eq_tol(out[i][k], expected[i][k], 1e-6f);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(resample_keeps_endpoints_exactly)
{
    enum { m = 7, n = 301 };
    struct groom_strands *strands = random_strands(n);
    float(*out)[3] = malloc(sizeof(float[3]) * m * n);
    ck_ok(groom_strands_resample(strands, m, out, NULL, NULL));
    for (uint32_t i = 0; i < n; i++) {
        ck_assert_mem_eq(out[i * m], strands->points[strands->first[i]], sizeof out[0]);
        ck_assert_mem_eq(out[i * m + m - 1], strands->points[strands->first[i + 1] - 1], sizeof out[0]);
    }
    free(out);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(resample_survives_repeated_vertices)
{
    struct groom_strands *strands;
    static const float points[5][3] = {{1, 1, 1}, {1, 1, 1}, {2, 1, 1}, {2, 1, 1}, {2, 1, 1}};
    float out[3][3];
    ck_ok(groom_strands_create(1, 5, NULL, &strands, NULL));
    memcpy(strands->points, points, sizeof points);
    strands->first[1] = 5;
    ck_ok(groom_strands_resample(strands, 3, out, NULL, NULL));
    ck_assert_float_eq(out[1][0], 1.5f);
    ck_assert_float_eq(out[2][0], 2.0f);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(resample_refuses_fewer_than_two_vertices)
{
    struct groom_strands *strands = two_strands();
    float out[8][3] = {{42}};
    struct groom_diag diag;
    ck_status(groom_strands_resample(strands, 1, out, NULL, &diag), GROOM_EINVAL);
    strands->first[1] = 4;
    ck_status(groom_strands_resample(strands, 4, out, NULL, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.detail, "strand 1 has 1 vertices; 2 is the least");
    ck_assert_float_eq(out[0][0], 42);
    strands->first[1] = 3;
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(results_are_the_same_bits_for_any_pool)
{
    enum { m = 13, n = 2000 };
    struct groom_strands *strands = random_strands(n);
    float(*out)[m * n][3] = malloc(2 * sizeof *out);
    struct groom_strands_summary summary[2];
    memset(summary, 0, sizeof summary);
    for (uint32_t i = 0; i < 2; i++) {
        struct groom_pool *pool;
        ck_ok(groom_pool_create(i ? 3 : 1, &pool));
        struct groom_context context = {.pool = pool};
        ck_ok(groom_strands_resample(strands, m, out[i], &context, NULL));
        ck_ok(groom_strands_summarize(strands, &context, &summary[i], NULL));
        groom_pool_destroy(pool);
    }
    ck_assert_mem_eq(out[0], out[1], sizeof out[0]);
    ck_assert_mem_eq(&summary[0], &summary[1], sizeof summary[0]);
    free(out);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(summary_has_box_and_lengths)
{
    struct groom_strands *strands = two_strands();
    struct groom_strands_summary summary;
    ck_ok(groom_strands_summarize(strands, NULL, &summary, NULL));
    ck_assert_uint_eq(summary.n_strands, 2);
    ck_assert_uint_eq(summary.n_vertices, 5);
    ck_assert_float_eq(summary.bbox_min[0], 0);
    ck_assert_float_eq(summary.bbox_max[0], 1);
    ck_assert_float_eq(summary.bbox_max[1], 2);
    ck_assert_float_eq(summary.bbox_max[2], 9);
    ck_assert_float_eq(summary.length_min, 3);
    ck_assert_float_eq(summary.length_median, 3.5f);
    ck_assert_float_eq(summary.length_max, 4);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(summary_refuses_an_empty_container)
{
    struct groom_strands *strands;
    struct groom_strands_summary summary;
    ck_ok(groom_strands_create(0, 0, NULL, &strands, NULL));
    ck_status(groom_strands_summarize(strands, NULL, &summary, NULL), GROOM_EEMPTY);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(every_format_is_found_by_its_name)
{
    for (int f = GROOM_FORMAT_AUTO; f < GROOM_FORMAT_COUNT; f++) {
        groom_format parsed = GROOM_FORMAT_COUNT;
        ck_ok(groom_format_parse(groom_format_name((groom_format)f), &parsed, NULL));
        ck_assert_int_eq(parsed, f);
    }
    groom_format format;
    ck_ok(groom_format_parse("usd", &format, NULL));
    ck_assert_int_eq(format, GROOM_FORMAT_USDA);
    ck_ok(groom_format_parse("bin", &format, NULL));
    ck_assert_int_eq(format, GROOM_FORMAT_CT2HAIR);
}
END_TEST

START_TEST(an_unknown_format_is_answered_with_the_list)
{
    struct groom_diag diag;
    groom_format format;
    ck_status(groom_format_parse("fbx", &format, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "usda"));
}
END_TEST

START_TEST(units_are_names_or_metres)
{
    double unit;
    ck_ok(groom_unit_parse("cm", &unit, NULL));
    ck_assert_double_eq(unit, 0.01);
    ck_ok(groom_unit_parse("0.3048", &unit, NULL));
    ck_assert_double_eq(unit, 0.3048);
    static const char *const bad[] = {"", "0", "-1", "nan", "inf", "0x10", "1 m", "1e999", "furlong"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        ck_status(groom_unit_parse(bad[i], &unit, NULL), GROOM_EINVAL);
}
END_TEST

START_TEST(up_is_y_or_z)
{
    groom_up up;
    ck_ok(groom_up_parse("z", &up, NULL));
    ck_assert_int_eq(up, GROOM_UP_Z);
    ck_ok(groom_up_parse("y", &up, NULL));
    ck_assert_int_eq(up, GROOM_UP_Y);
    ck_status(groom_up_parse("x", &up, NULL), GROOM_EINVAL);
}
END_TEST

TEST_SUITE("strands", create_refuses_more_than_an_index_can_count,
           create_gives_back_everything_when_memory_ends, polyline_length_is_the_sum_of_its_segments,
           resample_is_uniform_in_arc_length, resample_keeps_endpoints_exactly,
           resample_survives_repeated_vertices, resample_refuses_fewer_than_two_vertices,
           results_are_the_same_bits_for_any_pool, summary_has_box_and_lengths,
           summary_refuses_an_empty_container, every_format_is_found_by_its_name,
           an_unknown_format_is_answered_with_the_list, units_are_names_or_metres, up_is_y_or_z)
