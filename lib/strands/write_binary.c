/* Binary files: HAIR, HairSalon's .data, PLY. */
#include <stdio.h>
#include <string.h>

#include "strands/writer.h"

/* --- counts -------------------------------------------------------------------------- */

/* u16 a strand: its segments */
static groom_status write_segments(struct groom_writer *writer)
{
    for (uint32_t i = 0; i < writer->n_strands; i++) {
        groom_status status = GROOM_OK;
        uint16_t segments = (uint16_t)(writer_count(writer, i) - 1);
        unsigned char *p = writer_room(writer, sizeof segments, &status);
        if (!p)
            return status;
        memcpy(p, &segments, sizeof segments);
        writer_used(writer, sizeof segments);
    }
    return GROOM_OK;
}

/* --- HAIR ------------------------------------------------------------------------------ */

static void put_u32(unsigned char *out, uint32_t value) { memcpy(out, &value, sizeof value); }
static void put_f32(unsigned char *out, float value) { memcpy(out, &value, sizeof value); }

static groom_status begin_hair(struct groom_writer *writer)
{
    unsigned char header[128] = "HAIR";
    put_u32(header + 4, writer->n_strands);
    put_u32(header + 8, (uint32_t)writer->n_vertices);
    put_u32(header + 12, 1 | 2); /* segments and points */
    put_f32(header + 20, (float)writer->width);
    for (int k = 0; k < 3; k++)
        put_f32(header + 28 + 4 * k, 0.3f);
    memcpy(header + 40, "groomd", 6);
    groom_status status = writer_bytes(writer, header, sizeof header);
    return status == GROOM_OK ? write_segments(writer) : status;
}

const struct writer_format writer_hair = {begin_hair, writer_points_f32, NULL, 0, 65536, UINT32_MAX};

/* --- .data ------------------------------------------------------------------------------- */

static groom_status begin_data(struct groom_writer *writer)
{
    return writer_bytes(writer, &writer->n_strands, sizeof writer->n_strands);
}

static groom_status points_data(struct groom_writer *writer, const float (*points)[3], size_t n)
{
    if (writer->in_strand == 0) {
        uint32_t count = writer_count(writer, writer->strand);
        groom_status status = writer_bytes(writer, &count, sizeof count);
        if (status != GROOM_OK)
            return status;
    }
    return writer_points_f32(writer, points, n);
}

const struct writer_format writer_data = {begin_data, points_data, NULL, 1, INT32_MAX, UINT32_MAX};

/* --- PLY: vertices, segments of each strand, and edges for viewers that know no strands ------- */

size_t writer_ply_header(char out[WRITER_PLY_HEADER_MAX], uint32_t n_strands, uint64_t n_vertices)
{
    return (size_t)snprintf(out, WRITER_PLY_HEADER_MAX,
                            "ply\nformat binary_little_endian 1.0\ncomment groomd strands, root first\n"
                            "element vertex %llu\nproperty float x\nproperty float y\nproperty float z\n"
                            "element strand %u\nproperty ushort nsegs\n"
                            "element edge %llu\nproperty int vertex1\nproperty int vertex2\nend_header\n",
                            (unsigned long long)n_vertices, n_strands,
                            (unsigned long long)(n_vertices - n_strands));
}

static groom_status begin_ply(struct groom_writer *writer)
{
    char header[WRITER_PLY_HEADER_MAX];
    size_t n = writer_ply_header(header, writer->n_strands, writer->n_vertices);
    return writer_bytes(writer, header, n);
}

/* From each vertex of a strand to the next, a block at a time. */
static groom_status write_strand_edges(struct groom_writer *writer, int32_t vertex, uint32_t n_edges)
{
    enum { AT_ONCE = 256 };
    int32_t edges[AT_ONCE][2];
    while (n_edges > 0) {
        uint32_t now = n_edges < AT_ONCE ? n_edges : AT_ONCE;
        for (uint32_t i = 0; i < now; i++, vertex++) {
            edges[i][0] = vertex;
            edges[i][1] = vertex + 1;
        }
        groom_status status = writer_bytes(writer, edges, now * sizeof edges[0]);
        if (status != GROOM_OK)
            return status;
        n_edges -= now;
    }
    return GROOM_OK;
}

static groom_status write_edges(struct groom_writer *writer)
{
    int32_t vertex = 0;
    for (uint32_t i = 0; i < writer->n_strands; i++) {
        groom_status status = write_strand_edges(writer, vertex, writer_count(writer, i) - 1);
        if (status != GROOM_OK)
            return status;
        vertex += (int32_t)writer_count(writer, i);
    }
    return GROOM_OK;
}

static groom_status finish_ply(struct groom_writer *writer)
{
    groom_status status = write_segments(writer);
    return status == GROOM_OK ? write_edges(writer) : status;
}

const struct writer_format writer_ply = {begin_ply, writer_points_f32, finish_ply, 0, 65536, INT32_MAX};
