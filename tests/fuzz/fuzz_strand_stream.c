/* Strands between daemon and worker, in two pieces: whatever comes, nothing is written beside the room that
 * was given, and what is whole has offsets that hold. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "proto/strand_stream.h"

#define MOST 4096

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static int make_room(void *user, struct strand_stream *stream)
{
    (void)user;
    if (stream->n_strands > MOST || stream->n_vertices > MOST)
        return 0;
    stream->first = malloc(((size_t)stream->n_strands + 1) * sizeof *stream->first);
    stream->points = malloc(stream->n_vertices * sizeof *stream->points + 1);
    return stream->first && stream->points;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct strand_stream stream = {.room = make_room};
    size_t cut = size ? data[0] % size : 0; /* of the rest: where the second piece begins */
    const char *bytes = (const char *)data + (size > 0);
    size -= size > 0;
    if (cut > size)
        cut = size;
    if (strand_stream_take(&stream, bytes, cut) && strand_stream_take(&stream, bytes + cut, size - cut) &&
        strand_stream_is_whole(&stream))
        for (uint32_t i = 0; i < stream.n_strands; i++)
            if (stream.first[i] > stream.first[i + 1] || stream.first[i + 1] > stream.n_vertices)
                abort();
    free(stream.first);
    free(stream.points);
    return 0;
}
