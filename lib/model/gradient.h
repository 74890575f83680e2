/* What the gradient's files share. */
#ifndef MODEL_GRADIENT_H
#define MODEL_GRADIENT_H

#include <stddef.h>

#include "groom/groom.h"

size_t gradient_random_count(const struct groom_gradient *gradient, uint32_t operator_index);
void gradient_zero(struct groom_gradient *gradient);
/* Whether it was made for this shape and chain. */
int gradient_matches(const struct groom_gradient *gradient, const struct groom *groom);

#endif
