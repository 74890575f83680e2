/* Stage `randoms` by the paper's own method, as a reference (Chang et al. 2025, Section 5.6). */
#ifndef FIT_PAPER_RANDOMS_H
#define FIT_PAPER_RANDOMS_H

#include "fit/state.h"

/* The next steps of gradient descent, from fit->iteration on, until a second's work is done or
 * options.stages.randoms.iterations are reached. The fit keeps Adam's moments in between; after the last
 * one they are gone.
 * returns  GROOM_OK, GROOM_ENOMEM: the fit stands as before */
GROOM_MUST_CHECK groom_status paper_randoms_step(struct groom_fit *fit, const struct groom_context *context,
                                                 struct groom_diag *diag);

/* How many moments the fit must hold between two such steps. */
uint32_t paper_randoms_moments(const struct groom_fit *fit);

#endif
