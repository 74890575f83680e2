/* groom_strands_read: open the input, recognise the format, let its reader build the strands. */
#include <string.h>

#include "groom/format.h"
#include "strands/reader.h"
#include "strands/recognise.h"

/* --- what the readers share ------------------------------------------------------ */

groom_status read_points_f32(struct reader *reader, uint64_t n, size_t stride, const char *what)
{
    while (n > 0) {
        const unsigned char *records;
        size_t n_records;
        groom_status status = input_records(reader->in, stride, n, what, &records, &n_records, reader->diag);
        if (status != GROOM_OK)
            return status;
        if (!builder_points_f32(reader->out, records, n_records, stride))
            return builder_fail(reader->out, input_offset(reader->in), reader->diag);
        n -= n_records;
    }
    return GROOM_OK;
}

groom_status read_cut(struct reader *reader, uint64_t n)
{
    return builder_cut(reader->out, n) ? GROOM_OK
                                       : builder_fail(reader->out, input_offset(reader->in), reader->diag);
}

groom_status read_expect(struct reader *reader, uint64_t n_strands, uint64_t n_vertices, uint64_t bytes)
{
    int64_t remaining = input_remaining(reader->in);
    uint64_t offset = input_offset(reader->in);
    if (n_vertices > reader->out->max_vertices)
        return groom_fail_at(reader->diag, GROOM_ETOOBIG, (int64_t)offset,
                             "the counts before byte %llu promise %llu vertices; the limit here is %llu",
                             (unsigned long long)offset, (unsigned long long)n_vertices,
                             (unsigned long long)reader->out->max_vertices);
    if (remaining < 0)
        return GROOM_OK; /* nothing to check against: memory grows with the bytes that come */
    if (bytes > (uint64_t)remaining)
        return groom_fail_at(
            reader->diag, GROOM_ETRUNCATED, (int64_t)offset,
            "%llu strands of %llu vertices need %llu bytes from byte %llu on, where %llu are left: "
            "the counts before it are wrong or the data is cut off",
            (unsigned long long)n_strands, (unsigned long long)n_vertices, (unsigned long long)bytes,
            (unsigned long long)offset, (unsigned long long)remaining);
    return builder_reserve(reader->out, n_strands, n_vertices)
               ? GROOM_OK
               : builder_fail(reader->out, offset, reader->diag);
}

void read_warn_trailing(struct reader *reader)
{
    if (input_fill(reader->in, 1) > 0)
        report_warn(reader->report, "bytes after the last strand, from byte %llu on, were not read",
                    (unsigned long long)input_offset(reader->in));
}

/* --- the call --------------------------------------------------------------------- */

static read_function *const readers[GROOM_FORMAT_COUNT] = {
    [GROOM_FORMAT_HAIR] = read_hair, [GROOM_FORMAT_MONOHAIR] = read_monohair,
    [GROOM_FORMAT_DATA] = read_data, [GROOM_FORMAT_CT2HAIR] = read_ct2hair,
    [GROOM_FORMAT_PLY] = read_ply,   [GROOM_FORMAT_TFX] = read_tfx,
    [GROOM_FORMAT_OBJ] = read_obj,   [GROOM_FORMAT_JSON] = read_json,
    [GROOM_FORMAT_NPY] = read_npy,   [GROOM_FORMAT_NPZ] = read_npz};

static groom_status refuse_unknown(const struct input *in, const struct recognised *found,
                                   struct groom_diag *diag)
{
    if (input_available(in) == 0)
        return groom_fail_at(diag, GROOM_ETRUNCATED, 0, "the data is empty");
    return groom_fail_at(
        diag, GROOM_EUNKNOWN, 0, "%s",
        found->hint ? found->hint
                    : "the bytes from 0 on are no strand format that is read here: a magic number, text, or "
                      "counts that fit the size were expected; where they are one, name the format");
}

/* Settle which reader runs: the named one, unless the bytes are certainly something else. */
static groom_status choose(const struct input *in, groom_format named, groom_format *format,
                           struct groom_diag *diag)
{
    struct recognised found = recognise(in->buffer + in->at, input_available(in), in->source.size);
    if (in->status != GROOM_OK)
        return input_fail(in, "strands", diag);
    if (named == GROOM_FORMAT_AUTO && found.format == GROOM_FORMAT_AUTO)
        return refuse_unknown(in, &found, diag);
    if (named != GROOM_FORMAT_AUTO && found.certain && found.format != named)
        return groom_fail_at(diag, GROOM_EFORMAT, 0,
                             "the bytes from 0 on are %s, where %s was asked for; "
                             "name the right format, or none",
                             groom_format_name(found.format), groom_format_name(named));
    *format = named == GROOM_FORMAT_AUTO ? found.format : named;
    if (!readers[*format])
        return groom_fail(diag, GROOM_EINVAL, "%s is written here, not read", groom_format_name(*format));
    return GROOM_OK;
}

groom_status groom_strands_read(const struct groom_source *source, const struct groom_read_options *options,
                                const struct groom_context *context, struct groom_strands **strands,
                                struct groom_read_report *report, struct groom_diag *diag)
{
    static const struct groom_read_options defaults;
    struct groom_read_report own_report;
    struct input in = {0};
    struct builder builder = {0};
    struct reader reader = {&in, &builder, report ? report : &own_report, diag, context};
    groom_status status;

    if (!options)
        options = &defaults;
    if ((unsigned)options->format >= GROOM_FORMAT_COUNT)
        return groom_fail(diag, GROOM_EINVAL, "format %d is none", (int)options->format);
    memset(reader.report, 0, sizeof *reader.report);
    if ((status = input_init(&in, source, context, diag)) != GROOM_OK)
        return status;
    builder_init(&builder, options, context, reader.report);
    input_fill(&in, INPUT_CAPACITY);
    if ((status = choose(&in, options->format, &reader.report->format, diag)) != GROOM_OK)
        goto out;
    if ((status = readers[reader.report->format](&reader)) != GROOM_OK)
        goto out;
    input_finish(&in); /* before the strands are put together: its memory counts */
    status = builder_take(&builder, context, input_offset(&in), strands, diag);
out:
    builder_finish(&builder);
    input_finish(&in);
    return status;
}
