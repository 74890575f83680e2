/* The inside of struct groom_retarget_source: what a retargeting keeps of the source alone. */
#ifndef RETARGET_SOURCE_H
#define RETARGET_SOURCE_H

#include "groom/retarget.h"

/* Where a particle is: on the ray from a bone's point o through the surface's point q, eta past q (Section 4.1).
 * A particle that no ray reached has no bone and moves with q, the nearest point of the surface. */
#define ANCHOR_NO_BONE UINT32_MAX

struct anchor {
    uint32_t triangle;
    float v, w;     /* weights of the triangle's second and third corner at q */
    uint32_t bone;
    uint32_t along; /* o = head + along / (2^32 - 1) (tail - head) */
    float eta;      /* metres, negative below the surface */
};

/* Neighbours of particles and their weights (Eqs. 8, 9). A row without neighbours has weights 0. */
struct graph {
    uint32_t n_rows, k;
    uint32_t *neighbour; /* [n_rows * k] */
    float *weight;       /* [n_rows * k]; a row's sum to 1 */
};

struct groom_retarget_source {
    const struct groom_strands *strands; /* borrowed */
    const struct groom_mesh *body;       /* borrowed */
    struct groom_skeleton skeleton;
    struct groom_retarget_options options;
    uint64_t inputs;          /* hash of all that it was made of */
    uint32_t longest;         /* most vertices of a strand */
    double centre[3];         /* of the body; floats of the work are relative to it */
    struct anchor *anchors;   /* [n_vertices] */
    uint64_t n_without_bone;
    uint32_t n_guides;        /* 0 in the global mode */
    uint32_t *guides;         /* [n_guides] strands, rising */
    uint8_t *is_guide;        /* [n_strands] */
    uint32_t *guide_first;    /* [n_guides + 1] where each guide begins among the particles of all guides */
    struct graph among_guides;/* rows and neighbours: particles of the guides */
    struct graph to_guides;   /* rows: all particles (guides' are empty); neighbours: particles of the guides */
    struct graph among_all;   /* rows and neighbours: all particles; where the mode or the sweeps need it */
    const struct groom_allocator *allocator;
};

/* The centre of a body, on a grid so coarse that a float less the centre loses nothing. */
void source_centre(const struct groom_mesh *body, double centre[3]);

/* An empty source of these inputs, checked; anchors and graphs are to be filled in. */
groom_status source_init(struct groom_retarget_source **source, const struct groom_strands *strands,
                         const struct groom_mesh *body, const struct groom_skeleton *skeleton, const uint32_t *regions,
                         const struct groom_retarget_options *options, const struct groom_context *context,
                         struct groom_diag *diag);
/* is_guide, guide_first and the longest strand, of guides. */
groom_status source_index_guides(struct groom_retarget_source *source, struct groom_diag *diag);
/* Whether the fine scale has any strand. */
int source_has_fine(const struct groom_retarget_source *source);

groom_status graph_init(struct graph *graph, uint32_t n_rows, uint32_t k, const struct groom_allocator *allocator);
void graph_finish(struct graph *graph, const struct groom_allocator *allocator);

/* The options and what else comes from outside, checked. */
groom_status retarget_options_check(const struct groom_retarget_options *options, struct groom_diag *diag);

/* --- what groom_retarget_source_create does, in its order ------------------------ */

/* The anchors, with regions of the skeleton's own where there are none. */
groom_status source_find_anchors(struct groom_retarget_source *source, const uint32_t *regions,
                                 const struct groom_context *context, struct groom_diag *diag);
/* Bone, surface point and distance of every particle (Eq. 2). */
groom_status anchors_find(struct groom_retarget_source *source, const uint32_t *regions,
                          const struct groom_context *context, struct groom_diag *diag);
/* The guides: of each cluster of strands the one in its middle. */
groom_status guides_choose(struct groom_retarget_source *source, const struct groom_context *context,
                           struct groom_diag *diag);
/* The graphs that the mode needs. */
groom_status neighbours_find(struct groom_retarget_source *source, const struct groom_context *context,
                             struct groom_diag *diag);

#endif
