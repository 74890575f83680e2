/* Layers of a chain: ruffle, sculpt, interpolate, curl_scale, on whole dense strands in curvature space.
 *
 * Before a layer the chain is evaluated to dense strands, those that the layer may change become
 * super-helices (groom/curvature.h), the layer changes these, and they are sampled where the vertices
 * were. A strand that the layer leaves as it is keeps its vertices bit for bit. The rest of the chain
 * goes on from there.
 *
 * Everything here depends on the groom alone: the same bits for any pool, and whatever was kept from
 * the last time. A groom has passed groom_validate. */
#ifndef GROOM_LAYERS_H
#define GROOM_LAYERS_H

#include "groom/groom.h"
#include "groom/strands.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom_bvh;

/* --- the chain ------------------------------------------------------------------- */

/* The enabled layer at or after `from`; n_operators where there is none. */
uint32_t groom_next_layer(const struct groom *groom, uint32_t from);

/* All strands as operators begin..end-1 make them, none of which is an enabled layer.
 * before   what comes into operator `begin`; NULL: begin is 0, the groom's own guides or base
 * returns  GROOM_OK, GROOM_EINVAL, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_evaluate_between(const struct groom *groom, uint32_t begin, uint32_t end,
                                                     const struct groom_strands *before,
                                                     const struct groom_context *context,
                                                     struct groom_strands **strands, struct groom_diag *diag);

/* All strands, through the whole chain.
 * returns  GROOM_OK, what groom_layer_apply returns */
GROOM_MUST_CHECK groom_status groom_layers_evaluate(const struct groom *groom, const struct groom_context *context,
                                                    struct groom_strands **strands, struct groom_diag *diag);

/* --- one layer --------------------------------------------------------------------- */

/* The strands that a layer may change, as super-helices: worth keeping while its anchors or its
 * strength are moved. */
struct groom_layer_input;

/* How many strands the layer at `index` may change.
 * returns  as groom_layer_input_create */
GROOM_MUST_CHECK groom_status groom_layer_count(const struct groom *groom, uint32_t index,
                                                const struct groom_strands *before,
                                                const struct groom_context *context, uint32_t *n,
                                                struct groom_diag *diag);

/* For the layer at `index`.
 * before   the strands that come into it; borrowed for the call
 * returns  GROOM_OK, GROOM_EINVAL (a cluster that a frame moves is empty: /operators/<index>/frames/<i>/cluster),
 *          GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status groom_layer_input_create(const struct groom *groom, uint32_t index,
                                                       const struct groom_strands *before,
                                                       const struct groom_context *context,
                                                       struct groom_layer_input **input, struct groom_diag *diag);
void groom_layer_input_destroy(struct groom_layer_input *input); /* takes NULL */
/* 1: for this layer, over the same strands, it would be made the same again. */
int groom_layer_input_serves(const struct groom_layer_input *input, const struct groom *groom, uint32_t index);
size_t groom_layer_input_bytes(const struct groom_layer_input *input);
/* The strands in it, rising, and their number in *n. */
const uint32_t *groom_layer_input_strands(const struct groom_layer_input *input, uint32_t *n);

struct groom_layer_report {
    uint32_t n_strands;  /* that the layer looked at */
    uint32_t n_changed;  /* that came out other than they went in */
    float conversion_error_m; /* the worst strand's RMS distance between its vertices and its super-helix */
    struct {             /* sculpt */
        double energy_before, energy_after; /* Eq. 15, over all strands, metre^2 */
        double anchor_error_mean_m, anchor_error_max_m;
        uint32_t n_anchors, iterations_median, iterations_max;
        uint32_t n_stopped; /* that could still have gone on */
    } sculpt;
    struct {             /* sculpt, where there is a head */
        uint32_t n_checked, n_entered, n_inside; /* strands; inside: still, after they were pushed out */
        float depth_before_m, depth_after_m;     /* the deepest, beyond where it lay before the layer */
    } contact;
};

/* The layer at `index`, on these strands.
 * input    of this layer and these strands, or NULL
 * report   or NULL
 * after    the strands behind it: as many vertices each as before
 * returns  GROOM_OK, GROOM_EINVAL with a pointer below /operators/<index>, GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status groom_layer_apply(const struct groom *groom, uint32_t index,
                                                const struct groom_strands *before,
                                                const struct groom_layer_input *input,
                                                const struct groom_context *context, struct groom_strands **after,
                                                struct groom_layer_report *report, struct groom_diag *diag);

/* The same for a sculpt that is to stay outside the head: its `contact` is found anew, and the strands are
 * what groom_layer_apply makes of it then. A strand may stay as deep in the head as it was before. */
GROOM_MUST_CHECK groom_status groom_layer_apply_outside(struct groom *groom, uint32_t index,
                                                        const struct groom_strands *before,
                                                        const struct groom_layer_input *input,
                                                        const struct groom_bvh *head,
                                                        const struct groom_context *context,
                                                        struct groom_strands **after,
                                                        struct groom_layer_report *report, struct groom_diag *diag);

/* Either, on strands that are the caller's and change in place: no second copy of a head of hair.
 * strands  those that come into the layer, then those behind it; after an error any of them may have changed
 * head     a sculpt stays outside, as with groom_layer_apply_outside; NULL: as with groom_layer_apply
 * context  its progress runs over the strands
 * returns  as groom_layer_apply */
GROOM_MUST_CHECK groom_status groom_layer_change(struct groom *groom, uint32_t index, struct groom_strands *strands,
                                                 const struct groom_bvh *head, const struct groom_context *context,
                                                 struct groom_layer_report *report, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
