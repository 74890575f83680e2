/* Records of a count and that many points: USC-HairSalon's .data (12 bytes a point; HairNet's
 * variant adds an i32 visibility, 16) and CT2Hair's .bin (28: position, tangent, label). */
#include "strands/reader.h"
#include "strands/recognise.h"

static groom_status read_count(struct reader *reader, const char *what, uint32_t *count)
{
    const unsigned char *bytes;
    uint64_t offset = input_offset(reader->in);
    groom_status status = input_take(reader->in, 4, what, &bytes, reader->diag);
    if (status != GROOM_OK)
        return status;
    *count = input_u32(bytes);
    if (*count > INT32_MAX)
        return groom_fail_at(reader->diag, GROOM_EFORMAT, (int64_t)offset, "%s at byte %llu is %d", what,
                             (unsigned long long)offset, (int)*count);
    return GROOM_OK;
}

static groom_status read_record(struct reader *reader, uint32_t strand, uint32_t n_strands, size_t stride)
{
    uint32_t n;
    groom_status status = read_count(reader, "the vertex count of a strand", &n);
    if (status != GROOM_OK)
        return status;
    int64_t remaining = input_remaining(reader->in);
    uint64_t offset = input_offset(reader->in);
    if (remaining >= 0 && (uint64_t)n * stride > (uint64_t)remaining)
        return groom_fail_at(
            reader->diag, GROOM_ETRUNCATED, (int64_t)offset - 4,
            "strand %u of %u says %u vertices at byte %llu; that is %llu bytes, where %llu are left", strand,
            n_strands, n, (unsigned long long)offset - 4, (unsigned long long)n * stride,
            (unsigned long long)remaining);
    status = read_points_f32(reader, n, stride, "a vertex of a strand");
    return status == GROOM_OK ? read_cut(reader, n) : status;
}

static groom_status read_framed(struct reader *reader, size_t stride)
{
    uint32_t n_strands;
    groom_status status = read_count(reader, "the count of strands", &n_strands);
    if (status != GROOM_OK)
        return status;
    /* In a well-formed file what the counts leave are the points. */
    int64_t remaining = input_remaining(reader->in);
    uint64_t counts = UINT64_C(4) * n_strands;
    uint64_t points =
        remaining > 0 && (uint64_t)remaining > counts ? ((uint64_t)remaining - counts) / stride : 0;
    status = read_expect(reader, n_strands, points < reader->out->max_vertices ? points : 0, counts);
    for (uint32_t i = 0; i < n_strands && status == GROOM_OK; i++)
        status = read_record(reader, i, n_strands, stride);
    if (status == GROOM_OK)
        read_warn_trailing(reader);
    return status;
}

groom_status read_data(struct reader *reader)
{
    const struct input *in = reader->in;
    struct recognised found = recognise(in->buffer + in->at, input_available(in), in->source.size);
    int visibility = found.format == GROOM_FORMAT_DATA && found.stride == 16;
    if (visibility)
        report_warn(reader->report, "the visibility of each point was not kept");
    return read_framed(reader, visibility ? 16 : 12);
}

groom_status read_ct2hair(struct reader *reader) { return read_framed(reader, 28); }
