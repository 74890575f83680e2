/* Dense strands between daemon and worker: the memory of both, one after the other, so that neither
 * copies nor converts.
 *
 *   bytes 0-7    "GSTRAND1"
 *   bytes 8-15   n strands, v vertices: u32, little-endian as all that follows
 *   then         u32[n + 1]: where each strand's vertices begin; the first is 0, the last v
 *   then         f32[v][3]: metres, y up */
#ifndef PROTO_STRAND_STREAM_H
#define PROTO_STRAND_STREAM_H

#include <stddef.h>
#include <stdint.h>

#define STRAND_STREAM_HEAD 16
#define STRAND_STREAM_TYPE "application/octet-stream"

void strand_stream_head(uint32_t n_strands, uint32_t n_vertices, char head[STRAND_STREAM_HEAD]);
uint64_t strand_stream_bytes(uint32_t n_strands, uint32_t n_vertices); /* of all */

/* What comes in, in pieces of any size. Zero-initialise, set room and user. */
struct strand_stream {
    /* The counts are known: set first and points, the caller's arrays; 0: there is no room. Called once. */
    int (*room)(void *user, struct strand_stream *stream);
    void *user;
    uint32_t n_strands, n_vertices;
    uint32_t *first;     /* [n_strands + 1] */
    float (*points)[3];  /* [n_vertices] */
    char head[STRAND_STREAM_HEAD];
    uint64_t at;         /* bytes taken */
};

/* returns  0 where this is no such stream, or there is no room */
int strand_stream_take(struct strand_stream *stream, const char *bytes, size_t n);
/* All is there, and the offsets rise from 0 to v. What the points are is not looked at. */
int strand_stream_is_whole(const struct strand_stream *stream);

#endif
