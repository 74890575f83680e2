/* Eq. 19 of Chang et al. 2025 and its gradient, for the paper's own method. Vertex by vertex, as the paper has
 * it: strands come with the vertices that the chain gives them. */
#ifndef FIT_GRADIENT_STRANDS_H
#define FIT_GRADIENT_STRANDS_H

#include "fit/state.h"

struct gradient_strands;

/* Of a fit's target and its options' weights. The fit is borrowed.
 * returns  GROOM_OK, GROOM_ENOMEM. Owned by the caller */
GROOM_MUST_CHECK groom_status gradient_strands_create(const struct groom_fit *fit, const struct groom_context *context,
                                                      struct gradient_strands **gradient, struct groom_diag *diag);
void gradient_strands_destroy(struct gradient_strands *gradient); /* takes NULL */

/* The loss of all strands and what it changes by with the groom's random numbers.
 * out      made for the fit's groom; its guides and instancing_weight may be NULL
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status gradient_strands_evaluate(struct gradient_strands *gradient, struct groom_gradient *out,
                                                        double *loss, const struct groom_context *context,
                                                        struct groom_diag *diag);

#endif
