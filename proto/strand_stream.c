#include "proto/strand_stream.h"

#include <string.h>

static const char magic[8] = {'G', 'S', 'T', 'R', 'A', 'N', 'D', '1'};

static void put_u32(char *to, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        to[i] = (char)(value >> 8 * i & 255);
}

static uint32_t get_u32(const char *from)
{
    uint32_t value = 0;
    for (int i = 0; i < 4; i++)
        value |= (uint32_t)(unsigned char)from[i] << 8 * i;
    return value;
}

void strand_stream_head(uint32_t n_strands, uint32_t n_vertices, char head[STRAND_STREAM_HEAD])
{
    memcpy(head, magic, sizeof magic);
    put_u32(head + 8, n_strands);
    put_u32(head + 12, n_vertices);
}

static uint64_t index_bytes(uint32_t n_strands) { return 4 * ((uint64_t)n_strands + 1); }

uint64_t strand_stream_bytes(uint32_t n_strands, uint32_t n_vertices)
{
    return STRAND_STREAM_HEAD + index_bytes(n_strands) + 12 * (uint64_t)n_vertices;
}

/* As much of `bytes` as belongs to this part of the stream, which begins at `begin`. */
static size_t fill(struct strand_stream *stream, void *part, uint64_t begin, uint64_t size, const char *bytes, size_t n)
{
    uint64_t done = stream->at - begin;
    size_t taken = n < size - done ? n : (size_t)(size - done);
    memcpy((char *)part + done, bytes, taken);
    stream->at += taken;
    return taken;
}

static int read_head(struct strand_stream *stream)
{
    if (memcmp(stream->head, magic, sizeof magic) != 0)
        return 0;
    stream->n_strands = get_u32(stream->head + 8);
    stream->n_vertices = get_u32(stream->head + 12);
    return stream->n_strands < UINT32_MAX && stream->room(stream->user, stream);
}

int strand_stream_take(struct strand_stream *stream, const char *bytes, size_t n)
{
    size_t taken = 0;
    if (stream->at < STRAND_STREAM_HEAD) {
        taken = fill(stream, stream->head, 0, STRAND_STREAM_HEAD, bytes, n);
        if (stream->at < STRAND_STREAM_HEAD)
            return 1;
        if (!read_head(stream))
            return 0;
    }
    uint64_t points = STRAND_STREAM_HEAD + index_bytes(stream->n_strands);
    if (taken < n && stream->at < points)
        taken += fill(stream, stream->first, STRAND_STREAM_HEAD, index_bytes(stream->n_strands), bytes + taken, n - taken);
    if (taken < n && stream->at >= points)
        taken += fill(stream, stream->points, points, 12 * (uint64_t)stream->n_vertices, bytes + taken, n - taken);
    return taken == n; /* else there is more than was announced */
}

int strand_stream_is_whole(const struct strand_stream *stream)
{
    if (stream->at < STRAND_STREAM_HEAD || stream->at != strand_stream_bytes(stream->n_strands, stream->n_vertices))
        return 0;
    for (uint32_t i = 0; i < stream->n_strands; i++)
        if (stream->first[i] > stream->first[i + 1])
            return 0;
    return stream->first[0] == 0 && stream->first[stream->n_strands] == stream->n_vertices;
}
