#include "strands/builder.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "strands/input.h"

void report_warn(struct groom_read_report *report, const char *format, ...)
{
    va_list arguments;
    if (report->n_warnings == GROOM_READ_MAX_WARNINGS)
        return;
    va_start(arguments, format);
    vsnprintf(report->warnings[report->n_warnings++], sizeof report->warnings[0], format, arguments);
    va_end(arguments);
}

void builder_init(struct builder *builder, const struct groom_read_options *options,
                  const struct groom_context *context, struct groom_read_report *report)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    *builder = (struct builder){.report = report,
                                .unit_m = options->frame.unit_m > 0 ? options->frame.unit_m : 1,
                                .z_up = options->frame.up == GROOM_UP_Z,
                                .max_vertices = options->max_vertices && options->max_vertices < UINT32_MAX
                                                    ? options->max_vertices
                                                    : UINT32_MAX};
    chunks_init(&builder->points, allocator, 3 * sizeof(float));
    chunks_init(&builder->first, allocator, sizeof(uint32_t));
    chunks_init(&builder->root_uv, allocator, 2 * sizeof(float));
    chunks_init(&builder->dropped, allocator, sizeof(uint32_t));
}

void builder_finish(struct builder *builder)
{
    chunks_finish(&builder->points);
    chunks_finish(&builder->first);
    chunks_finish(&builder->root_uv);
    chunks_finish(&builder->dropped);
}

groom_status builder_fail(const struct builder *builder, uint64_t offset, struct groom_diag *diag)
{
    if (builder->status == GROOM_ETOOBIG)
        return groom_fail_at(diag, GROOM_ETOOBIG, (int64_t)offset,
                             "more than %llu vertices by byte %llu, which is the limit here",
                             (unsigned long long)builder->max_vertices, (unsigned long long)offset);
    return groom_fail_at(diag, GROOM_ENOMEM, (int64_t)offset,
                         "memory ran out at byte %llu, after %llu vertices", (unsigned long long)offset,
                         (unsigned long long)builder->points.n);
}

static int fail(struct builder *builder, groom_status status)
{
    builder->status = status;
    return 0;
}

int builder_reserve(struct builder *builder, uint64_t n_strands, uint64_t n_vertices)
{
    if (n_vertices > builder->max_vertices || n_strands >= UINT32_MAX)
        return fail(builder, GROOM_ETOOBIG);
    if (!chunks_reserve(&builder->points, n_vertices) || !chunks_reserve(&builder->first, n_strands + 1))
        return fail(builder, GROOM_ENOMEM);
    return 1;
}

/* --- points ------------------------------------------------------------------- */

/* Metres and y up; what is too far away (or NaN) gets an infinite x, and falls with its strand. */
static inline void convert(const struct builder *builder, float out[3], double x, double y, double z)
{
    double a = x * builder->unit_m, b = y * builder->unit_m, c = z * builder->unit_m;
    int near =
        fabs(a) <= BUILDER_FARTHEST_M && fabs(b) <= BUILDER_FARTHEST_M && fabs(c) <= BUILDER_FARTHEST_M;
    out[0] = near ? (float)a : INFINITY;
    out[1] = (float)(builder->z_up ? c : b);
    out[2] = (float)(builder->z_up ? -b : c);
}

/* The same for packed floats, in loops that the compiler vectorizes. */
static void scale_packed(const struct builder *builder, float *out, const unsigned char *bytes, size_t n)
{
    memcpy(out, bytes, n * sizeof *out);
    if (builder->unit_m != 1)
        for (size_t i = 0; i < n; i++)
            out[i] = (float)(out[i] * builder->unit_m);
}

static int all_near(const float *values, size_t n)
{
    const float farthest = (float)BUILDER_FARTHEST_M;
    uint32_t limit, far = 0;
    memcpy(&limit, &farthest, sizeof limit);
    for (size_t i = 0; i < n; i++) { /* of positive floats the bits are in order, NaN last */
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        far |= (bits & 0x7fffffff) > limit;
    }
    return !far;
}

static void convert_records(const struct builder *builder, float (*out)[3], const unsigned char *bytes,
                            size_t n, size_t stride)
{
    if (stride == sizeof *out && !builder->z_up) {
        scale_packed(builder, out[0], bytes, 3 * n);
        if (all_near(out[0], 3 * n))
            return;
    }
    for (size_t i = 0; i < n; i++, bytes += stride)
        convert(builder, out[i], (double)input_f32(bytes), (double)input_f32(bytes + 4),
                (double)input_f32(bytes + 8));
}

static int make_room(struct builder *builder)
{
    if (builder->points.n < builder->points.n_room)
        return 1;
    if (builder->points.n > builder->max_vertices)
        return fail(builder, GROOM_ETOOBIG);
    return chunks_grow(&builder->points) ? 1 : fail(builder, GROOM_ENOMEM);
}

int builder_point(struct builder *builder, double x, double y, double z)
{
    if (!make_room(builder))
        return 0;
    convert(builder, chunks_at(&builder->points, builder->points.n++), x, y, z);
    return 1;
}

int builder_points_f32(struct builder *builder, const unsigned char *bytes, uint64_t n, size_t stride)
{
    while (n > 0) {
        if (!make_room(builder))
            return 0;
        uint64_t room = builder->points.n_room - builder->points.n;
        uint64_t span = chunks_span(builder->points.n, n < room ? n : room);
        convert_records(builder, chunks_at(&builder->points, builder->points.n), bytes, span, stride);
        bytes += span * stride;
        builder->points.n += span;
        n -= span;
    }
    return 1;
}

int builder_repeat(struct builder *builder, uint64_t index)
{
    if (!make_room(builder))
        return 0;
    memcpy(chunks_at(&builder->points, builder->points.n), chunks_at(&builder->points, index),
           3 * sizeof(float));
    builder->points.n++;
    return 1;
}

/* --- strands ------------------------------------------------------------------ */

enum verdict { KEEP, SHORT, NOT_FINITE, NO_LENGTH };

/* Is every x finite? convert() has put what is wrong with a point there. */
static int is_finite(const struct builder *builder, uint64_t begin, uint64_t end)
{
    int finite = 1;
    for (uint64_t i = begin, span; i < end; i += span) {
        span = chunks_span(i, end - i);
        const float(*points)[3] = chunks_at(&builder->points, i);
        for (uint64_t j = 0; j < span; j++)
            finite &= points[j][0] < INFINITY;
    }
    return finite;
}

/* Of no length means that every vertex is where the first one is. */
static int has_length(const struct builder *builder, uint64_t begin, uint64_t end)
{
    const float *root = chunks_at(&builder->points, begin);
    for (uint64_t i = begin + 1; i < end; i++) {
        const float *point = chunks_at(&builder->points, i);
        if (point[0] != root[0] || point[1] != root[1] || point[2] != root[2])
            return 1;
    }
    return 0;
}

static enum verdict judge(const struct builder *builder, uint64_t n)
{
    uint64_t begin = builder->n_cut, end = begin + n;
    if (n < 2)
        return SHORT;
    if (!is_finite(builder, begin, end))
        return NOT_FINITE;
    return has_length(builder, begin, end) ? KEEP : NO_LENGTH;
}

/* Close the gap that dropped strands have left; the target is never behind the source. */
static void move_down(struct builder *builder, uint64_t n)
{
    struct chunks *points = &builder->points;
    uint64_t to = builder->n_kept, from = builder->n_cut;
    if (to == from)
        return;
    while (n > 0) {
        uint64_t span = chunks_span(to, chunks_span(from, n));
        memmove(chunks_at(points, to), chunks_at(points, from), span * points->element_size);
        to += span;
        from += span;
        n -= span;
    }
}

static int keep(struct builder *builder, uint64_t n)
{
    if (builder->n_kept + n > builder->max_vertices)
        return fail(builder, GROOM_ETOOBIG);
    uint32_t *first = chunks_push(&builder->first);
    if (!first)
        return fail(builder, GROOM_ENOMEM);
    *first = (uint32_t)builder->n_kept;
    move_down(builder, n);
    builder->n_kept += n;
    return 1;
}

static int drop(struct builder *builder, enum verdict verdict)
{
    struct groom_read_report *report = builder->report;
    report->n_dropped_short += verdict == SHORT;
    report->n_dropped_not_finite += verdict == NOT_FINITE;
    report->n_dropped_zero_length += verdict == NO_LENGTH;
    if (!builder->keeps_root_uv)
        return 1;
    uint32_t *ordinal = chunks_push(&builder->dropped);
    if (!ordinal)
        return fail(builder, GROOM_ENOMEM);
    *ordinal = (uint32_t)report->n_strands_in_file;
    return 1;
}

int builder_cut(struct builder *builder, uint64_t n)
{
    enum verdict verdict = judge(builder, n);
    if (!(verdict == KEEP ? keep(builder, n) : drop(builder, verdict)))
        return 0;
    builder->report->n_strands_in_file++;
    builder->n_cut += n;
    if (builder->n_cut == builder->points.n) /* none wait: the gap is free again */
        builder->n_cut = builder->points.n = builder->n_kept;
    return 1;
}

/* --- scalp coordinates ---------------------------------------------------------- */

int builder_root_uv(struct builder *builder, float u, float v)
{
    float *uv = chunks_push(&builder->root_uv);
    if (!uv)
        return fail(builder, GROOM_ENOMEM);
    uv[0] = u;
    uv[1] = v;
    return 1;
}

/* Take the entries of dropped strands out; 0 where the rest is not one finite pair a kept strand. */
static int compact_root_uv(struct builder *builder, uint64_t n_strands)
{
    struct chunks *uv = &builder->root_uv;
    uint64_t n_dropped = 0, n_kept = 0;
    if (uv->n != builder->report->n_strands_in_file)
        return 0;
    for (uint64_t i = 0; i < uv->n; i++) {
        const float *from = chunks_at(uv, i);
        if (n_dropped < builder->dropped.n && *(uint32_t *)chunks_at(&builder->dropped, n_dropped) == i) {
            n_dropped++;
            continue;
        }
        if (!isfinite(from[0]) || !isfinite(from[1]))
            return 0;
        memmove(chunks_at(uv, n_kept++), from, uv->element_size);
    }
    uv->n = n_kept;
    return n_kept == n_strands;
}

static int take_root_uv(struct builder *builder, struct groom_strands *strands)
{
    if (builder->root_uv.n == 0)
        return 1;
    if (!compact_root_uv(builder, strands->n_strands)) {
        report_warn(builder->report,
                    "the file's scalp coordinates are not one finite pair a strand: ignored");
        return 1;
    }
    strands->root_uv = chunks_take(&builder->root_uv);
    return strands->root_uv != NULL;
}

/* --- the result ------------------------------------------------------------------- */

static void report_dropped(struct groom_read_report *report)
{
    const struct {
        uint64_t n;
        const char *why;
    } rows[] = {{report->n_dropped_short, "fewer than two vertices"},
                {report->n_dropped_zero_length, "no length"},
                {report->n_dropped_not_finite, "a coordinate that is not finite, or beyond 1000 km"}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].n)
            report_warn(report, "%llu of %llu strands dropped: %s", (unsigned long long)rows[i].n,
                        (unsigned long long)report->n_strands_in_file, rows[i].why);
}

static groom_status refuse_empty(const struct groom_read_report *report, uint64_t offset,
                                 struct groom_diag *diag)
{
    return groom_fail_at(
        diag, GROOM_EEMPTY, (int64_t)offset, "none of the %llu strands up to byte %llu is usable%s%s",
        (unsigned long long)report->n_strands_in_file, (unsigned long long)offset,
        report->n_warnings ? ": " : "", report->n_warnings ? report->warnings[report->n_warnings - 1] : "");
}

groom_status builder_take(struct builder *builder, const struct groom_context *context, uint64_t offset,
                          struct groom_strands **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint64_t n_strands = builder->first.n, n_vertices = builder->n_kept;
    struct groom_strands *strands;
    uint32_t *end;
    report_dropped(builder->report);
    if (n_strands == 0)
        return refuse_empty(builder->report, offset, diag);

    strands = memory_array_zero(allocator, 1, sizeof *strands);
    end = chunks_push(&builder->first);
    if (!strands || !end)
        goto no_memory;
    *end = (uint32_t)n_vertices;
    builder->points.n = n_vertices;
    strands->allocator = allocator;
    strands->n_strands = (uint32_t)n_strands;
    strands->n_vertices = (uint32_t)n_vertices;
    if (!take_root_uv(builder, strands) || !(strands->first = chunks_take(&builder->first)) ||
        !(strands->points = chunks_take(&builder->points)))
        goto no_memory;
    *out = strands;
    return GROOM_OK;

no_memory:
    if (strands)
        strands->allocator = allocator;
    groom_strands_destroy(strands);
    return groom_fail(diag, GROOM_ENOMEM, "no memory for %llu strands of %llu vertices",
                      (unsigned long long)n_strands, (unsigned long long)n_vertices);
}
