/* What other stages ask of stage `operators`. */
#ifndef FIT_OPERATORS_H
#define FIT_OPERATORS_H

#include "fit/state.h"

/* At most n_steps steps of refinement from the parameters that there are, for the guides that there are.
 * frequencies_known  those of curls, and how these differ, are right as they are
 * returns GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED; parameters are untouched on error */
GROOM_MUST_CHECK groom_status operators_refine(struct groom_fit *fit, uint32_t n_steps, int frequencies_known,
                                               const struct groom_context *context, struct groom_diag *diag);

#endif
