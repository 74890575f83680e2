/* What the writers share: the layout, a buffer before the sink, and the way back to the file's frame. */
#ifndef STRANDS_WRITER_H
#define STRANDS_WRITER_H

#include <stddef.h>
#include <stdint.h>

#include "groom/format.h"

#define WRITER_BUFFER    65536
#define WRITER_MAX_PIECE 256 /* writer_room gives at most this much */

/* One a format. Points come in runs; where by_strand is set, a run is part of one strand. */
struct writer_format {
    groom_status (*begin)(struct groom_writer *writer);
    groom_status (*points)(struct groom_writer *writer, const float (*points)[3], size_t n);
    groom_status (*finish)(struct groom_writer *writer); /* or NULL */
    int by_strand;
    uint32_t max_vertices; /* of a strand */
    uint32_t max_total;    /* of the file */
};
extern const struct writer_format writer_hair, writer_data, writer_ply, writer_obj, writer_json, writer_usda;

struct groom_writer {
    const struct writer_format *format;
    struct groom_sink sink;
    const struct groom_context *context;
    double unit_m, per_metre; /* metres in a unit of the file, and the reverse */
    double width;             /* in the file's unit */
    groom_up up;
    int is_plain; /* metres and y up: nothing to convert */
    uint32_t n_strands, uniform_count;
    const uint32_t *vertex_counts; /* [n_strands] or NULL */
    uint64_t n_vertices, n_written;
    uint32_t strand, in_strand; /* by_strand: the present strand, and how many of its points are written */
    uint64_t first_of_strand;   /* OBJ: vertices before the present strand */
    float min[3], max[3];       /* of the points as written (USD) */
    size_t used;
    unsigned char buffer[WRITER_BUFFER];
};

uint32_t writer_count(const struct groom_writer *writer, uint32_t strand);

/* n bytes (n <= WRITER_MAX_PIECE) to write into; NULL with *status set where the sink fails. */
unsigned char *writer_room(struct groom_writer *writer, size_t n, groom_status *status);
static inline void writer_used(struct groom_writer *writer, size_t n) { writer->used += n; }
GROOM_MUST_CHECK groom_status writer_bytes(struct groom_writer *writer, const void *bytes, size_t n);
GROOM_MUST_CHECK groom_status writer_text(struct groom_writer *writer, const char *text);
GROOM_MUST_CHECK groom_status writer_flush(struct groom_writer *writer);

/* The point as the file says it. */
static inline void writer_convert(const struct groom_writer *writer, float out[3], const float in[3])
{
    int z_up = writer->up == GROOM_UP_Z;
    float y = z_up ? -in[2] : in[1], z = z_up ? in[1] : in[2];
    out[0] = writer->is_plain ? in[0] : (float)(in[0] * writer->per_metre);
    out[1] = writer->is_plain ? y : (float)(y * writer->per_metre);
    out[2] = writer->is_plain ? z : (float)(z * writer->per_metre);
}
/* Points as three little-endian floats each. */
GROOM_MUST_CHECK groom_status writer_points_f32(struct groom_writer *writer, const float (*points)[3],
                                                size_t n);
/* "a SEPARATOR b SEPARATOR c" into out; 0 where a value is not finite. */
size_t writer_print_point(const struct groom_writer *writer, char *out, const float point[3], char separator);
GROOM_MUST_CHECK groom_status writer_integers(struct groom_writer *writer, uint64_t first, uint64_t n,
                                              char separator);

/* The text before the data of a binary PLY; returns its length. */
#define WRITER_PLY_HEADER_MAX 512
size_t writer_ply_header(char out[WRITER_PLY_HEADER_MAX], uint32_t n_strands, uint64_t n_vertices);

#endif
