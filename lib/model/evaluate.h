/* groom_evaluate and groom_evaluate_gradient with the instruction set named, for the tests that
 * compare them. */
#ifndef MODEL_EVALUATE_H
#define MODEL_EVALUATE_H

#include "groom/groom.h"
#include "model/kernel.h"

GROOM_MUST_CHECK groom_status evaluate_with(enum kernel_variant variant, const struct groom *groom, uint32_t first,
                                            uint32_t count, float (*out)[3], const struct groom_context *context,
                                            struct groom_diag *diag);

GROOM_MUST_CHECK groom_status gradient_with(enum kernel_variant variant, const struct groom *groom,
                                            const uint32_t *strand, uint32_t count, struct groom_adjoint adjoint,
                                            struct groom_gradient *gradient, const struct groom_context *context,
                                            struct groom_diag *diag);

#endif
