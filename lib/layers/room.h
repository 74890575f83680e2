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

/* Some of an input's strands, as an input of their own. */
struct input_part {
    struct groom_layer_input input;
    struct groom_conversion view;           /* into the whole's, or */
    struct groom_conversion *own;
    struct groom_superhelices helices;
    uint32_t *first_element, *first_vertex; /* [input.n + 1] of a view that does not begin at 0 */
};

/* A layer's list by the strands of its input: those of strand k are order[first[k]] .. order[first[k + 1] - 1]. */
struct by_strand {
    uint32_t n, n_strands;
    uint32_t *first; /* [n_strands + 1] */
    uint32_t *order; /* [n] */
};

/* One layer at work on its input, or on one block of it. */
struct work {
    const struct groom *groom;
    uint32_t index;
    const struct groom_operator *op;
    const struct groom_layer *layer;
    const struct groom_strands *before;
    const struct groom_layer_input *input;
    uint32_t begin;                            /* of the block in the whole input */
    struct groom_strands *after;               /* may be `before`: each block has read its strands before it writes them */
    struct by_strand anchors, held;            /* sculpt: the layer's anchors and contact, of the whole input */
    struct groom_sculpt_outcome *outcomes;     /* sculpt: [input n] */
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

/* All of an input but its conversion. */
groom_status input_begin(const struct groom *groom, uint32_t index, const struct groom_strands *before,
                         const struct groom_context *context, struct groom_layer_input **out, struct groom_diag *diag);

/* Strands begin .. begin + n - 1 of an input: a view of their conversion, or one made here. */
groom_status input_part_init(struct input_part *part, const struct groom_layer_input *whole, uint32_t begin, uint32_t n,
                             const struct groom_strands *before, const struct groom_context *context,
                             struct groom_diag *diag);
void input_part_finish(struct input_part *part);

/* --- at work (blocks.c) ------------------------------------------------------------- */

/* Whether each strand is changed for itself; else the whole input must have its conversion. */
int layer_is_strand_by_strand(groom_operator_type type);
/* Strands that change go into work->after; the report is added to. */
groom_status layer_run_blocks(const struct work *work);

/* --- what each does with its input's super-helices; *changed is new ----------------- */

groom_status layer_ruffle(const struct work *work, struct groom_superhelices **changed);
groom_status layer_sculpt(const struct work *work, struct groom_superhelices **changed);
groom_status layer_interpolate(const struct work *work, struct groom_superhelices **changed);
groom_status layer_curl_scale(const struct work *work, struct groom_superhelices **changed);

/* Around a sculpt's blocks: the layer's lists by strand, the outcomes; then what they tell. */
groom_status layer_sculpt_begin(struct work *work);
groom_status layer_sculpt_tell(const struct work *work);
void layer_sculpt_end(struct work *work);

/* A pointer that the library put into diag, below the layer's own place. Returns status. */
groom_status layer_place(const struct work *work, groom_status status);

#endif
