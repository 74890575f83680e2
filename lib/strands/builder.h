/* Where readers put what they find: points first, cut into strands as soon as the file says where.
 *
 * Points are converted to metres and y up as they come (in double, then rounded to float). A cut
 * keeps a strand or drops it, counting why; points that a cut has passed over are gone, so that what
 * is dropped takes no memory. */
#ifndef STRANDS_BUILDER_H
#define STRANDS_BUILDER_H

#include <stdint.h>

#include "groom/format.h"
#include "strands/chunks.h"

/* Coordinates beyond this many metres count as not finite: no head is there, and squares of
 * what comes later would overflow a float. */
#define BUILDER_FARTHEST_M 1e6

struct builder {
    struct groom_read_report *report;
    double unit_m;
    int z_up;
    uint64_t max_vertices;
    groom_status status;   /* why a call answered 0: GROOM_ENOMEM or GROOM_ETOOBIG */
    struct chunks points;  /* float[3]: kept ones, a gap, and those still to be cut */
    uint64_t n_kept;       /* points[0 .. n_kept-1] belong to kept strands */
    uint64_t n_cut;        /* points[n_cut ..] are still to be cut */
    struct chunks first;   /* uint32_t: where each kept strand begins */
    struct chunks root_uv; /* float[2] of every strand in the file, dropped ones among them */
    struct chunks dropped; /* uint32_t: ordinals of dropped strands, where root_uv matters */
    int keeps_root_uv;
};

void builder_init(struct builder *builder, const struct groom_read_options *options,
                  const struct groom_context *context, struct groom_read_report *report);
void builder_finish(struct builder *builder); /* takes a zeroed struct */

/* Exactly that much will come, by counts that were checked against the bytes that are there. */
GROOM_MUST_CHECK int builder_reserve(struct builder *builder, uint64_t n_strands, uint64_t n_vertices);

/* Points in the file's own frame; all answer 0 on failure, with builder->status set. */
GROOM_MUST_CHECK int builder_point(struct builder *builder, double x, double y, double z);
/* n points of three little-endian floats each, `stride` bytes apart. */
GROOM_MUST_CHECK int builder_points_f32(struct builder *builder, const unsigned char *bytes, uint64_t n,
                                        size_t stride);
/* A point once more, appended after all others. */
GROOM_MUST_CHECK int builder_repeat(struct builder *builder, uint64_t index);

/* How many points wait to be cut. */
static inline uint64_t builder_waiting(const struct builder *builder)
{
    return builder->points.n - builder->n_cut;
}

/* The next n waiting points (all there, or a caller's bug) are a strand of the file. */
GROOM_MUST_CHECK int builder_cut(struct builder *builder, uint64_t n);

/* Scalp coordinates of the next strand of the file; set keeps_root_uv before the first cut. */
GROOM_MUST_CHECK int builder_root_uv(struct builder *builder, float u, float v);

/* Hand the strands out; `offset` is where the input ended.
 * returns GROOM_OK, GROOM_EEMPTY, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status builder_take(struct builder *builder, const struct groom_context *context,
                                           uint64_t offset, struct groom_strands **strands,
                                           struct groom_diag *diag);

/* The failure behind an answer of 0. */
groom_status builder_fail(const struct builder *builder, uint64_t offset, struct groom_diag *diag);

/* A sentence for the report; those beyond its room are dropped. */
void report_warn(struct groom_read_report *report, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
