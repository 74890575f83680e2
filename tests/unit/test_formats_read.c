/* what the readers share: the same strands from every encoding, damage, memory, dropped strands */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <fcntl.h>
#include <unistd.h>

#include "groom/format.h"
#include "tests/support/strand_files.h"
#include "tests/support/test.h"

static groom_status read_bytes(const struct test_bytes *bytes, const struct groom_read_options *options,
                               struct groom_strands **strands, struct groom_read_report *report,
                               struct groom_diag *diag)
{
    return test_read(bytes->bytes, bytes->n, 0, options, NULL, strands, report, diag);
}

static groom_status read_text(const char *text, struct groom_strands **strands,
                              struct groom_read_report *report, struct groom_diag *diag)
{
    return test_read(text, strlen(text), 0, NULL, NULL, strands, report, diag);
}

static void expect_sample(const struct strand_file *file, const struct groom_strands *strands)
{
    ck_assert_uint_eq(strands->n_strands, STRAND_FILE_STRANDS);
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        ck_assert_uint_eq(strands->first[i + 1] - strands->first[i], (uint32_t)file->n_points);
        for (int k = 0; k < file->n_points; k++) {
            float expected[3], *point = strands->points[strands->first[i] + (uint32_t)k];
            strand_file_point((int)i, k, expected);
            for (int j = 0; j < 3; j++)
                ck_assert_msg(fabsf(point[j] - expected[j]) <= 1e-7f, "%s: strand %u vertex %d: %g, not %g",
                              file->name, i, k, (double)point[j], (double)expected[j]);
        }
        if (file->has_root_uv) {
            ck_assert_msg(strands->root_uv != NULL, "%s has no root_uv", file->name);
            ck_assert_float_eq(strands->root_uv[i][0], 0.25f * (float)i);
            ck_assert_float_eq(strands->root_uv[i][1], 0.5f);
        }
    }
}

/* --- every encoding --------------------------------------------------------------------- */

START_TEST(every_encoding_is_recognised_and_reads_as_the_same_strands)
{
    for (size_t i = 0; i < n_strand_files; i++) {
        const struct strand_file *file = &strand_files[i];
        struct test_bytes bytes = {0};
        struct groom_strands *strands = NULL;
        struct groom_read_report report;
        struct groom_diag diag = {0};
        file->make(&bytes);
        groom_status status = read_bytes(&bytes, NULL, &strands, &report, &diag);
        ck_assert_msg(status == GROOM_OK, "%s: %s", file->name, diag.detail);
        ck_assert_msg(report.format == file->format, "%s taken for %s", file->name,
                      groom_format_name(report.format));
        expect_sample(file, strands);
        groom_strands_destroy(strands);
        test_bytes_finish(&bytes);
    }
}
END_TEST

START_TEST(a_pipe_gives_what_a_file_gives)
{
    static const size_t pieces[] = {1, 7, 1000};
    for (size_t i = 0; i < n_strand_files; i++)
        for (size_t j = 0; j < 3; j++) {
            struct test_bytes bytes = {0};
            struct groom_strands *strands = NULL;
            struct groom_diag diag = {0};
            strand_files[i].make(&bytes);
            groom_status status =
                test_read(bytes.bytes, bytes.n, pieces[j], NULL, NULL, &strands, NULL, &diag);
            ck_assert_msg(status == GROOM_OK, "%s: %s", strand_files[i].name, diag.detail);
            expect_sample(&strand_files[i], strands);
            groom_strands_destroy(strands);
            test_bytes_finish(&bytes);
        }
}
END_TEST

START_TEST(a_named_format_is_held_to)
{
    for (size_t i = 0; i < n_strand_files; i++) {
        struct test_bytes bytes = {0};
        struct groom_strands *strands = NULL;
        struct groom_read_options options = {.format = strand_files[i].format};
        struct groom_diag diag = {0};
        strand_files[i].make(&bytes);
        ck_ok(read_bytes(&bytes, &options, &strands, NULL, NULL));
        groom_strands_destroy(strands);
        for (int f = 1; f < GROOM_FORMAT_COUNT; f++) {
            struct groom_strands *untouched = NULL;
            options.format = (groom_format)f;
            if (options.format == strand_files[i].format)
                continue;
            groom_status status = read_bytes(&bytes, &options, &untouched, NULL, &diag);
            ck_assert_msg(status == GROOM_EFORMAT || status == GROOM_ETRUNCATED || status == GROOM_EINVAL,
                          "%s read as %s: %s", strand_files[i].name, groom_format_name(options.format),
                          groom_status_name(status));
            ck_assert_ptr_null(untouched);
            ck_assert(f == GROOM_FORMAT_USDA || diag.byte_offset >= 0);
        }
        test_bytes_finish(&bytes);
    }
}
END_TEST

/* --- damage -------------------------------------------------------------------------------- */

static void expect_refusal(const struct strand_file *file, size_t n, groom_status status,
                           const struct groom_diag *diag, const struct groom_strands *strands)
{
    ck_assert_msg(status != GROOM_OK, "%s cut at %zu was read", file->name, n);
    ck_assert_ptr_null(strands);
    ck_assert_msg(diag->byte_offset >= 0 && (size_t)diag->byte_offset <= n, "%s cut at %zu: offset %lld: %s",
                  file->name, n, (long long)diag->byte_offset, diag->detail);
    ck_assert_msg(strlen(diag->detail) > 10 && diag->status == status, "%s cut at %zu says nothing",
                  file->name, n);
}

/* The formats that say how much is to come; an OBJ may end after any line. */
static int notices_a_cut(const struct strand_file *file, const struct test_bytes *bytes, size_t n)
{
    if (file->format == GROOM_FORMAT_OBJ)
        return 0;
    if (file->format == GROOM_FORMAT_TFX || file->format == GROOM_FORMAT_JSON ||
        strcmp(file->name, "lists_ascii") == 0)
        return n + 14 < bytes->n; /* white space, or the last digits of a number */
    return 1;
}

START_TEST(a_cut_at_any_byte_is_refused_with_its_offset)
{
    for (size_t i = 0; i < n_strand_files; i++) {
        struct test_bytes bytes = {0};
        strand_files[i].make(&bytes);
        for (size_t n = 0; n < bytes.n; n++)
            for (size_t piece = 0; piece < 2; piece++) {
                struct groom_strands *strands = NULL;
                struct groom_diag diag = {.byte_offset = -1};
                unsigned char *cut = malloc(n ? n : 1); /* so that a sanitizer sees what is beyond */
                memcpy(cut, bytes.bytes, n);
                groom_status status = test_read(cut, n, piece * 100, NULL, NULL, &strands, NULL, &diag);
                if (notices_a_cut(&strand_files[i], &bytes, n))
                    expect_refusal(&strand_files[i], n, status, &diag, strands);
                groom_strands_destroy(strands);
                free(cut);
            }
        test_bytes_finish(&bytes);
    }
}
END_TEST

START_TEST(any_flipped_byte_is_read_or_refused)
{
    for (size_t i = 0; i < n_strand_files; i++) {
        struct test_bytes bytes = {0};
        strand_files[i].make(&bytes);
        for (size_t at = 0; at < bytes.n; at++)
            for (int bit = 0; bit < 8; bit++) {
                struct groom_strands *strands = NULL;
                bytes.bytes[at] ^= (unsigned char)(1 << bit);
                groom_status status = read_bytes(&bytes, NULL, &strands, NULL, NULL);
                bytes.bytes[at] ^= (unsigned char)(1 << bit);
                ck_assert_int_eq(status == GROOM_OK, strands != NULL);
                groom_strands_destroy(strands);
            }
        test_bytes_finish(&bytes);
    }
}
END_TEST

START_TEST(a_failing_allocation_is_answered_and_leaks_nothing)
{
    for (size_t i = 0; i < n_strand_files; i++) {
        struct test_bytes bytes = {0};
        strand_files[i].make(&bytes);
        for (size_t fail_at = 0;; fail_at++) {
            struct test_failing_allocator state;
            struct groom_allocator allocator;
            test_failing_allocator_init(&state, fail_at, &allocator);
            struct groom_context context = {.allocator = &allocator};
            struct groom_strands *strands = NULL;
            groom_status status =
                test_read(bytes.bytes, bytes.n, fail_at % 2 * 50, NULL, &context, &strands, NULL, NULL);
            groom_strands_destroy(strands);
            ck_assert_uint_eq(state.outstanding_bytes, 0);
            if (status == GROOM_OK)
                break;
            ck_assert_msg(status == GROOM_ENOMEM, "%s, allocation %zu: %s", strand_files[i].name, fail_at,
                          groom_status_name(status));
        }
        test_bytes_finish(&bytes);
    }
}
END_TEST

static int64_t read_nothing(void *user, void *buffer, size_t capacity)
{
    (void)user, (void)buffer, (void)capacity;
    return -1;
}

START_TEST(a_failing_source_is_an_io_error)
{
    for (int f = 0; f < GROOM_FORMAT_USDA; f++) {
        struct groom_source source = {read_nothing, NULL, 1000};
        struct groom_read_options options = {.format = (groom_format)f};
        struct groom_strands *strands = NULL;
        ck_status(groom_strands_read(&source, &options, NULL, &strands, NULL, NULL), GROOM_EIO);
    }
}
END_TEST

static int always(void *user)
{
    (void)user;
    return 1;
}

START_TEST(a_cancelled_read_stops)
{
    struct groom_progress progress = {.cancelled = always};
    struct groom_context context = {.progress = &progress};
    struct groom_strands *strands = NULL;
    struct test_bytes bytes = {0};
    strand_files[0].make(&bytes);
    ck_status(test_read(bytes.bytes, bytes.n, 0, NULL, &context, &strands, NULL, NULL), GROOM_ECANCELLED);
    test_bytes_finish(&bytes);
}
END_TEST

START_TEST(what_is_no_strand_file_is_said_to_be_so)
{
    static const struct {
        const char *text;
        groom_status status;
        const char *word;
    } rows[] = {
        {"", GROOM_ETRUNCATED, "empty"},
        {"Ogawa\xff", GROOM_EUNKNOWN, "Alembic"},
        {"#usda 1.0\n", GROOM_EUNKNOWN, "USD"},
        {"Dear Sir,\n", GROOM_EUNKNOWN, "text"},
        {"# A read-me\n\nHair, and what to do with it.\n", GROOM_EUNKNOWN, "no strand file: JSON begins with"},
        {"# only\n# remarks\n", GROOM_EFORMAT, "this is no strand file"},
        {" \n ", GROOM_EUNKNOWN, "white space"},
        {"\x89PNG\r\n\x1a\n and so on, for a while longer", GROOM_EUNKNOWN, "no strand format"},
        {"v 1 2 3\nf 1 1 1\n", GROOM_EFORMAT, "mesh"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n3 0 0 0\n",
         GROOM_EFORMAT, "mesh"}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct groom_strands *strands = NULL;
        struct groom_diag diag = {0};
        ck_status(read_text(rows[i].text, &strands, NULL, &diag), rows[i].status);
        ck_assert_msg(strstr(diag.detail, rows[i].word) != NULL, "%s", diag.detail);
    }
}
END_TEST

/* --- what is dropped ---------------------------------------------------------------------------- */

START_TEST(strands_of_no_use_are_dropped_and_counted)
{
    struct groom_strands *strands = NULL;
    struct groom_read_report report;
    ck_ok(read_text("[[], [[1,1,1]], [[0,0,0],[NaN,1,1]], [[7,7,7],[7,7,8]], [[2,2,2],[2,2,2],[2,2,2]], "
                    "[[0,0,null],[1,1,1]],"
                    "[[0,0,0],[1e39,0,0]], [[5,5,5],[6,5,5],[7,5,5]]]",
                    &strands, &report, NULL));
    ck_assert_uint_eq(report.n_strands_in_file, 8);
    ck_assert_uint_eq(report.n_dropped_short, 2);
    ck_assert_uint_eq(report.n_dropped_not_finite, 3);
    ck_assert_uint_eq(report.n_dropped_zero_length, 1);
    ck_assert_uint_eq(report.n_warnings, 3);
    ck_assert_ptr_nonnull(strstr(report.warnings[0], "2 of 8"));
    ck_assert_uint_eq(strands->n_strands, 2);
    ck_assert_uint_eq(strands->n_vertices, 5);
    ck_assert_uint_eq(strands->first[1], 2);
    ck_assert_float_eq(strands->points[1][2], 8);
    ck_assert_float_eq(strands->points[4][0], 7);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(no_usable_strand_is_empty)
{
    struct groom_strands *strands = NULL;
    struct groom_diag diag;
    ck_status(read_text("{\"strands\":[]}", &strands, NULL, &diag), GROOM_EEMPTY);
    ck_status(read_text("[[[1,2,3]],[[1,2,3],[1,2,3]]]", &strands, NULL, &diag), GROOM_EEMPTY);
    ck_assert_ptr_nonnull(strstr(diag.detail, "none of the 2 strands"));
}
END_TEST

START_TEST(root_uv_follows_the_strands_that_are_kept)
{
    struct groom_strands *strands = NULL;
    ck_ok(read_text("version 2.0\nstrand 0 numVerts 2 texcoord 0.1 0.1\n0 0 0\n0 0 0\n"
                    "strand 1 numVerts 2 texcoord 0.2 0.3\n0 0 0\n0 0 1\n",
                    &strands, NULL, NULL));
    ck_assert_uint_eq(strands->n_strands, 1);
    ck_assert_float_eq(strands->root_uv[0][0], 0.2f);
    ck_assert_float_eq(strands->root_uv[0][1], 0.3f);
    groom_strands_destroy(strands);
}
END_TEST

/* --- frames and limits ------------------------------------------------------------------------------ */

START_TEST(units_and_up_axis_are_converted)
{
    struct groom_strands *strands = NULL;
    const char *text = "[[[100,200,300],[100,200,400]]]";
    struct groom_read_options options = {.frame = {.unit_m = 0.01, .up = GROOM_UP_Z}};
    ck_ok(test_read(text, strlen(text), 0, &options, NULL, &strands, NULL, NULL));
    ck_assert_float_eq(strands->points[0][0], 1);
    ck_assert_float_eq(strands->points[0][1], 3);
    ck_assert_float_eq(strands->points[0][2], -2);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(more_vertices_than_the_limit_are_refused)
{
    for (size_t i = 0; i < n_strand_files; i++)
        for (size_t piece = 0; piece <= 50; piece += 50) {
            uint64_t n = STRAND_FILE_STRANDS * (uint64_t)strand_files[i].n_points;
            struct groom_read_options options = {.max_vertices = n};
            struct groom_strands *strands = NULL;
            struct test_bytes bytes = {0};
            strand_files[i].make(&bytes);
            ck_ok(test_read(bytes.bytes, bytes.n, piece, &options, NULL, &strands, NULL, NULL));
            groom_strands_destroy(strands);
            options.max_vertices = n - 1;
            groom_status status =
                test_read(bytes.bytes, bytes.n, piece, &options, NULL, &strands, NULL, NULL);
            ck_assert_msg(status == GROOM_ETOOBIG, "%s: %s", strand_files[i].name, groom_status_name(status));
            test_bytes_finish(&bytes);
        }
}
END_TEST

/* --- memory -----------------------------------------------------------------------------------------------
 */

struct peak {
    size_t now, highest;
};

static void *allocate_counted(void *user, size_t bytes)
{
    struct peak *peak = user;
    peak->now += bytes;
    if (peak->now > peak->highest)
        peak->highest = peak->now;
    return groom_default_allocator.allocate(NULL, bytes);
}

static void release_counted(void *user, void *memory, size_t bytes)
{
    struct peak *peak = user;
    if (memory)
        peak->now -= bytes;
    groom_default_allocator.release(NULL, memory, bytes);
}

/* Some 100 000 vertices, 1.2 MB, in any writable format. */
static struct test_bytes big_file(groom_format format)
{
    enum { n_strands = 2000, m = 50 };
    struct test_bytes bytes = {0};
    struct groom_write_options options = {.format = format};
    struct groom_sink sink = {test_sink_write, &bytes};
    struct groom_writer *writer;
    ck_ok(groom_writer_create(&options, n_strands, NULL, m, sink, NULL, &writer, NULL));
    for (uint32_t i = 0; i < n_strands * m; i++) {
        float point[1][3] = {{(float)i * 1e-5f, sinf((float)i), (float)(i % m) * 0.01f}};
        ck_ok(groom_writer_points(writer, (const float(*)[3])point, 1, NULL));
    }
    ck_ok(groom_writer_finish(writer, NULL));
    groom_writer_destroy(writer);
    return bytes;
}

/* Twice the container's own arrays, and what does not grow: windows, one unfilled chunk a list. */
static void expect_bounded(const struct test_bytes *bytes, size_t piece, const char *name)
{
    struct peak peak = {0};
    struct groom_allocator allocator = {allocate_counted, release_counted, &peak};
    struct groom_context context = {.allocator = &allocator};
    struct groom_strands *strands = NULL;
    ck_ok(test_read(bytes->bytes, bytes->n, piece, NULL, &context, &strands, NULL, NULL));
    size_t own = 12 * (size_t)strands->n_vertices + 4 * ((size_t)strands->n_strands + 1), fixed = 160 << 10;
    ck_assert_msg(peak.highest <= 2 * own + fixed, "%s: %zu bytes at most, where the strands are %zu", name,
                  peak.highest, own);
    groom_strands_destroy(strands);
    ck_assert_uint_eq(peak.now, 0);
}

START_TEST(memory_stays_within_twice_the_strands)
{
    for (int f = 1; f < GROOM_FORMAT_COUNT; f++) {
        if (!groom_format_writable((groom_format)f) || !groom_format_readable((groom_format)f))
            continue;
        struct test_bytes bytes = big_file((groom_format)f);
        expect_bounded(&bytes, 0, groom_format_name((groom_format)f));
        expect_bounded(&bytes, 4096, groom_format_name((groom_format)f));
        test_bytes_finish(&bytes);
    }
}
END_TEST

/* Edges from last to first: nothing can be cut before all are read. */
START_TEST(memory_stays_within_twice_the_strands_for_shuffled_lines)
{
    enum { n_strands = 1000, m = 60 };
    struct test_bytes bytes = {0};
    for (int i = 0; i < n_strands * m; i++)
        test_put_text(&bytes, "v %d %d 0\n", i % m, i / m);
    for (int i = n_strands * m; i-- > 0;)
        if (i % m + 1 < m)
            test_put_text(&bytes, "l %d %d\n", i + 1, i + 2);
    expect_bounded(&bytes, 0, "shuffled lines");
    test_bytes_finish(&bytes);
}
END_TEST

START_TEST(counts_that_lie_take_no_memory)
{
    static const struct {
        const char *name;
        size_t n;
        unsigned char bytes[64];
    } rows[] = {
        {"data", 12, {255, 255, 255, 127, 255, 255, 255, 127, 0, 0, 0, 0}},
        {"hair", 20, {'H', 'A', 'I', 'R', 255, 255, 255, 255, 255, 255, 255, 255, 3, 0, 0, 0, 0, 0, 0, 0}},
        {"tfx", 16, {0, 0, 128, 64, 255, 255, 255, 255, 255, 255, 255, 255, 160, 0, 0, 0}}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        for (size_t piece = 0; piece < 2; piece++) {
            struct peak peak = {0};
            struct groom_allocator allocator = {allocate_counted, release_counted, &peak};
            struct groom_context context = {.allocator = &allocator};
            struct groom_strands *strands = NULL;
            unsigned char bytes[1024] = {0};
            memcpy(bytes, rows[i].bytes, rows[i].n);
            groom_status status = test_read(bytes, sizeof bytes, piece, NULL, &context, &strands, NULL, NULL);
            ck_assert_msg(status != GROOM_OK, "%s", rows[i].name);
            ck_assert_msg(peak.highest < 400 << 10, "%s took %zu bytes", rows[i].name, peak.highest);
        }
}
END_TEST

/* --- real files -------------------------------------------------------------------------------------------
 */

static struct groom_strands *read_shared(const char *relative, groom_format expected)
{
    const char *path = test_shared_data(relative);
    struct groom_strands *strands = NULL;
    struct groom_read_report report;
    struct groom_diag diag = {0};
    if (!path)
        return NULL;
    int fd = open(path, O_RDONLY);
    struct groom_source source = groom_source_from_fd(fd);
    groom_status status = groom_strands_read(&source, NULL, NULL, &strands, &report, &diag);
    close(fd);
    ck_assert_msg(status == GROOM_OK, "%s: %s", relative, diag.detail);
    ck_assert_int_eq(report.format, expected);
    return strands;
}

START_TEST(encodings_of_a_real_file_are_the_same_strands)
{
    static const struct {
        const char *name;
        groom_format format;
    } files[] = {{"bangs100/Bangs_100.data", GROOM_FORMAT_DATA},
                 {"bangs100/Bangs_100.hair", GROOM_FORMAT_HAIR},
                 {"bangs100/Bangs_100.bin", GROOM_FORMAT_CT2HAIR},
                 {"bangs100/Bangs_100_binary.ply", GROOM_FORMAT_PLY},
                 {"bangs100/Bangs_100_ascii.ply", GROOM_FORMAT_PLY}};
    struct groom_strands *reference = read_shared(files[0].name, files[0].format);
    if (!reference)
        return;
    ck_assert_uint_eq(reference->n_strands, 100);
    ck_assert_uint_eq(reference->n_vertices, 1165);
    for (size_t i = 1; i < sizeof files / sizeof files[0]; i++) {
        struct groom_strands *strands = read_shared(files[i].name, files[i].format);
        ck_assert_uint_eq(strands->n_strands, reference->n_strands);
        ck_assert_mem_eq(strands->first, reference->first, 101 * sizeof *strands->first);
        for (uint32_t v = 0; v < reference->n_vertices; v++)
            for (int k = 0; k < 3; k++) /* the ascii file holds nine digits */
                ck_assert_float_eq(strands->points[v][k], reference->points[v][k]);
        groom_strands_destroy(strands);
    }
    groom_strands_destroy(reference);
}
END_TEST

START_TEST(real_files_read_whole)
{
    static const struct {
        const char *name;
        groom_format format;
        uint32_t n_strands, n_vertices;
        int has_root_uv;
    } files[] = {{"harolongo/hair.data", GROOM_FORMAT_DATA, 7905, 166005, 0},
                 {"combover/hair.data", GROOM_FORMAT_DATA, 30534, 244272, 0},
                 {"guides/back.data", GROOM_FORMAT_DATA, 1044, 33408, 0},
                 {"guides/scene_hair.data", GROOM_FORMAT_DATA, 3780, 38659, 0},
                 {"guides/slicked_back.data", GROOM_FORMAT_DATA, 1071, 12437, 0},
                 {"mohawk/hair.tfx", GROOM_FORMAT_TFX, 2228, 71296, 1},
                 {"sintel/hair.tfx", GROOM_FORMAT_TFX, 11400, 182400, 0}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        struct groom_strands *strands = read_shared(files[i].name, files[i].format);
        if (!strands)
            return;
        ck_assert_uint_eq(strands->n_strands, files[i].n_strands);
        ck_assert_uint_eq(strands->n_vertices, files[i].n_vertices);
        ck_assert_int_eq(strands->root_uv != NULL, files[i].has_root_uv);
        groom_strands_destroy(strands);
    }
}
END_TEST

/* --- the corpus ---------------------------------------------------------------------------------------- */

/* The fuzzers start from these encodings; GROOM_UPDATE=1 writes them anew. */
START_TEST(the_fuzz_corpus_holds_every_encoding)
{
    for (size_t i = 0; i < n_strand_files; i++) {
        char path[256];
        struct test_bytes bytes = {0};
        const char *format = groom_format_name(strand_files[i].format);
        strand_files[i].make(&bytes);
        snprintf(path, sizeof path, "tests/fuzz/corpus/%s/%s", format, strand_files[i].name);
        if (getenv("GROOM_UPDATE")) {
            FILE *file = fopen(path, "wb");
            ck_assert_msg(file && fwrite(bytes.bytes, 1, bytes.n, file) == bytes.n && fclose(file) == 0, "%s",
                          path);
        }
        struct stat status;
        ck_assert_msg(stat(path, &status) == 0 && (size_t)status.st_size == bytes.n,
                      "%s is not there or old: run with GROOM_UPDATE=1", path);
        test_bytes_finish(&bytes);
    }
}
END_TEST

TEST_SUITE("formats_read", every_encoding_is_recognised_and_reads_as_the_same_strands,
           a_pipe_gives_what_a_file_gives, a_named_format_is_held_to,
           a_cut_at_any_byte_is_refused_with_its_offset, any_flipped_byte_is_read_or_refused,
           a_failing_allocation_is_answered_and_leaks_nothing, a_failing_source_is_an_io_error,
           a_cancelled_read_stops, what_is_no_strand_file_is_said_to_be_so,
           strands_of_no_use_are_dropped_and_counted, no_usable_strand_is_empty,
           root_uv_follows_the_strands_that_are_kept, units_and_up_axis_are_converted,
           more_vertices_than_the_limit_are_refused, memory_stays_within_twice_the_strands,
           memory_stays_within_twice_the_strands_for_shuffled_lines, counts_that_lie_take_no_memory,
           encodings_of_a_real_file_are_the_same_strands, real_files_read_whole,
           the_fuzz_corpus_holds_every_encoding)
