/* what single formats do where files are odd: each refusal says where and what, each liberty is held to */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "groom/format.h"
#include "tests/support/strand_files.h"
#include "tests/support/test.h"

struct outcome {
    groom_status status;
    struct groom_strands *strands;
    struct groom_read_report report;
    struct groom_diag diag;
};

static struct outcome read_as(groom_format format, const void *bytes, size_t n)
{
    struct outcome outcome = {.strands = NULL};
    struct groom_read_options options = {.format = format};
    outcome.status = test_read(bytes, n, 0, &options, NULL, &outcome.strands, &outcome.report, &outcome.diag);
    return outcome;
}

static struct outcome read_text(const char *text) { return read_as(GROOM_FORMAT_AUTO, text, strlen(text)); }

struct refusal {
    const char *text;
    groom_status status;
    int64_t byte_offset;
    const char *words; /* in the detail */
};

static void expect_refusals(const struct refusal *rows, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        struct outcome outcome = read_text(rows[i].text);
        ck_assert_msg(outcome.status == rows[i].status && outcome.diag.byte_offset == rows[i].byte_offset &&
                          strstr(outcome.diag.detail, rows[i].words),
                      "\"%s\": %s at %lld: %s", rows[i].text, groom_status_name(outcome.status),
                      (long long)outcome.diag.byte_offset, outcome.diag.detail);
        groom_strands_destroy(outcome.strands);
    }
}

static void expect_read(const char *text, uint32_t n_strands, uint32_t n_vertices)
{
    struct outcome outcome = read_text(text);
    ck_assert_msg(outcome.status == GROOM_OK, "\"%s\": %s", text, outcome.diag.detail);
    ck_assert_uint_eq(outcome.strands->n_strands, n_strands);
    ck_assert_uint_eq(outcome.strands->n_vertices, n_vertices);
    groom_strands_destroy(outcome.strands);
}

#define N_ROWS(rows) (sizeof(rows) / sizeof(rows)[0])

/* --- JSON --------------------------------------------------------------------------- */

START_TEST(json_says_where_it_breaks)
{
    static const struct refusal rows[] = {
        {"{}", GROOM_EFORMAT, 2, "no member \"strands\""},
        {"{\"strands\":5}", GROOM_EFORMAT, 11, "array of strands"},
        {"[[[1,2,3],[1,2]]]", GROOM_EFORMAT, 14, "three coordinates"},
        {"[[[1,2,3,4]]]", GROOM_EFORMAT, 8, "\"]\" after three"},
        {"[[[1,2,x]]]", GROOM_EFORMAT, 7, "a number"},
        {"[[[1,+2,3]]]", GROOM_EFORMAT, 5, "a number"},
        {"[[[1,2,3] [1,2,3]]]", GROOM_EFORMAT, 10, "\",\" or \"]\" after a vertex"},
        {"[[1,2,3]]", GROOM_EFORMAT, 2, "\"[\" of a vertex"},
        {"[[[1,2,3],[1,2,4]]] x", GROOM_EFORMAT, 20, "end of the data"},
        {"{\"strands\":[],\"strands\":[]}", GROOM_EFORMAT, 24, "only once"},
        {"[[[1,2,3],", GROOM_ETRUNCATED, 10, "\"[\" of a vertex"},
        {"{\"a\":\"", GROOM_ETRUNCATED, 6, "rest of a string"},
        {"{\"a\":nil}", GROOM_EFORMAT, 5, "JSON value"}};
    expect_refusals(rows, N_ROWS(rows));
}
END_TEST

START_TEST(json_passes_over_other_members)
{
    expect_read("{\"a\":{\"b\":[1,-2.5e3,\"\\\"]}\",true,false,null,{}],\"c\":[]},\"strands\":[[[1,2,3],[4,5,"
                "6]]],\"z\":0}",
                1, 2);
    expect_read("\xef\xbb\xbf [[[1,2,3],[4,5,6]]] ", 1, 2);
}
END_TEST

START_TEST(json_is_only_so_deep)
{
    char text[200] = "{\"a\":";
    memset(text + 5, '[', 100);
    struct outcome outcome = read_text(text);
    ck_status(outcome.status, GROOM_EFORMAT);
    ck_assert_ptr_nonnull(strstr(outcome.diag.detail, "64 levels"));
}
END_TEST

START_TEST(a_number_without_end_is_refused)
{
    size_t n = 300000;
    char *text = malloc(n);
    memset(text, '1', n);
    memcpy(text, "[[[", 3);
    ck_status(read_as(GROOM_FORMAT_JSON, text, n).status, GROOM_EFORMAT);
    free(text);
}
END_TEST

/* --- OBJ ------------------------------------------------------------------------------- */

START_TEST(obj_says_where_it_breaks)
{
    static const struct refusal rows[] = {
        {"v 1 2 3\nl 1 2\n", GROOM_EFORMAT, 12, "uses vertex 2, where 1 are given"},
        {"v 1 2 3\nl 0 1\n", GROOM_EFORMAT, 10, "uses vertex 0"},
        {"v 1 2 3\nl -2 -1\n", GROOM_EFORMAT, 10, "uses vertex -2"},
        {"v 1 2\nv 1 2 3\n", GROOM_EFORMAT, 5, "a coordinate of a vertex"},
        {"v 1 2 3\nl 1 x\n", GROOM_EFORMAT, 12, "a vertex index"},
        {"v 1 2 3\nv 1 2 4\n", GROOM_EFORMAT, 16, "no line"}};
    expect_refusals(rows, N_ROWS(rows));
}
END_TEST

START_TEST(obj_keeps_the_order_of_its_lines)
{
    struct outcome outcome =
        read_text("v 0 0 0\nv 0 0 1\nv 0 0 2\nv 5 0 0\nv 5 0 1\nv 5 0 2\nl 4 5 6\nl 3 2 1\n");
    ck_ok(outcome.status);
    ck_assert_uint_eq(outcome.strands->n_strands, 2);
    ck_assert_float_eq(outcome.strands->points[0][0], 5);
    ck_assert_float_eq(outcome.strands->points[3][2], 2);
    ck_assert_float_eq(outcome.strands->points[5][2], 0);
    groom_strands_destroy(outcome.strands);
}
END_TEST

/* 1-2-3 and 2-4: the second begins at a repeated vertex 2; a shared root is repeated as well. */
START_TEST(obj_repeats_vertices_that_lines_share)
{
    struct outcome outcome = read_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 1 1 0\nl 1 2\nl 2 3\nl 2 4\n");
    ck_ok(outcome.status);
    ck_assert_uint_eq(outcome.strands->n_strands, 2);
    ck_assert_uint_eq(outcome.strands->n_vertices, 5);
    ck_assert_float_eq(outcome.strands->points[3][0], 1);
    ck_assert_ptr_nonnull(strstr(outcome.report.warnings[0], "1 vertices are shared"));
    groom_strands_destroy(outcome.strands);
    expect_read("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 1 1 0\nv 1 2 0\nl 1 2 3\nl 1 4 5\n", 2, 6);
}
END_TEST

START_TEST(obj_opens_closed_lines)
{
    struct outcome outcome = read_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 7 7 7\nl 1 2\nl 2 3\nl 3 1\n");
    ck_ok(outcome.status);
    ck_assert_uint_eq(outcome.strands->n_vertices, 3);
    ck_assert_uint_eq(outcome.report.n_warnings, 2);
    groom_strands_destroy(outcome.strands);
}
END_TEST

/* --- PLY ------------------------------------------------------------------------------------ */

#define PLY_XYZ "property float x\nproperty float y\nproperty float z\n"

START_TEST(ply_says_where_it_breaks)
{
    static const struct refusal rows[] = {
        {"ply\nformat ascii 1.0\nelement vertex 2\n" PLY_XYZ
         "element strand 1\nproperty int nsegs\nend_header\n"
         "0 0 0\n0 0 1\n2\n",
         GROOM_EFORMAT, 149, "has 3 vertices, where 2 of 2 are left"},
        {"ply\nformat ascii 1.0\nelement vertex 2\n" PLY_XYZ
         "element edge 1\nproperty int vertex1\nproperty int vertex2\n"
         "end_header\n0 0 0\n0 0 1\n0 2\n",
         GROOM_EFORMAT, 172, "vertex2"},
        {"ply\nformat ascii 1.0\nelement vertex 2\n" PLY_XYZ "end_header\n0 0 0\n0 0 1\n", GROOM_EFORMAT, 111,
         "multiple of 100"},
        {"ply\nformat ascii 1.0\nelement vertex 99999999999\n" PLY_XYZ "end_header\n0 0 0\n",
         GROOM_ETRUNCATED, 110, "rows of element vertex"},
        {"ply\nformat klingon 1.0\n", GROOM_EFORMAT, 18, "ascii, binary_little_endian"},
        {"ply\nproperty float x\n", GROOM_EFORMAT, 12, "an element before"},
        {"ply\nformat ascii 1.0\nelement vertex 5\nend_header\n", GROOM_EFORMAT, 49, "without a property"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty flout x\n", GROOM_EFORMAT, 52, "a type of PLY"}};
    expect_refusals(rows, N_ROWS(rows));
}
END_TEST

START_TEST(ply_takes_other_names_and_elements)
{
    expect_read(
        "ply\nformat ascii 1.0\nobj_info x\nelement camera 1\nproperty list uchar float k\nelement vertex 5\n"
        "property uchar red\n" PLY_XYZ
        "element strand 2\nproperty uchar id\nproperty uint n_points\nend_header\n"
        "2 0.5 0.25\n9 0 0 0\n9 0 0 1\n9 0 0 2\n9 1 0 0\n9 1 0 1\n7 3\n8 2\n",
        2, 5);
}
END_TEST

/* --- TressFX --------------------------------------------------------------------------------- */

START_TEST(tfx_text_says_where_it_breaks)
{
    static const struct refusal rows[] = {
        {"version 2.0\nnumStrands 2\nstrand 0 numVerts 2 texcoord 0 0\n0 0 0\n0 0 1\n", GROOM_ETRUNCATED, 70,
         "the next strand"},
        {"version 2.0\nstrand 0 numVerts -2\n", GROOM_EFORMAT, 30, "count of vertices"},
        {"version 2.0\nstrand 0 vertices 2\n", GROOM_EFORMAT, 21, "numVerts"},
        {"version 2.0\nstrand 0 numVerts 2\n0 0 0\n0 zero 1\n", GROOM_EFORMAT, 40, "a coordinate"}};
    expect_refusals(rows, N_ROWS(rows));
}
END_TEST

/* --- binary counts --------------------------------------------------------------------------------- */

START_TEST(hair_checks_its_counts_against_each_other)
{
    struct test_bytes bytes = {0};
    strand_files[0].make(&bytes);
    bytes.bytes[128] = 9; /* segments of the first strand, of 3 */
    struct outcome outcome = read_as(GROOM_FORMAT_HAIR, bytes.bytes, bytes.n);
    ck_status(outcome.status, GROOM_EFORMAT);
    ck_assert_int_eq(outcome.diag.byte_offset, 128);
    bytes.bytes[128] = 3;
    bytes.bytes[12] = 1; /* no points */
    outcome = read_as(GROOM_FORMAT_HAIR, bytes.bytes, bytes.n);
    ck_status(outcome.status, GROOM_EFORMAT);
    ck_assert_int_eq(outcome.diag.byte_offset, 12);
    test_bytes_finish(&bytes);
}
END_TEST

START_TEST(data_names_the_record_that_is_wrong)
{
    struct test_bytes bytes = {0};
    strand_files[3].make(&bytes);
    bytes.bytes[4 + 52] = 200; /* the count of the second strand, of 4 */
    struct outcome outcome = read_as(GROOM_FORMAT_AUTO, bytes.bytes, bytes.n);
    ck_status(outcome.status, GROOM_ETRUNCATED);
    ck_assert_int_eq(outcome.diag.byte_offset, 56);
    ck_assert_ptr_nonnull(strstr(outcome.diag.detail, "strand 1 of 3 says 200 vertices at byte 56"));
    test_bytes_finish(&bytes);
}
END_TEST

START_TEST(bytes_after_the_last_strand_are_warned_of)
{
    struct test_bytes bytes = {0};
    strand_files[3].make(&bytes);
    test_put(&bytes, "more", 4);
    struct outcome outcome = read_as(GROOM_FORMAT_AUTO, bytes.bytes, bytes.n);
    ck_ok(outcome.status);
    ck_assert_uint_eq(outcome.strands->n_strands, STRAND_FILE_STRANDS);
    ck_assert_ptr_nonnull(strstr(outcome.report.warnings[0], "bytes after the last strand"));
    groom_strands_destroy(outcome.strands);
    test_bytes_finish(&bytes);
}
END_TEST

/* --- NumPy --------------------------------------------------------------------------------------------- */

static void put_npy(struct test_bytes *out, const char *dictionary)
{
    unsigned short length = (unsigned short)strlen(dictionary);
    test_put(out, "\x93NUMPY\1\0", 8);
    test_put(out, &length, 2);
    test_put(out, dictionary, length);
}

START_TEST(npy_refuses_what_are_no_positions)
{
    static const struct {
        const char *dictionary, *words;
    } rows[] = {
        {"{'descr': '<i4', 'fortran_order': False, 'shape': (1, 2, 3), }", "float32"},
        {"{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2, 3), }", "column-major"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }", "(strands, vertices, 3)"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 4), }", "(strands, vertices, 3)"},
        {"{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1,), }", "no 'descr'"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3, 4, 5), }", "no 'descr'"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (9999999999, 9999999999, 3), }", "no 'descr'"}};
    for (size_t i = 0; i < N_ROWS(rows); i++) {
        struct test_bytes bytes = {0};
        char zeros[256] = {0};
        put_npy(&bytes, rows[i].dictionary);
        test_put(&bytes, zeros, sizeof zeros);
        struct outcome outcome = read_as(GROOM_FORMAT_AUTO, bytes.bytes, bytes.n);
        ck_status(outcome.status, GROOM_EFORMAT);
        ck_assert_msg(strstr(outcome.diag.detail, rows[i].words) != NULL, "%s", outcome.diag.detail);
        test_bytes_finish(&bytes);
    }
}
END_TEST

START_TEST(npy_takes_half_floats)
{
    static const unsigned short halves[] = {0x3c00, 0xc000, 0x0001,
                                            0x3555, 0x0000, 0x7bff}; /* 1 -2 2^-24 0.333 0 65504 */
    struct test_bytes bytes = {0};
    put_npy(&bytes, "{'descr': '<f2', 'fortran_order': False, 'shape': (1, 2, 3), }");
    test_put(&bytes, halves, sizeof halves);
    struct outcome outcome = read_as(GROOM_FORMAT_AUTO, bytes.bytes, bytes.n);
    ck_ok(outcome.status);
    ck_assert_float_eq(outcome.strands->points[0][0], 1);
    ck_assert_float_eq(outcome.strands->points[0][1], -2);
    ck_assert_float_eq(outcome.strands->points[0][2], ldexpf(1, -24));
    ck_assert_float_eq(outcome.strands->points[1][2], 65504);
    groom_strands_destroy(outcome.strands);
    test_bytes_finish(&bytes);
}
END_TEST

static const struct strand_file *file_named(const char *name)
{
    for (size_t i = 0; i < n_strand_files; i++)
        if (strcmp(strand_files[i].name, name) == 0)
            return &strand_files[i];
    ck_abort_msg("no file %s", name);
    return NULL;
}

START_TEST(npz_compares_checksums)
{
    struct test_bytes bytes = {0};
    file_named("stored_zip64")->make(&bytes);
    /* a digit of a position, in the last array */
    bytes.bytes[bytes.n - 200] ^= 1;
    struct outcome outcome = read_as(GROOM_FORMAT_AUTO, bytes.bytes, bytes.n);
    ck_status(outcome.status, GROOM_EFORMAT);
    ck_assert_ptr_nonnull(strstr(outcome.diag.detail, "checksum"));
    test_bytes_finish(&bytes);
}
END_TEST

/* An archive of one deflated array of positions whose data is all the same strand. */
static struct test_bytes bomb(size_t n_strands)
{
    struct test_bytes packed = {0};
    unsigned char local[43] = "PK\3\4\x14\0\x08\0\x08\0"; /* sizes in a descriptor */
    char dictionary[128];
    unsigned char out[65536];
    float strand[8][3] = {{0}};
    z_stream z = {0};
    struct test_bytes header = {0};
    local[26] = 13;
    memcpy(local + 30, "positions.npy", 13);
    test_put(&packed, local, sizeof local);
    snprintf(dictionary, sizeof dictionary,
             "{'descr': '<f4', 'fortran_order': False, 'shape': (%zu, 8, 3), }", n_strands);
    put_npy(&header, dictionary);
    strand[7][2] = 1;
    deflateInit2(&z, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    for (size_t i = 0; i <= n_strands + 1; i++) {
        z.next_in = i ? (unsigned char *)strand : header.bytes;
        z.avail_in = i > n_strands ? 0 : i ? sizeof strand : (unsigned)header.n;
        do {
            z.next_out = out;
            z.avail_out = sizeof out;
            deflate(&z, i > n_strands ? Z_FINISH : Z_NO_FLUSH);
            test_put(&packed, out, sizeof out - z.avail_out);
        } while (z.avail_out == 0);
    }
    deflateEnd(&z);
    test_bytes_finish(&header);
    return packed;
}

START_TEST(npz_bombs_are_defused)
{
    struct test_bytes bytes = bomb(500000); /* 48 MB of 96-byte strands in some 100 kB */
    ck_assert_uint_lt(bytes.n, 1000000);
    struct outcome outcome = read_as(GROOM_FORMAT_AUTO, bytes.bytes, bytes.n);
    ck_status(outcome.status, GROOM_ETOOBIG);
    ck_assert_ptr_nonnull(strstr(outcome.diag.detail, "64 fold"));
    test_bytes_finish(&bytes);
}
END_TEST

TEST_SUITE("formats_details", json_says_where_it_breaks, json_passes_over_other_members, json_is_only_so_deep,
           a_number_without_end_is_refused, obj_says_where_it_breaks, obj_keeps_the_order_of_its_lines,
           obj_repeats_vertices_that_lines_share, obj_opens_closed_lines, ply_says_where_it_breaks,
           ply_takes_other_names_and_elements, tfx_text_says_where_it_breaks,
           hair_checks_its_counts_against_each_other, data_names_the_record_that_is_wrong,
           bytes_after_the_last_strand_are_warned_of, npy_refuses_what_are_no_positions,
           npy_takes_half_floats, npz_compares_checksums, npz_bombs_are_defused)
