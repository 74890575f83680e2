/* groom_writer_*: checks the layout, cuts the points into runs, buffers. */
#include "strands/writer.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "base/number.h"

#define DEFAULT_WIDTH_M 0.00008

static const struct writer_format *const formats[GROOM_FORMAT_COUNT] = {
    [GROOM_FORMAT_HAIR] = &writer_hair, [GROOM_FORMAT_DATA] = &writer_data,
    [GROOM_FORMAT_PLY] = &writer_ply,   [GROOM_FORMAT_OBJ] = &writer_obj,
    [GROOM_FORMAT_JSON] = &writer_json, [GROOM_FORMAT_USDA] = &writer_usda};

/* --- buffer -------------------------------------------------------------------------- */

static groom_status send(struct groom_writer *writer, const void *bytes, size_t n)
{
    if (progress_cancelled(writer->context))
        return GROOM_ECANCELLED;
    return n ? writer->sink.write(writer->sink.user, bytes, n) : GROOM_OK;
}

groom_status writer_flush(struct groom_writer *writer)
{
    size_t n = writer->used;
    writer->used = 0;
    return send(writer, writer->buffer, n);
}

unsigned char *writer_room(struct groom_writer *writer, size_t n, groom_status *status)
{
    if (WRITER_BUFFER - writer->used < n && (*status = writer_flush(writer)) != GROOM_OK)
        return NULL;
    return writer->buffer + writer->used;
}

groom_status writer_bytes(struct groom_writer *writer, const void *bytes, size_t n)
{
    groom_status status;
    if (WRITER_BUFFER - writer->used < n && (status = writer_flush(writer)) != GROOM_OK)
        return status;
    if (n >= WRITER_BUFFER)
        return send(writer, bytes, n);
    memcpy(writer->buffer + writer->used, bytes, n);
    writer->used += n;
    return GROOM_OK;
}

groom_status writer_text(struct groom_writer *writer, const char *text)
{
    return writer_bytes(writer, text, strlen(text));
}

/* --- points --------------------------------------------------------------------------- */

/* Packed floats in the file's frame, in loops that the compiler vectorizes. */
static void convert_packed(const struct groom_writer *writer, float *restrict out,
                           const float (*restrict points)[3], size_t n)
{
    const float *in = points[0];
    double per_metre = writer->per_metre;
    if (writer->up == GROOM_UP_Y)
        for (size_t i = 0; i < 3 * n; i++)
            out[i] = (float)(in[i] * per_metre);
    else
        for (size_t i = 0; i < n; i++) {
            out[3 * i] = (float)(points[i][0] * per_metre);
            out[3 * i + 1] = (float)(-points[i][2] * per_metre);
            out[3 * i + 2] = (float)(points[i][1] * per_metre);
        }
}

groom_status writer_points_f32(struct groom_writer *writer, const float (*points)[3], size_t n)
{
    enum { AT_ONCE = 1024 };
    float converted[3 * AT_ONCE];
    if (writer->is_plain)
        return writer_bytes(writer, points, n * sizeof *points);
    while (n > 0) {
        size_t now = n < AT_ONCE ? n : AT_ONCE;
        convert_packed(writer, converted, points, now);
        groom_status status = writer_bytes(writer, converted, now * sizeof *points);
        if (status != GROOM_OK)
            return status;
        points += now;
        n -= now;
    }
    return GROOM_OK;
}

size_t writer_print_point(const struct groom_writer *writer, char *out, const float point[3], char separator)
{
    float x[3];
    char *p = out;
    writer_convert(writer, x, point);
    for (int k = 0; k < 3; k++) {
        if (!isfinite(x[k]))
            return 0;
        if (k > 0)
            *p++ = separator;
        p += number_print(p, x[k]);
    }
    return (size_t)(p - out);
}

groom_status writer_integers(struct groom_writer *writer, uint64_t first, uint64_t n, char separator)
{
    for (uint64_t i = 0; i < n; i++) {
        groom_status status = GROOM_OK;
        char *p = (char *)writer_room(writer, 24, &status);
        if (!p)
            return status;
        *p = separator;
        writer_used(writer, 1 + number_print_integer(p + 1, first + i));
    }
    return GROOM_OK;
}

uint32_t writer_count(const struct groom_writer *writer, uint32_t strand)
{
    return writer->vertex_counts ? writer->vertex_counts[strand] : writer->uniform_count;
}

/* --- creation ---------------------------------------------------------------------------- */

static groom_status check_layout(struct groom_writer *writer, groom_format format, struct groom_diag *diag)
{
    for (uint32_t i = 0; i < writer->n_strands; i++) {
        uint32_t n = writer_count(writer, i);
        if (n < 2 || n > writer->format->max_vertices)
            return groom_fail(diag, GROOM_EINVAL, "strand %u has %u vertices; %s holds strands of 2 to %u", i,
                              n, groom_format_name(format), writer->format->max_vertices);
        writer->n_vertices += n;
    }
    if (writer->n_vertices > writer->format->max_total || writer->n_strands > INT32_MAX)
        return groom_fail(diag, GROOM_EINVAL, "%llu vertices in %u strands; %s holds %u vertices at most",
                          (unsigned long long)writer->n_vertices, writer->n_strands,
                          groom_format_name(format), writer->format->max_total);
    return GROOM_OK;
}

static groom_status fail(struct groom_diag *diag, groom_status status)
{
    return groom_fail(diag, status, "writing strands failed: %s", groom_status_message(status));
}

groom_status groom_writer_create(const struct groom_write_options *options, uint32_t n_strands,
                                 const uint32_t *vertex_counts, uint32_t uniform_count,
                                 struct groom_sink sink, const struct groom_context *context,
                                 struct groom_writer **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    double unit_m = options->frame.unit_m > 0 ? options->frame.unit_m : 1;
    double width_m = options->width_m > 0 ? (double)options->width_m : DEFAULT_WIDTH_M;
    groom_status status;
    if ((unsigned)options->format >= GROOM_FORMAT_COUNT || !formats[options->format])
        return groom_fail(diag, GROOM_EINVAL, "%s cannot be written; hair, data, ply, obj, json and usda can",
                          groom_format_name(options->format));
    struct groom_writer *writer = memory_array(allocator, 1, sizeof *writer);
    if (!writer)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a writer");
    memset(writer, 0, offsetof(struct groom_writer, buffer));
    writer->format = formats[options->format];
    writer->sink = sink;
    writer->context = context;
    writer->unit_m = unit_m;
    writer->per_metre = 1 / unit_m;
    writer->width = width_m / unit_m;
    writer->is_plain = unit_m == 1 && options->frame.up == GROOM_UP_Y;
    writer->up = options->frame.up;
    writer->n_strands = n_strands;
    writer->uniform_count = uniform_count;
    writer->vertex_counts = vertex_counts;
    for (int k = 0; k < 3; k++) {
        writer->min[k] = INFINITY;
        writer->max[k] = -INFINITY;
    }
    if ((status = check_layout(writer, options->format, diag)) != GROOM_OK)
        goto out;
    if ((status = writer->format->begin(writer)) != GROOM_OK) {
        fail(diag, status);
        goto out;
    }
    *out = writer;
    writer = NULL;
out:
    groom_writer_destroy(writer);
    return status;
}

void groom_writer_destroy(struct groom_writer *writer)
{
    if (writer)
        memory_release(memory_allocator(writer->context), writer, 1, sizeof *writer);
}

/* --- points and end -------------------------------------------------------------------------- */

/* Runs that end with their strand at the latest. */
static groom_status write_by_strand(struct groom_writer *writer, const float (*points)[3], size_t n)
{
    while (n > 0) {
        uint32_t count = writer_count(writer, writer->strand), left = count - writer->in_strand;
        size_t now = n < left ? n : left;
        groom_status status = writer->format->points(writer, points, now);
        if (status != GROOM_OK)
            return status;
        writer->in_strand += (uint32_t)now;
        if (writer->in_strand == count) {
            writer->strand++;
            writer->in_strand = 0;
        }
        points += now;
        n -= now;
    }
    return GROOM_OK;
}

groom_status groom_writer_points(struct groom_writer *writer, const float (*points)[3], size_t n,
                                 struct groom_diag *diag)
{
    groom_status status;
    if (n > writer->n_vertices - writer->n_written)
        return groom_fail(diag, GROOM_EINVAL, "%zu more points than the %llu of the layout",
                          n - (size_t)(writer->n_vertices - writer->n_written),
                          (unsigned long long)writer->n_vertices);
    status = writer->format->by_strand ? write_by_strand(writer, points, n)
                                       : writer->format->points(writer, points, n);
    if (status == GROOM_EINVAL)
        return groom_fail(diag, status, "a coordinate is not finite, which a text format cannot say");
    if (status != GROOM_OK)
        return fail(diag, status);
    writer->n_written += n;
    return GROOM_OK;
}

groom_status groom_writer_finish(struct groom_writer *writer, struct groom_diag *diag)
{
    groom_status status = GROOM_OK;
    if (writer->n_written != writer->n_vertices)
        return groom_fail(diag, GROOM_EINVAL, "%llu points were written, where the layout has %llu",
                          (unsigned long long)writer->n_written, (unsigned long long)writer->n_vertices);
    if (writer->format->finish)
        status = writer->format->finish(writer);
    if (status == GROOM_OK)
        status = writer_flush(writer);
    return status == GROOM_OK ? GROOM_OK : fail(diag, status);
}

int64_t groom_writer_size(groom_format format, uint32_t n_strands, uint64_t n_vertices)
{
    char header[WRITER_PLY_HEADER_MAX];
    int64_t strands = n_strands, vertices = (int64_t)n_vertices;
    switch (format) {
    case GROOM_FORMAT_HAIR:
        return 128 + 2 * strands + 12 * vertices;
    case GROOM_FORMAT_DATA:
        return 4 + 4 * strands + 12 * vertices;
    case GROOM_FORMAT_PLY:
        return (int64_t)writer_ply_header(header, n_strands, n_vertices) + 2 * strands + 12 * vertices +
               8 * (vertices - strands);
    default:
        return -1;
    }
}

/* --- all in one ----------------------------------------------------------------------------- */

/* The vertex count of each strand, as a writer takes it. */
static groom_status make_counts(const struct groom_strands *strands, const struct groom_allocator *allocator,
                                uint32_t **counts)
{
    *counts = memory_array(allocator, strands->n_strands, sizeof **counts);
    if (!*counts)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < strands->n_strands; i++)
        (*counts)[i] = strands->first[i + 1] - strands->first[i];
    return GROOM_OK;
}

groom_status groom_strands_write(const struct groom_strands *strands,
                                 const struct groom_write_options *options, struct groom_sink sink,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    enum { AT_ONCE = 1 << 18 }; /* points between two looks at the clock of the caller */
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_writer *writer = NULL;
    uint32_t *counts;
    groom_status status = make_counts(strands, allocator, &counts);
    if (status != GROOM_OK)
        return groom_fail(diag, status, "no memory for the vertex counts of %u strands", strands->n_strands);
    status = groom_writer_create(options, strands->n_strands, counts, 0, sink, context, &writer, diag);
    for (uint32_t i = 0, n; status == GROOM_OK && i < strands->n_vertices; i += n) {
        n = strands->n_vertices - i < AT_ONCE ? strands->n_vertices - i : AT_ONCE;
        status = groom_writer_points(writer, (const float(*)[3])(strands->points + i), n, diag);
        progress_report(context, (double)(i + n) / strands->n_vertices);
    }
    if (status == GROOM_OK)
        status = groom_writer_finish(writer, diag);
    groom_writer_destroy(writer);
    memory_release(allocator, counts, strands->n_strands, sizeof *counts);
    return status;
}
