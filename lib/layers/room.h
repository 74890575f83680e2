/* What the files of this room share: a layer at work. */
#ifndef LAYERS_ROOM_H
#define LAYERS_ROOM_H

#include "groom/curvature.h"
#include "groom/layers.h"

struct groom_layer_input {
    const struct groom_allocator *allocator;
    uint32_t n_elements;                  /* that were asked for */
    uint32_t n;                           /* strands in it */
    uint32_t *strand;                     /* [n] rising */
    struct groom_conversion *conversion;  /* of these */
    struct groom_clusters *clusters;      /* of all strands, or NULL */
    uint64_t cluster_seed;
};

/* One layer at work on its input. */
struct work {
    const struct groom *groom;
    uint32_t index;
    const struct groom_operator *op;
    const struct groom_layer *layer;
    const struct groom_strands *before;
    const struct groom_layer_input *input;
    const struct groom_bvh *head;              /* sculpt: or NULL */
    struct groom_layer_anchors *contact;       /* sculpt: where to put what holds strands outside, or NULL */
    const struct groom_context *context;
    struct groom_layer_report *report;
    struct groom_diag *diag;
};

/* --- which strands (input.c) ------------------------------------------------------ */

/* The group of each strand of the groom; NULL: all are one. *n: how many groups. */
const uint32_t *input_groups(const struct groom *groom, const struct groom_layer *layer,
                             const struct groom_clusters *clusters, uint32_t *n);

/* --- what each does with its input's super-helices; *changed is new ----------------- */

groom_status layer_ruffle(const struct work *work, struct groom_superhelices **changed);
groom_status layer_sculpt(const struct work *work, struct groom_superhelices **changed);
groom_status layer_interpolate(const struct work *work, struct groom_superhelices **changed);
groom_status layer_curl_scale(const struct work *work, struct groom_superhelices **changed);

/* A pointer that the library put into diag, below the layer's own place. Returns status. */
groom_status layer_place(const struct work *work, groom_status status);

#endif
