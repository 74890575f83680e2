/* OBJ polylines: `v` and `l`, everything else passed over. Indices count from 1, or back from the
 * last vertex where negative. Lines of two indices (Perm writes them) are rejoined. */
#include <string.h>

#include "strands/lines.h"
#include "strands/reader.h"
#include "strands/text.h"

struct obj {
    struct text text;
    struct reader *reader;
    struct lines lines;
    uint64_t n_lines, n_faces;
};

static groom_status out_of_builder(struct obj *obj)
{
    return builder_fail(obj->reader->out, text_offset(&obj->text), obj->reader->diag);
}

/* Blanks, and line ends after a backslash. */
static void skip_blank(struct text *text)
{
    for (;;) {
        text_skip_blank(text);
        text_ready(text);
        if (text->p[0] != '\\' || (text->p[1] != '\n' && text->p[1] != '\r'))
            return;
        text->p += text->p[1] == '\r' && text->p[2] == '\n' ? 3 : 2;
    }
}

static groom_status read_vertex(struct obj *obj)
{
    double x[3];
    for (int k = 0; k < 3; k++) {
        skip_blank(&obj->text);
        if (!text_number(&obj->text, &x[k]))
            return text_fail(&obj->text, "a coordinate of a vertex", obj->reader->diag);
    }
    return builder_point(obj->reader->out, x[0], x[1], x[2]) ? GROOM_OK : out_of_builder(obj);
}

static int at_line_end(struct obj *obj)
{
    skip_blank(&obj->text);
    int c = text_peek(&obj->text);
    return c < 0 || c == '\n' || c == '#';
}

/* "7", "7/3" or "-1" */
static groom_status read_index(struct obj *obj, uint32_t *index)
{
    long long i, texture;
    uint64_t offset = text_offset(&obj->text), n = obj->reader->out->points.n;
    if (!text_integer(&obj->text, &i))
        return text_fail(&obj->text, "a vertex index", obj->reader->diag);
    if (*obj->text.p == '/') {
        obj->text.p++;
        if (!text_integer(&obj->text, &texture) && *obj->text.p > ' ')
            return text_fail(&obj->text, "a texture index", obj->reader->diag);
    }
    long long from_zero = i < 0 ? (long long)n + i : i - 1;
    if (i == 0 || from_zero < 0 || (uint64_t)from_zero >= n)
        return groom_fail_at(obj->reader->diag, GROOM_EFORMAT, (int64_t)offset,
                             "the line at byte %llu uses vertex %lld, where %llu are given before it",
                             (unsigned long long)offset, i, (unsigned long long)n);
    *index = (uint32_t)from_zero;
    return GROOM_OK;
}

static groom_status read_line(struct obj *obj)
{
    uint32_t first, second, index;
    groom_status status;
    skip_blank(&obj->text);
    if ((status = read_index(obj, &first)) != GROOM_OK)
        return status;
    obj->n_lines++;
    if (at_line_end(obj))
        return lines_begin(&obj->lines, first) ? GROOM_OK : out_of_builder(obj);
    if ((status = read_index(obj, &second)) != GROOM_OK)
        return status;
    if (at_line_end(obj))
        return lines_edge(&obj->lines, first, second) ? GROOM_OK : out_of_builder(obj);
    if (!lines_begin(&obj->lines, first) || !lines_continue(&obj->lines, second))
        return out_of_builder(obj);
    do {
        if ((status = read_index(obj, &index)) != GROOM_OK)
            return status;
        if (!lines_continue(&obj->lines, index))
            return out_of_builder(obj);
    } while (!at_line_end(obj));
    return GROOM_OK;
}

static groom_status read_statement(struct obj *obj)
{
    groom_status status = GROOM_OK;
    text_skip_space(&obj->text);
    text_ready(&obj->text);
    if (text_peek(&obj->text) < 0)
        return GROOM_OK;
    const unsigned char *p = obj->text.p;
    int has_blank = p[0] && (p[1] == ' ' || p[1] == '\t');
    if (has_blank && p[0] == 'v') {
        obj->text.p++;
        status = read_vertex(obj);
    } else if (has_blank && p[0] == 'l') {
        obj->text.p++;
        status = read_line(obj);
    } else {
        obj->n_faces += has_blank && p[0] == 'f';
    }
    if (status == GROOM_OK)
        text_skip_line(&obj->text);
    return status;
}

static groom_status refuse_no_lines(struct obj *obj)
{
    if (obj->reader->out->points.n == 0 && obj->n_faces == 0)
        return groom_fail_at(obj->reader->diag, GROOM_EFORMAT, 0,
                             "this is no strand file: text without a vertex (\"v\") or a line (\"l\") of OBJ in it");
    return groom_fail_at(obj->reader->diag, GROOM_EFORMAT, (int64_t)text_offset(&obj->text),
                         "%llu vertices and %llu faces but no line (\"l\") by byte %llu: %s",
                         (unsigned long long)obj->reader->out->points.n, (unsigned long long)obj->n_faces,
                         (unsigned long long)text_offset(&obj->text),
                         obj->n_faces ? "this is a mesh; upload it as a head" : "strands were expected");
}

groom_status read_obj(struct reader *reader)
{
    struct obj obj = {.reader = reader};
    groom_status status = GROOM_OK;
    lines_init(&obj.lines, reader->out, memory_allocator(reader->context));
    text_begin(&obj.text, reader->in);
    while (status == GROOM_OK && text_peek(&obj.text) >= 0)
        status = read_statement(&obj);
    text_end(&obj.text);
    if (status == GROOM_OK && reader->in->status != GROOM_OK)
        status = input_fail(reader->in, "the next statement", reader->diag);
    else if (status == GROOM_OK && obj.n_lines == 0)
        status = refuse_no_lines(&obj);
    else if (status == GROOM_OK && !lines_cut(&obj.lines))
        status = out_of_builder(&obj);
    lines_finish(&obj.lines);
    return status;
}
