/* Eq. 12 of Chang et al. 2025 and its gradient, for the paper's own method: the strand shape loss. */
#ifndef FIT_GRADIENT_SHAPE_H
#define FIT_GRADIENT_SHAPE_H

#include "fit/state.h"

struct gradient_shape;

/* Of a fit's target and its options' weight. The fit is borrowed.
 * returns  GROOM_OK, GROOM_ENOMEM. Owned by the caller */
GROOM_MUST_CHECK groom_status gradient_shape_create(const struct groom_fit *fit, const struct groom_context *context,
                                                    struct gradient_shape **gradient, struct groom_diag *diag);
void gradient_shape_destroy(struct gradient_shape *gradient); /* takes NULL */

/* The loss of all strands, along directions that are drawn anew for each iteration, and what it changes by with
 * the operators' parameters. As in fit's reports it is divided by the number of strands.
 * out      made for the fit's groom; all but operators' parameters may be NULL
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status gradient_shape_evaluate(struct gradient_shape *gradient, uint32_t iteration,
                                                      struct groom_gradient *out, double *loss,
                                                      const struct groom_context *context, struct groom_diag *diag);

#endif
