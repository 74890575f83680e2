/* What the files of this room share about a groom's memory. */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

#include <stddef.h>

#include "groom/groom.h"

#define MODEL_NEEDS_GUIDES                                                                                           \
    "%s needs operator guides, and a groom made of uploaded strands has none: it takes scale, frizz and the layers "  \
    "(fit the strands to have guides)"

struct groom_shape model_shape(const struct groom *groom);

/* Room for a base of so many vertices, in a groom that has none. returns GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status model_give_base(struct groom *groom, uint32_t n_base);
/* Where the strand's points are relative to: its root, or where its base begins. */
const float *model_root(const struct groom *groom, uint32_t strand);

/* The axes that operators lean on, or NULL: those of space. */
const float (*model_axes(const struct groom *groom))[3];

/* How many random numbers each array of an operator of this type holds in this groom. */
size_t model_random_count(const struct groom *groom, groom_operator_type type);

/* Give `op` random arrays of its own (uninitialised), in place of whatever its pointers held; on
 * GROOM_ENOMEM they are all NULL. finish releases them. */
GROOM_MUST_CHECK groom_status model_operator_allocate(const struct groom *groom, struct groom_operator *op);
void model_operator_finish(const struct groom *groom, struct groom_operator *op);

/* Make `to`, which has arrays of its own, a copy of `from` but for its random numbers.
 * returns GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status model_operator_copy(const struct groom *groom, const struct groom_operator *from,
                                                  struct groom_operator *to);

/* --- layers (layer.c) ----------------------------------------------------------- */

/* returns GROOM_OK with a layer that changes nothing, or GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status layer_create(const struct groom_allocator *allocator, struct groom_layer **layer);
void layer_destroy(struct groom_layer *layer, uint32_t n_strands, const struct groom_allocator *allocator); /* takes NULL */
/* Into one that is as layer_create left it. */
GROOM_MUST_CHECK groom_status layer_copy(const struct groom_layer *from, uint32_t n_strands,
                                         const struct groom_allocator *allocator, struct groom_layer *to);
/* The operator at `index` of the groom: all that can be told without its strands. */
GROOM_MUST_CHECK groom_status layer_validate(const struct groom *groom, uint32_t index, struct groom_diag *diag);

/* One operator, whatever it is. */
GROOM_MUST_CHECK groom_status model_validate_operator(const struct groom *groom, uint32_t index, struct groom_diag *diag);

/* The first enabled layer, or n_operators. */
uint32_t model_first_layer(const struct groom *groom);

#endif
