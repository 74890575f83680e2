/* TressFX .tfx.
 *
 * 4: f32 version, u32 strands, u32 vertices a strand, u32 offsets of positions (f32 xyzw), strand
 *    texture coordinates (f32 uv a strand, or 0), vertex texture coordinates, strand thickness, vertex
 *    colours, u32 reserved[32]: 160 bytes.
 * 3: f32 version, u32 strands, u32 vertices a strand, u32 follow hairs, u32 both ends fixed,
 *    u32 reserved[31], u32 offsets of positions (f32 xyz), thickness, strand texture coordinates, colours,
 *    guide indices, vertex texture coordinates, u32 reserved[32]: 296 bytes.
 * 2: text; "name value" lines, then a strand each: "strand I numVerts N texcoord U V" and N lines of
 *    three numbers, blanks or commas between them. Scale, rotation and translation are the viewer's
 *    hints, and not applied. */
#include <string.h>

#include "strands/reader.h"
#include "strands/text.h"

/* --- 3 and 4: binary -------------------------------------------------------------------- */

static int is_binary(const struct input *in)
{
    float version = input_available(in) >= 4 ? input_f32(in->buffer + in->at) : 0;
    return version == 3.0f || version == 4.0f;
}

struct tfx_header {
    uint32_t n_strands, n_vertices; /* of each strand */
    uint32_t positions, strand_uv;  /* byte offsets; strand_uv may be 0 */
    uint32_t stride, bytes;         /* of a position; of the header */
};

static groom_status read_header(struct reader *reader, struct tfx_header *header)
{
    const unsigned char *b;
    float version = input_f32(reader->in->buffer + reader->in->at);
    uint32_t bytes = version == 4.0f ? 160 : 296;
    groom_status status = input_take(reader->in, bytes, "the .tfx header", &b, reader->diag);
    if (status != GROOM_OK)
        return status;
    *header = (struct tfx_header){
        input_u32(b + 4), input_u32(b + 8), input_u32(b + 12), input_u32(b + 16), 16, bytes};
    if (version == 3.0f) {
        header->positions = input_u32(b + 144);
        header->strand_uv = input_u32(b + 152);
        header->stride = 12;
    }
    if (header->positions < bytes)
        return groom_fail_at(reader->diag, GROOM_EFORMAT, version == 4.0f ? 12 : 144,
                             "the positions stand at byte %u by the header, which itself is %u bytes long",
                             header->positions, bytes);
    return GROOM_OK;
}

static groom_status read_positions(struct reader *reader, const struct tfx_header *header)
{
    uint64_t n = (uint64_t)header->n_strands * header->n_vertices;
    groom_status status =
        input_skip(reader->in, header->positions - input_offset(reader->in), "the positions", reader->diag);
    if (status == GROOM_OK && n > UINT32_MAX)
        return groom_fail_at(reader->diag, GROOM_ETOOBIG, 4, "%u strands of %u vertices are more than 2^32-1",
                             header->n_strands, header->n_vertices);
    if (status == GROOM_OK)
        status = read_expect(reader, header->n_strands, n, n * header->stride);
    for (uint32_t i = 0; i < header->n_strands && status == GROOM_OK; i++) {
        status = read_points_f32(reader, header->n_vertices, header->stride, "a vertex position");
        if (status == GROOM_OK)
            status = read_cut(reader, header->n_vertices);
    }
    return status;
}

static groom_status read_strand_uv(struct reader *reader, const struct tfx_header *header)
{
    groom_status status;
    if (header->strand_uv == 0)
        return GROOM_OK;
    if (header->strand_uv < input_offset(reader->in)) {
        report_warn(reader->report, "the strands' texture coordinates stand before the positions: not read");
        return GROOM_OK;
    }
    status = input_skip(reader->in, header->strand_uv - input_offset(reader->in), "texture coordinates",
                        reader->diag);
    for (uint32_t i = 0; i < header->n_strands && status == GROOM_OK;) {
        const unsigned char *uv;
        size_t n;
        status =
            input_records(reader->in, 8, header->n_strands - i, "texture coordinates", &uv, &n, reader->diag);
        for (size_t j = 0; status == GROOM_OK && j < n; j++, i++)
            if (!builder_root_uv(reader->out, input_f32(uv + 8 * j), input_f32(uv + 8 * j + 4)))
                return builder_fail(reader->out, input_offset(reader->in), reader->diag);
    }
    return status;
}

static groom_status read_binary(struct reader *reader)
{
    struct tfx_header header = {0};
    groom_status status = read_header(reader, &header);
    if (status != GROOM_OK)
        return status;
    if (header.n_strands > 0 && header.n_vertices < 2)
        return groom_fail_at(reader->diag, GROOM_EFORMAT, 8,
                             "strands of %u vertices (byte 8); 2 are the least", header.n_vertices);
    reader->out->keeps_root_uv = header.strand_uv != 0;
    if ((status = read_positions(reader, &header)) != GROOM_OK)
        return status;
    return read_strand_uv(reader, &header);
}

/* --- 2: text ------------------------------------------------------------------------------ */

static groom_status expect_word(struct text *text, const char *expected, struct groom_diag *diag)
{
    size_t n = strlen(expected);
    text_skip_space(text);
    text_ready(text);
    if (strncmp((const char *)text->p, expected, n) != 0)
        return text_fail(text, expected, diag);
    text->p += n;
    return GROOM_OK;
}

static groom_status expect_number(struct text *text, const char *what, double *value, struct groom_diag *diag)
{
    for (text_skip_space(text); text_peek(text) == ','; text_skip_space(text))
        text->p++;
    return text_number(text, value) ? GROOM_OK : text_fail(text, what, diag);
}

static groom_status expect_count(struct text *text, const char *what, long long *value,
                                 struct groom_diag *diag)
{
    text_skip_space(text);
    text_ready(text);
    const unsigned char *begin = text->p;
    if (!text_integer(text, value) || *value < 0) {
        text->p = begin; /* the place to name */
        return text_fail(text, what, diag);
    }
    return GROOM_OK;
}

static groom_status read_text_vertices(struct reader *reader, struct text *text, long long n)
{
    for (long long i = 0; i < n; i++) {
        double x[3];
        for (int k = 0; k < 3; k++) {
            groom_status status = expect_number(text, "a coordinate of a vertex", &x[k], reader->diag);
            if (status != GROOM_OK)
                return status;
        }
        if (!builder_point(reader->out, x[0], x[1], x[2]))
            return builder_fail(reader->out, text_offset(text), reader->diag);
    }
    return GROOM_OK;
}

/* "strand I numVerts N [texcoord U V]" and its vertices; the word "strand" is read already */
static groom_status read_text_strand(struct reader *reader, struct text *text)
{
    long long ordinal, n;
    double uv[2];
    groom_status status;
    if ((status = expect_count(text, "the number of the strand", &ordinal, reader->diag)) != GROOM_OK ||
        (status = expect_word(text, "numVerts", reader->diag)) != GROOM_OK ||
        (status = expect_count(text, "the count of vertices", &n, reader->diag)) != GROOM_OK)
        return status;
    text_skip_blank(text);
    if (text_peek(text) == 't') {
        if ((status = expect_word(text, "texcoord", reader->diag)) != GROOM_OK ||
            (status = expect_number(text, "a texture coordinate", &uv[0], reader->diag)) != GROOM_OK ||
            (status = expect_number(text, "a texture coordinate", &uv[1], reader->diag)) != GROOM_OK)
            return status;
        if (!builder_root_uv(reader->out, (float)uv[0], (float)uv[1]))
            return builder_fail(reader->out, text_offset(text), reader->diag);
    }
    if ((status = read_text_vertices(reader, text, n)) != GROOM_OK)
        return status;
    return builder_cut(reader->out, (uint64_t)n) ? GROOM_OK
                                                 : builder_fail(reader->out, text_offset(text), reader->diag);
}

/* "name value ..." lines up to the first strand */
static groom_status read_text_header(struct reader *reader, struct text *text, long long *n_strands)
{
    char word[40];
    *n_strands = -1;
    for (;;) {
        text_skip_space(text);
        text_ready(text);
        if (text_peek(text) < 0 || memcmp(text->p, "strand ", 7) == 0)
            return GROOM_OK;
        if (!text_word(text, word, sizeof word))
            return text_fail(text, "a name of at most 39 characters", reader->diag);
        if (strcmp(word, "numStrands") == 0) {
            groom_status status = expect_count(text, "the count of strands", n_strands, reader->diag);
            if (status != GROOM_OK)
                return status;
        }
        text_skip_line(text);
    }
}

static groom_status read_text(struct reader *reader, struct text *text)
{
    long long n_strands, n_read = 0;
    groom_status status;
    reader->out->keeps_root_uv = 1;
    if ((status = expect_word(text, "version", reader->diag)) !=
            GROOM_OK || /* the text 2, or the float 3 or 4 */
        (status = read_text_header(reader, text, &n_strands)) != GROOM_OK)
        return status;
    for (text_skip_space(text); text_peek(text) >= 0; text_skip_space(text), n_read++)
        if ((status = expect_word(text, "strand", reader->diag)) != GROOM_OK ||
            (status = read_text_strand(reader, text)) != GROOM_OK)
            return status;
    if (reader->in->status != GROOM_OK || n_read < n_strands)
        return input_fail(reader->in, "the next strand", reader->diag);
    if (n_strands >= 0 && n_read != n_strands)
        report_warn(reader->report, "the header promises %lld strands, the file holds %lld", n_strands,
                    n_read);
    return GROOM_OK;
}

groom_status read_tfx(struct reader *reader)
{
    struct text text;
    input_fill(reader->in, 4);
    if (is_binary(reader->in))
        return read_binary(reader);
    text_begin(&text, reader->in);
    groom_status status = read_text(reader, &text);
    text_end(&text);
    return status;
}
