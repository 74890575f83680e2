#include "tests/support/strand_files.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* --- bytes ------------------------------------------------------------------------- */

void test_bytes_finish(struct test_bytes *bytes)
{
    free(bytes->bytes);
    *bytes = (struct test_bytes){0};
}

void test_put(struct test_bytes *out, const void *more, size_t n)
{
    if (out->n + n > out->capacity) {
        out->capacity = 2 * (out->n + n);
        out->bytes = realloc(out->bytes, out->capacity);
        if (!out->bytes)
            abort();
    }
    if (n)
        memcpy(out->bytes + out->n, more, n);
    out->n += n;
}

void test_put_text(struct test_bytes *out, const char *format, ...)
{
    char text[4096];
    va_list arguments;
    va_start(arguments, format);
    int n = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    test_put(out, text, (size_t)n);
}

groom_status test_sink_write(void *user, const void *bytes, size_t n)
{
    test_put(user, bytes, n);
    return GROOM_OK;
}

static void put_u16(struct test_bytes *out, uint16_t value) { test_put(out, &value, sizeof value); }
static void put_u32(struct test_bytes *out, uint32_t value) { test_put(out, &value, sizeof value); }
static void put_u64(struct test_bytes *out, uint64_t value) { test_put(out, &value, sizeof value); }
static void put_f32(struct test_bytes *out, float value) { test_put(out, &value, sizeof value); }
static void put_zeros(struct test_bytes *out, size_t n)
{
    while (n-- > 0)
        test_put(out, "", 1);
}

/* --- the strands ----------------------------------------------------------------------- */

enum { S = STRAND_FILE_STRANDS, M = 4 };

void strand_file_point(int strand, int k, float out[3])
{
    out[0] = 0.125f * (float)strand + 0.001f * (float)k;
    out[1] = 1.5f + 0.03125f * (float)k;
    out[2] = -0.1f * (float)(strand + 1);
}

static void put_point(struct test_bytes *out, int strand, int k)
{
    float x[3];
    strand_file_point(strand, k, x);
    test_put(out, x, sizeof x);
}

static void put_points(struct test_bytes *out, int n)
{
    for (int i = 0; i < S; i++)
        for (int k = 0; k < n; k++)
            put_point(out, i, k);
}

static void put_point_text(struct test_bytes *out, const char *format, int strand, int k)
{
    float x[3];
    strand_file_point(strand, k, x);
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    test_put_text(out, format, (double)x[0], (double)x[1], (double)x[2]);
#pragma GCC diagnostic pop
}

/* --- HAIR, MonoHair ----------------------------------------------------------------------- */

static void put_hair_header(struct test_bytes *out, const char *magic, uint32_t arrays,
                            uint32_t default_segments)
{
    test_put(out, magic, 4);
    put_u32(out, S);
    put_u32(out, S * M);
    put_u32(out, arrays);
    put_u32(out, default_segments);
    put_zeros(out, 108);
}

static void make_hair(struct test_bytes *out)
{
    put_hair_header(out, "HAIR", 3, 0);
    for (int i = 0; i < S; i++)
        put_u16(out, M - 1);
    put_points(out, M);
}

static void make_hair_all(struct test_bytes *out)
{
    put_hair_header(out, "hair", 2 | 4 | 8 | 16, M - 1);
    put_points(out, M);
    for (int i = 0; i < S * M * 5; i++)
        put_f32(out, 0.5f);
}

static void make_monohair(struct test_bytes *out)
{
    put_u32(out, S);
    put_u32(out, S * M);
    for (int i = 0; i < S; i++)
        put_u16(out, M);
    put_points(out, M);
}

/* --- .data, .bin ------------------------------------------------------------------------------ */

static void put_records(struct test_bytes *out, int n_more, int whole)
{
    put_u32(out, S);
    for (int i = 0; i < S; i++) {
        put_u32(out, M);
        for (int k = 0; k < M; k++) {
            put_point(out, i, k);
            for (int j = 0; j < n_more; j++)
                whole ? put_u32(out, (uint32_t)k % 2) : put_f32(out, 0.25f * (float)j);
        }
    }
}

static void make_data(struct test_bytes *out) { put_records(out, 0, 0); }
static void make_data_visibility(struct test_bytes *out) { put_records(out, 1, 1); }
static void make_ct2hair(struct test_bytes *out) { put_records(out, 4, 0); }

/* --- PLY --------------------------------------------------------------------------------------- */

#define XYZ "property float x\nproperty float y\nproperty float z\n"

static void make_ply_strands(struct test_bytes *out)
{
    test_put_text(out,
                  "ply\nformat binary_little_endian 1.0\ncomment a test\nelement vertex %d\n" XYZ
                  "property uchar red\nelement strand %d\nproperty ushort nsegs\nelement edge %d\n"
                  "property int vertex1\nproperty int vertex2\nend_header\n",
                  S * M, S, S * (M - 1));
    for (int i = 0; i < S * M; i++) {
        put_point(out, i / M, i % M);
        test_put(out, "r", 1);
    }
    for (int i = 0; i < S; i++)
        put_u16(out, M - 1);
    for (uint32_t i = 0; i < S * M; i++)
        if (i % M + 1 < M) {
            put_u32(out, i);
            put_u32(out, i + 1);
        }
}

static void put_swapped(struct test_bytes *out, const void *bytes, size_t n)
{
    for (size_t i = n; i-- > 0;)
        test_put(out, (const char *)bytes + i, 1);
}

/* big-endian doubles, edges last to first */
static void make_ply_edges(struct test_bytes *out)
{
    test_put_text(out,
                  "ply\r\nformat binary_big_endian 1.0\r\nelement vertex %d\r\nproperty double x\r\n"
                  "property double y\r\nproperty double z\r\nelement edge %d\r\nproperty uint vertex1\r\n"
                  "property uint vertex2\r\nend_header\r\n",
                  S * M, S * (M - 1));
    for (int i = 0; i < S * M; i++) {
        float x[3];
        strand_file_point(i / M, i % M, x);
        for (int k = 0; k < 3; k++) {
            double wide = x[k];
            put_swapped(out, &wide, sizeof wide);
        }
    }
    for (uint32_t i = S * M; i-- > 0;)
        if (i % M + 1 < M) {
            uint32_t edge[2] = {i, i + 1};
            put_swapped(out, &edge[0], 4);
            put_swapped(out, &edge[1], 4);
        }
}

/* ascii, vertices last to first, strands as lists */
static void make_ply_lists(struct test_bytes *out)
{
    test_put_text(out,
                  "ply\nformat ascii 1.0\nelement vertex %d\n" XYZ
                  "element strand %d\nproperty list uchar int vertex_indices\nend_header\n",
                  S * M, S);
    for (int i = S * M; i-- > 0;)
        put_point_text(out, "%.9g %.9g %.9g\n", i / M, i % M);
    for (int i = 0; i < S; i++)
        test_put_text(out, "4 %d %d %d %d\n", S * M - 1 - M * i, S * M - 2 - M * i, S * M - 3 - M * i,
                      S * M - 4 - M * i);
}

/* GaussianHaircut: zero normals, no counts */
static void make_ply_uniform(struct test_bytes *out)
{
    test_put_text(out,
                  "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" XYZ
                  "property float nx\nproperty float ny\nproperty float nz\nend_header\n",
                  S * 100);
    for (int i = 0; i < S * 100; i++) {
        put_point(out, i / 100, i % 100);
        put_zeros(out, 12);
    }
}

/* --- .tfx ---------------------------------------------------------------------------------------- */

static void make_tfx_2(struct test_bytes *out)
{
    test_put_text(out,
                  "version 2.0\nscale 1.0\nrotation 0 0 0\ntranslation 0 0 0\nbothEndsImmovable 0\n"
                  "maxNumVerticesInStrand %d\nnumStrands %d\nis sorted 1\n",
                  M, S);
    for (int i = 0; i < S; i++) {
        test_put_text(out, "strand %d numVerts %d texcoord %g 0.5\n", i, M, 0.25 * i);
        for (int k = 0; k < M; k++)
            put_point_text(out, i ? "%.9g, %.9g, %.9g\n" : "%.9g %.9g %.9g\n", i, k);
    }
}

static void put_root_uv(struct test_bytes *out)
{
    for (int i = 0; i < S; i++) {
        put_f32(out, 0.25f * (float)i);
        put_f32(out, 0.5f);
    }
}

static void make_tfx_3(struct test_bytes *out)
{
    const uint32_t positions = 304, root_uv = 304 + 12 * S * M;
    put_f32(out, 3);
    put_u32(out, S);
    put_u32(out, M);
    put_zeros(out, 132);
    put_u32(out, positions);
    put_u32(out, 0);
    put_u32(out, root_uv);
    put_zeros(out, 12 + 128 + 8);
    put_points(out, M);
    put_root_uv(out);
}

static void make_tfx_4(struct test_bytes *out)
{
    put_f32(out, 4);
    put_u32(out, S);
    put_u32(out, M);
    put_u32(out, 160);
    put_u32(out, 160 + 16 * S * M);
    put_zeros(out, 140);
    for (int i = 0; i < S * M; i++) {
        put_point(out, i / M, i % M);
        put_f32(out, i % M > 1);
    }
    put_root_uv(out);
}

/* --- OBJ --------------------------------------------------------------------------------------------- */

static void make_obj_lines(struct test_bytes *out)
{
    test_put_text(out, "# a test\no hair\n");
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < M; k++)
            put_point_text(out, "v %.9g %.9g %.9g\n", i, k);
        test_put_text(out, i == 1 ? "l -4 -3 \\\n -2 -1\n" : "l %d %d/1 %d %d # one\n", M * i + 1, M * i + 2,
                      M * i + 3, M * i + 4);
    }
}

/* Perm's lines of two, the later ones first */
static void make_obj_pairs(struct test_bytes *out)
{
    for (int i = 0; i < S * M; i++)
        put_point_text(out, "v %.9g %.9g %.9g\r\n", i / M, i % M);
    for (int i = S * M; i-- > 0;)
        if (i % M + 1 < M)
            test_put_text(out, "l %d %d\r\n", i + 1, i + 2);
}

/* --- JSON ---------------------------------------------------------------------------------------------- */

static void put_json_strands(struct test_bytes *out, const char *format)
{
    test_put_text(out, "[");
    for (int i = 0; i < S; i++)
        for (int k = 0; k < M; k++) {
            test_put_text(out, "%s", k ? ", " : i ? ",[" : "[");
            put_point_text(out, format, i, k);
            test_put_text(out, "%s", k + 1 == M ? "]" : "");
        }
    test_put_text(out, "]");
}

static void make_json(struct test_bytes *out)
{
    test_put_text(out, "{\"name\":\"a \\\"test\\\"\",\"unit\":[1,{\"m\":null}],\"strands\":");
    put_json_strands(out, "[%.9g,%.9g,%.9g]");
    test_put_text(out, ", \"more\" : true }\n");
}

static void make_json_array(struct test_bytes *out) { put_json_strands(out, "[ %.17e ,\t%.17g\n,%.12f ]"); }

/* --- NumPy -----------------------------------------------------------------------------------------------
 */

static void put_npy_header(struct test_bytes *out, const char *type, const char *shape)
{
    char header[118]; /* ends at a multiple of 64 with the ten bytes before it */
    memset(header, ' ', sizeof header);
    int n = snprintf(header, sizeof header, "{'descr': '%s', 'fortran_order': False, 'shape': (%s), }", type,
                     shape);
    header[n] = ' ';
    header[sizeof header - 1] = '\n';
    test_put(out, "\x93NUMPY\1\0", 8);
    put_u16(out, sizeof header);
    test_put(out, header, sizeof header);
}

static void make_npy(struct test_bytes *out)
{
    put_npy_header(out, "<f4", "3, 4, 3");
    put_points(out, M);
}

static void make_npy_doubles(struct test_bytes *out)
{
    put_npy_header(out, ">f8", "3, 4, 3");
    for (int i = 0; i < S * M; i++) {
        float x[3];
        strand_file_point(i / M, i % M, x);
        for (int k = 0; k < 3; k++) {
            double wide = x[k];
            put_swapped(out, &wide, sizeof wide);
        }
    }
}

enum { STORED, DEFLATED, STREAMED = 2 /* sizes in a descriptor */, ZIP64 = 4 };

static struct test_bytes deflated(const struct test_bytes *data)
{
    struct test_bytes packed = {malloc(data->n + 1024), 0, data->n + 1024};
    z_stream z = {.next_in = data->bytes,
                  .avail_in = (uInt)data->n,
                  .next_out = packed.bytes,
                  .avail_out = (uInt)packed.capacity};
    deflateInit2(&z, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    deflate(&z, Z_FINISH);
    packed.n = z.total_out;
    deflateEnd(&z);
    return packed;
}

static void put_entry(struct test_bytes *out, const char *name, const struct test_bytes *data, int how)
{
    struct test_bytes packed = how & DEFLATED ? deflated(data) : *data;
    uint32_t crc = (uint32_t)crc32(0, data->bytes, (uInt)data->n), none = how & ZIP64 ? UINT32_MAX : 0;
    int known = !(how & (STREAMED | ZIP64));
    put_u32(out, 0x04034b50);
    put_u16(out, 20);
    put_u16(out, how & STREAMED ? 8 : 0);
    put_u16(out, how & DEFLATED ? 8 : 0);
    put_u32(out, 0);
    put_u32(out, how & STREAMED ? 0 : crc);
    put_u32(out, known ? (uint32_t)packed.n : none);
    put_u32(out, known ? (uint32_t)data->n : none);
    put_u16(out, (uint16_t)strlen(name));
    put_u16(out, how & ZIP64 ? 20 : 0);
    test_put(out, name, strlen(name));
    if (how & ZIP64) {
        put_u16(out, 1);
        put_u16(out, 16);
        put_u64(out, data->n);
        put_u64(out, packed.n);
    }
    test_put(out, packed.bytes, packed.n);
    if (how & STREAMED) {
        put_u32(out, 0x08074b50);
        put_u32(out, crc);
        put_u32(out, (uint32_t)packed.n);
        put_u32(out, (uint32_t)data->n);
    }
    if (how & DEFLATED)
        test_bytes_finish(&packed);
}

static void put_directory(struct test_bytes *out, int n_entries)
{
    for (int i = 0; i < n_entries; i++) {
        put_u32(out, 0x02014b50);
        put_zeros(out, 24);
        put_u16(out, 1); /* of its name */
        put_zeros(out, 16);
        test_put(out, "x", 1);
    }
    put_u32(out, 0x06054b50);
    put_zeros(out, 18);
}

static void make_npz(struct test_bytes *out, int how)
{
    struct test_bytes positions = {0}, root_uv = {0}, other = {0};
    make_npy(&positions);
    put_npy_header(&root_uv, "<f4", "3, 2");
    put_root_uv(&root_uv);
    put_npy_header(&other, "|u1", "5,");
    test_put(&other, "other", 5);
    put_entry(out, "root_uv.npy", &root_uv, how);
    put_entry(out, "other.npy", &other, how);
    put_entry(out, "positions.npy", &positions, how);
    put_directory(out, 3);
    test_bytes_finish(&positions);
    test_bytes_finish(&root_uv);
    test_bytes_finish(&other);
}

static void make_npz_stored(struct test_bytes *out) { make_npz(out, STORED | ZIP64); }
static void make_npz_deflated(struct test_bytes *out) { make_npz(out, DEFLATED); }
static void make_npz_streamed(struct test_bytes *out) { make_npz(out, DEFLATED | STREAMED); }
static void make_npz_stored_streamed(struct test_bytes *out) { make_npz(out, STORED | STREAMED); }

/* --- all -------------------------------------------------------------------------------------------------
 */

const struct strand_file strand_files[] = {
    {"segments", GROOM_FORMAT_HAIR, make_hair, 0, M},
    {"all_arrays", GROOM_FORMAT_HAIR, make_hair_all, 0, M},
    {"monohair", GROOM_FORMAT_MONOHAIR, make_monohair, 0, M},
    {"hairsalon", GROOM_FORMAT_DATA, make_data, 0, M},
    {"visibility", GROOM_FORMAT_DATA, make_data_visibility, 0, M},
    {"ct2hair", GROOM_FORMAT_CT2HAIR, make_ct2hair, 0, M},
    {"strands", GROOM_FORMAT_PLY, make_ply_strands, 0, M},
    {"edges_big_endian", GROOM_FORMAT_PLY, make_ply_edges, 0, M},
    {"lists_ascii", GROOM_FORMAT_PLY, make_ply_lists, 0, M},
    {"uniform", GROOM_FORMAT_PLY, make_ply_uniform, 0, 100},
    {"version_2", GROOM_FORMAT_TFX, make_tfx_2, 1, M},
    {"version_3", GROOM_FORMAT_TFX, make_tfx_3, 1, M},
    {"version_4", GROOM_FORMAT_TFX, make_tfx_4, 1, M},
    {"lines", GROOM_FORMAT_OBJ, make_obj_lines, 0, M},
    {"pairs", GROOM_FORMAT_OBJ, make_obj_pairs, 0, M},
    {"object", GROOM_FORMAT_JSON, make_json, 0, M},
    {"array", GROOM_FORMAT_JSON, make_json_array, 0, M},
    {"floats", GROOM_FORMAT_NPY, make_npy, 0, M},
    {"doubles_big_endian", GROOM_FORMAT_NPY, make_npy_doubles, 0, M},
    {"stored_zip64", GROOM_FORMAT_NPZ, make_npz_stored, 1, M},
    {"deflated", GROOM_FORMAT_NPZ, make_npz_deflated, 1, M},
    {"deflated_streamed", GROOM_FORMAT_NPZ, make_npz_streamed, 1, M},
    {"stored_streamed", GROOM_FORMAT_NPZ, make_npz_stored_streamed, 1, M},
};
const size_t n_strand_files = sizeof strand_files / sizeof strand_files[0];

/* --- reading
 * ------------------------------------------------------------------------------------------------ */

struct dribble {
    struct groom_memory_source memory;
    struct groom_source source;
    size_t piece;
};

static int64_t read_dribble(void *user, void *buffer, size_t capacity)
{
    struct dribble *dribble = user;
    return dribble->source.read(dribble->source.user, buffer,
                                capacity < dribble->piece ? capacity : dribble->piece);
}

groom_status test_read(const void *bytes, size_t n, size_t piece, const struct groom_read_options *options,
                       const struct groom_context *context, struct groom_strands **strands,
                       struct groom_read_report *report, struct groom_diag *diag)
{
    struct dribble dribble = {.piece = piece};
    dribble.source = groom_source_from_memory(&dribble.memory, bytes, n);
    struct groom_source slow = {read_dribble, &dribble, -1};
    return groom_strands_read(piece ? &slow : &dribble.source, options, context, strands, report, diag);
}
