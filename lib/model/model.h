/* What the files of this room share about a groom's memory. */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

#include <stddef.h>

#include "groom/groom.h"

struct groom_shape model_shape(const struct groom *groom);

/* How many random numbers each array of an operator of this type holds in this groom. */
size_t model_random_count(const struct groom *groom, groom_operator_type type);

/* Give `op` random arrays of its own (uninitialised), in place of whatever its pointers held; on
 * GROOM_ENOMEM they are all NULL. finish releases them. */
GROOM_MUST_CHECK groom_status model_operator_allocate(const struct groom *groom, struct groom_operator *op);
void model_operator_finish(const struct groom *groom, struct groom_operator *op);

#endif
