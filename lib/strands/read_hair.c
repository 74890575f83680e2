/* Cem Yuksel's HAIR (www.cemyuksel.com/research/hairmodels) and MonoHair's .hair: counts first,
 * then every point. */
#include "strands/reader.h"

/* --- the list of counts -------------------------------------------------------------- */

/* u16 a strand, `extra` points more than each number says; their sum must be n_points. */
static groom_status read_counts(struct reader *reader, struct chunks *counts, uint32_t n_strands,
                                uint32_t n_points, uint32_t extra)
{
    uint64_t sum = 0;
    uint64_t begin = input_offset(reader->in);
    for (uint32_t i = 0; i < n_strands;) {
        const unsigned char *bytes;
        size_t n;
        groom_status status = input_records(reader->in, 2, n_strands - i, "the list of vertex counts", &bytes,
                                            &n, reader->diag);
        if (status != GROOM_OK)
            return status;
        for (size_t j = 0; j < n; j++) {
            uint16_t *count = chunks_push(counts);
            if (!count)
                return groom_fail(reader->diag, GROOM_ENOMEM, "no memory for %u vertex counts", n_strands);
            *count = input_u16(bytes + 2 * j);
            sum += *count + extra;
        }
        i += (uint32_t)n;
        if (sum > n_points)
            break;
    }
    if (sum != n_points)
        return groom_fail_at(
            reader->diag, GROOM_EFORMAT, (int64_t)begin,
            "the vertex counts of %u strands from byte %llu on give %s%llu points, where the header says %u",
            n_strands, (unsigned long long)begin, sum > n_points ? "at least " : "", (unsigned long long)sum,
            n_points);
    return GROOM_OK;
}

/* --- points -------------------------------------------------------------------------- */

static groom_status read_strand(struct reader *reader, uint32_t n)
{
    groom_status status = read_points_f32(reader, n, 12, "a vertex (three floats)");
    return status == GROOM_OK ? read_cut(reader, n) : status;
}

static groom_status read_strands(struct reader *reader, const struct chunks *counts, uint32_t n_strands,
                                 uint32_t extra, uint32_t uniform)
{
    for (uint32_t i = 0; i < n_strands; i++) {
        uint32_t n = counts->n ? *(const uint16_t *)chunks_at(counts, i) + extra : uniform;
        groom_status status = read_strand(reader, n);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

/* --- HAIR ---------------------------------------------------------------------------- */

enum { HAS_SEGMENTS = 1, HAS_POINTS = 2, HAS_THICKNESS = 4, HAS_TRANSPARENCY = 8, HAS_COLOUR = 16 };

struct hair_header {
    uint32_t n_strands, n_points, arrays, default_segments;
};

static groom_status read_header(struct reader *reader, struct hair_header *header)
{
    const unsigned char *bytes;
    groom_status status = input_take(reader->in, 128, "the 128 byte HAIR header", &bytes, reader->diag);
    if (status != GROOM_OK)
        return status;
    if ((bytes[0] | 32) != 'h' || (bytes[1] | 32) != 'a' || (bytes[2] | 32) != 'i' || (bytes[3] | 32) != 'r')
        return groom_fail_at(reader->diag, GROOM_EFORMAT, 0, "\"HAIR\" was expected at byte 0");
    *header = (struct hair_header){input_u32(bytes + 4), input_u32(bytes + 8), input_u32(bytes + 12),
                                   input_u32(bytes + 16)};
    if (!(header->arrays & HAS_POINTS))
        return groom_fail_at(reader->diag, GROOM_EFORMAT, 12,
                             "the array flags at byte 12 are 0x%x: no points", header->arrays);
    uint64_t uniform_points = (uint64_t)header->n_strands * ((uint64_t)header->default_segments + 1);
    if (!(header->arrays & HAS_SEGMENTS) && uniform_points != header->n_points)
        return groom_fail_at(reader->diag, GROOM_EFORMAT, 4,
                             "%u strands (byte 4) of %u segments (byte 16) are not %u points (byte 8)",
                             header->n_strands, header->default_segments, header->n_points);
    return GROOM_OK;
}

groom_status read_hair(struct reader *reader)
{
    struct hair_header header = {0};
    struct chunks counts = {0};
    groom_status status = read_header(reader, &header);
    if (status != GROOM_OK)
        return status;
    uint64_t after = ((header.arrays & HAS_THICKNESS ? 4 : 0) + (header.arrays & HAS_TRANSPARENCY ? 4 : 0) +
                      (header.arrays & HAS_COLOUR ? 12 : 0)) *
                     (uint64_t)header.n_points;
    uint64_t before = header.arrays & HAS_SEGMENTS ? UINT64_C(2) * header.n_strands : 0;
    status = read_expect(reader, header.n_strands, header.n_points,
                         before + UINT64_C(12) * header.n_points + after);
    chunks_init(&counts, memory_allocator(reader->context), sizeof(uint16_t));
    if (status == GROOM_OK && before)
        status = read_counts(reader, &counts, header.n_strands, header.n_points, 1);
    if (status == GROOM_OK)
        status = read_strands(reader, &counts, header.n_strands, 1, header.default_segments + 1);
    chunks_finish(&counts);
    if (status == GROOM_OK)
        status =
            input_skip(reader->in, after, "thickness, transparency or colour of the points", reader->diag);
    if (status == GROOM_OK)
        read_warn_trailing(reader);
    return status;
}

/* --- MonoHair -------------------------------------------------------------------------- */

groom_status read_monohair(struct reader *reader)
{
    const unsigned char *bytes;
    struct chunks counts = {0};
    groom_status status = input_take(reader->in, 8, "the counts of strands and points", &bytes, reader->diag);
    if (status != GROOM_OK)
        return status;
    uint32_t n_strands = input_u32(bytes), n_points = input_u32(bytes + 4);
    status = read_expect(reader, n_strands, n_points, UINT64_C(2) * n_strands + UINT64_C(12) * n_points);
    chunks_init(&counts, memory_allocator(reader->context), sizeof(uint16_t));
    if (status == GROOM_OK)
        status = read_counts(reader, &counts, n_strands, n_points, 0);
    if (status == GROOM_OK)
        status = read_strands(reader, &counts, n_strands, 0, 0);
    chunks_finish(&counts);
    if (status == GROOM_OK)
        read_warn_trailing(reader);
    return status;
}
