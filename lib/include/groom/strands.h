/* Strands: polylines of any vertex count, root first, metres, y up.
 *
 * The container is one flat array of points and an index of where each strand
 * begins, so that it is read, written and evaluated in streams:
 *
 *     strand i is points[first[i]] .. points[first[i+1] - 1]
 */
#ifndef GROOM_STRANDS_H
#define GROOM_STRANDS_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom_strands {
    uint32_t n_strands;
    uint32_t n_vertices;  /* of all strands together */
    uint32_t *first;      /* [n_strands + 1]; first[0] = 0, first[n_strands] = n_vertices */
    float (*points)[3];   /* [n_vertices], metres, y up */
    float (*root_uv)[2];  /* [n_strands] scalp coordinates that the file brought along, or NULL */
    const struct groom_allocator *allocator; /* owns the arrays */
};

/* An empty container with room for n_strands and n_vertices; arrays are uninitialised
 * but first[0] = 0, and the counts are set. Owned by the caller.
 * returns  GROOM_OK, GROOM_ETOOBIG (n_vertices above 2^32-1), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_strands_create(uint64_t n_strands, uint64_t n_vertices,
                                                   const struct groom_context *context,
                                                   struct groom_strands **strands,
                                                   struct groom_diag *diag);
void groom_strands_destroy(struct groom_strands *strands); /* takes NULL */

/* The arc length of a polyline of n points (metres; 0 for fewer than 2). */
double groom_polyline_length(const float (*points)[3], uint32_t n);

/* Resample every strand to n_vertices vertices, uniform in arc length; the first and last
 * vertices are kept exactly.
 * in       borrowed; each strand has at least 2 finite vertices
 * out      [n_strands][n_vertices][3], allocated by the caller
 * returns  GROOM_OK, GROOM_EINVAL (n_vertices < 2, a strand of fewer than 2 vertices)
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_strands_resample(const struct groom_strands *in,
                                                     uint32_t n_vertices, float (*out)[3],
                                                     const struct groom_context *context,
                                                     struct groom_diag *diag);

struct groom_strands_summary {
    uint32_t n_strands, n_vertices;
    float bbox_min[3], bbox_max[3];           /* metres */
    float length_min, length_median, length_max; /* metres of arc */
};

/* Counts, bounding box and lengths. strands holds at least one strand.
 * returns  GROOM_OK, GROOM_EEMPTY, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_strands_summarize(const struct groom_strands *strands,
                                                      const struct groom_context *context,
                                                      struct groom_strands_summary *summary,
                                                      struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
