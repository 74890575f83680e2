/* the writers: round trips, sizes, layouts that cannot be written, failing sinks */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/format.h"
#include "tests/support/strand_files.h"
#include "tests/support/test.h"

static const groom_format writable[] = {GROOM_FORMAT_HAIR, GROOM_FORMAT_DATA, GROOM_FORMAT_PLY,
                                        GROOM_FORMAT_OBJ,  GROOM_FORMAT_JSON, GROOM_FORMAT_USDA};
enum { N_WRITABLE = 6, N_READ_BACK = 5 /* all but USD */ };

/* n strands of 2 to 40 vertices at awkward coordinates */
static struct groom_strands *random_strands(uint32_t n)
{
    struct groom_strands *strands;
    uint64_t n_vertices = 0;
    srand(5);
    for (uint32_t i = 0; i < n; i++)
        n_vertices += 2 + i * 7 % 39;
    ck_ok(groom_strands_create(n, n_vertices, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++)
        strands->first[i + 1] = strands->first[i] + 2 + i * 7 % 39;
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        for (int k = 0; k < 3; k++)
            strands->points[i][k] = ldexpf((float)rand() / (float)RAND_MAX - 0.5f, rand() % 20 - 10);
    return strands;
}

static struct test_bytes written(const struct groom_strands *strands,
                                 const struct groom_write_options *options)
{
    struct test_bytes bytes = {0};
    struct groom_diag diag = {0};
    groom_status status =
        groom_strands_write(strands, options, (struct groom_sink){test_sink_write, &bytes}, NULL, &diag);
    ck_assert_msg(status == GROOM_OK, "%s: %s", groom_format_name(options->format), diag.detail);
    return bytes;
}

START_TEST(what_is_written_reads_back_bit_for_bit)
{
    struct groom_strands *strands = random_strands(500);
    for (int f = 0; f < N_READ_BACK; f++) {
        struct groom_write_options options = {.format = writable[f]};
        struct test_bytes bytes = written(strands, &options);
        struct groom_strands *back = NULL;
        struct groom_read_report report;
        ck_ok(test_read(bytes.bytes, bytes.n, 0, NULL, NULL, &back, &report, NULL));
        ck_assert_int_eq(report.format, writable[f]);
        ck_assert_uint_eq(report.n_warnings, 0);
        ck_assert_uint_eq(back->n_strands, strands->n_strands);
        ck_assert_mem_eq(back->first, strands->first, (strands->n_strands + 1) * sizeof *strands->first);
        ck_assert_msg(memcmp(back->points, strands->points, strands->n_vertices * sizeof *strands->points) ==
                          0,
                      "%s", groom_format_name(writable[f]));
        groom_strands_destroy(back);
        test_bytes_finish(&bytes);
    }
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(units_and_up_axis_are_undone)
{
    struct groom_strands *strands = random_strands(50);
    for (int f = 0; f < N_READ_BACK; f++) {
        struct groom_frame frame = {.unit_m = 0.01, .up = GROOM_UP_Z};
        struct groom_write_options options = {.format = writable[f], .frame = frame};
        struct groom_read_options read_options = {.frame = frame};
        struct test_bytes bytes = written(strands, &options);
        struct groom_strands *back = NULL;
        ck_ok(test_read(bytes.bytes, bytes.n, 0, &read_options, NULL, &back, NULL, NULL));
        for (uint32_t i = 0; i < strands->n_vertices; i++)
            for (int k = 0; k < 3; k++)
                ck_assert_float_eq_tol(back->points[i][k], strands->points[i][k],
                                       fabsf(strands->points[i][k]) * 2e-7f);
        groom_strands_destroy(back);
        test_bytes_finish(&bytes);
    }
    groom_strands_destroy(strands);
}
END_TEST

/* by hand: one strand (1,2,3) (4,5,6) m in a file of centimetres with z up */
START_TEST(the_frame_of_the_file_is_as_documented)
{
    struct groom_strands *strands;
    ck_ok(groom_strands_create(1, 2, NULL, &strands, NULL));
    strands->first[1] = 2;
    memcpy(strands->points, (float[2][3]){{1, 2, 3}, {4, 5, 6}}, 24);
    struct groom_write_options options = {GROOM_FORMAT_OBJ, {.unit_m = 0.01, .up = GROOM_UP_Z}, 0};
    struct test_bytes bytes = written(strands, &options);
    test_put(&bytes, "", 1);
    ck_assert_str_eq((char *)bytes.bytes,
                     "# groomd strands, root first\nv 100 -300 200\nv 400 -600 500\nl 1 2\n");
    test_bytes_finish(&bytes);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(usd_is_as_documented)
{
    static const char expected[] =
        "#usda 1.0\n(\n    defaultPrim = \"groom\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n"
        "def BasisCurves \"groom\"\n{\n    uniform token type = \"linear\"\n    uniform token wrap = "
        "\"nonperiodic\"\n"
        "    int[] curveVertexCounts = [2,3]\n    point3f[] points = "
        "[(0,0,0),(0,0,1),(1,0,0),(1,0.5,0),(1,0.5,-1)]\n"
        "    float[] widths = [0.5] (\n        interpolation = \"constant\"\n    )\n"
        "    float3[] extent = [(-0.25,-0.25,-1.25),(1.25,0.75,1.25)]\n}\n";
    struct groom_strands *strands;
    ck_ok(groom_strands_create(2, 5, NULL, &strands, NULL));
    strands->first[1] = 2;
    strands->first[2] = 5;
    memcpy(strands->points, (float[5][3]){{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 0.5f, 0}, {1, 0.5f, -1}}, 60);
    struct groom_write_options options = {.format = GROOM_FORMAT_USDA, .width_m = 0.5f};
    struct test_bytes bytes = written(strands, &options);
    test_put(&bytes, "", 1);
    ck_assert_str_eq((char *)bytes.bytes, expected);
    test_bytes_finish(&bytes);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(size_is_told_beforehand)
{
    struct groom_strands *strands = random_strands(321);
    for (int f = 0; f < N_WRITABLE; f++) {
        struct groom_write_options options = {.format = writable[f]};
        struct test_bytes bytes = written(strands, &options);
        int64_t size = groom_writer_size(writable[f], strands->n_strands, strands->n_vertices);
        ck_assert_int_eq(size, f < 3 ? (int64_t)bytes.n : -1);
        test_bytes_finish(&bytes);
    }
    groom_strands_destroy(strands);
}
END_TEST

/* Points in pieces of any size are the same file. */
START_TEST(pieces_do_not_matter)
{
    struct groom_strands *strands = random_strands(60);
    uint32_t counts[60];
    for (uint32_t i = 0; i < 60; i++)
        counts[i] = strands->first[i + 1] - strands->first[i];
    for (int f = 0; f < N_WRITABLE; f++)
        for (uint32_t piece = 1; piece < 100; piece += 13) {
            struct groom_write_options options = {.format = writable[f], .frame = {.up = GROOM_UP_Z}};
            struct test_bytes whole = written(strands, &options), pieces = {0};
            struct groom_writer *writer;
            ck_ok(groom_writer_create(&options, 60, counts, 0, (struct groom_sink){test_sink_write, &pieces},
                                      NULL, &writer, NULL));
            for (uint32_t i = 0; i < strands->n_vertices; i += piece) {
                uint32_t n = strands->n_vertices - i < piece ? strands->n_vertices - i : piece;
                ck_ok(groom_writer_points(writer, (const float(*)[3])(strands->points + i), n, NULL));
            }
            ck_ok(groom_writer_finish(writer, NULL));
            groom_writer_destroy(writer);
            ck_assert_uint_eq(pieces.n, whole.n);
            ck_assert_mem_eq(pieces.bytes, whole.bytes, whole.n);
            test_bytes_finish(&whole);
            test_bytes_finish(&pieces);
        }
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(a_writer_counts_its_points)
{
    float points[5][3] = {{0}};
    struct test_bytes bytes = {0};
    struct groom_write_options options = {.format = GROOM_FORMAT_DATA};
    struct groom_writer *writer;
    ck_ok(groom_writer_create(&options, 2, NULL, 2, (struct groom_sink){test_sink_write, &bytes}, NULL,
                              &writer, NULL));
    ck_status(groom_writer_points(writer, (const float(*)[3])points, 5, NULL), GROOM_EINVAL);
    ck_ok(groom_writer_points(writer, (const float(*)[3])points, 3, NULL));
    ck_status(groom_writer_finish(writer, NULL), GROOM_EINVAL);
    ck_ok(groom_writer_points(writer, (const float(*)[3])points, 1, NULL));
    ck_ok(groom_writer_finish(writer, NULL));
    groom_writer_destroy(writer);
    test_bytes_finish(&bytes);
}
END_TEST

START_TEST(layouts_that_a_format_cannot_hold_are_refused)
{
    static const struct {
        groom_format format;
        uint32_t n_strands, count;
    } rows[] = {{GROOM_FORMAT_HAIR, 1, 65537},     {GROOM_FORMAT_PLY, 1, 65537}, {GROOM_FORMAT_JSON, 1, 1},
                {GROOM_FORMAT_DATA, 3, 0},         {GROOM_FORMAT_CT2HAIR, 1, 2}, {GROOM_FORMAT_AUTO, 1, 2},
                {GROOM_FORMAT_HAIR, 100000, 65536}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct groom_write_options options = {.format = rows[i].format};
        struct test_bytes bytes = {0};
        struct groom_writer *writer = NULL;
        struct groom_diag diag = {0};
        ck_status(groom_writer_create(&options, rows[i].n_strands, NULL, rows[i].count,
                                      (struct groom_sink){test_sink_write, &bytes}, NULL, &writer, &diag),
                  GROOM_EINVAL);
        ck_assert_uint_gt(strlen(diag.detail), 10);
        ck_assert_ptr_null(writer);
        test_bytes_finish(&bytes);
    }
}
END_TEST

START_TEST(text_refuses_what_it_cannot_say)
{
    static const float points[2][3] = {{0, 0, 0}, {0, INFINITY, 0}};
    for (int f = 3; f < N_WRITABLE; f++) {
        struct groom_write_options options = {.format = writable[f]};
        struct test_bytes bytes = {0};
        struct groom_writer *writer;
        ck_ok(groom_writer_create(&options, 1, NULL, 2, (struct groom_sink){test_sink_write, &bytes}, NULL,
                                  &writer, NULL));
        ck_status(groom_writer_points(writer, points, 2, NULL), GROOM_EINVAL);
        groom_writer_destroy(writer);
        test_bytes_finish(&bytes);
    }
}
END_TEST

struct full_disk {
    size_t left;
};

static groom_status write_full_disk(void *user, const void *bytes, size_t n)
{
    struct full_disk *disk = user;
    (void)bytes;
    if (n > disk->left)
        return GROOM_ENOSPC;
    disk->left -= n;
    return GROOM_OK;
}

START_TEST(a_failing_sink_is_passed_on)
{
    struct groom_strands *strands = random_strands(2000);
    for (int f = 0; f < N_WRITABLE; f++)
        for (size_t left = 0; left < 200000; left += 60000) {
            struct full_disk disk = {left};
            struct groom_write_options options = {.format = writable[f]};
            struct groom_diag diag = {0};
            ck_status(groom_strands_write(strands, &options, (struct groom_sink){write_full_disk, &disk},
                                          NULL, &diag),
                      GROOM_ENOSPC);
            ck_assert_int_eq(diag.status, GROOM_ENOSPC);
        }
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(a_failing_allocation_leaks_nothing)
{
    struct groom_strands *strands = random_strands(5);
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        struct test_bytes bytes = {0};
        struct groom_write_options options = {.format = GROOM_FORMAT_JSON};
        groom_status status = groom_strands_write(
            strands, &options, (struct groom_sink){test_sink_write, &bytes}, &context, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        test_bytes_finish(&bytes);
        if (status == GROOM_OK)
            break;
        ck_status(status, GROOM_ENOMEM);
    }
    groom_strands_destroy(strands);
}
END_TEST

TEST_SUITE("formats_write", what_is_written_reads_back_bit_for_bit, units_and_up_axis_are_undone,
           the_frame_of_the_file_is_as_documented, usd_is_as_documented, size_is_told_beforehand,
           pieces_do_not_matter, a_writer_counts_its_points, layouts_that_a_format_cannot_hold_are_refused,
           text_refuses_what_it_cannot_say, a_failing_sink_is_passed_on, a_failing_allocation_leaks_nothing)
