/* Stage `operators` by the paper's own method, as a reference (Chang et al. 2025, Section 5.5). */
#ifndef FIT_PAPER_OPERATORS_H
#define FIT_PAPER_OPERATORS_H

#include "fit/state.h"

/* The next steps of Adam, from fit->iteration on, until a second's work is done or all are; *ended with the last
 * one. Bend, curl and frizz move by the shape loss (Eqs. 11, 12), scale and clump each by its own (Eqs. 13-18),
 * options.stages.operators.alternate steps of one after those of another, each `iterations` times. Parameters
 * are moved in the paper's unit, and kept in the range that a document may hold. What the chain does not have is
 * skipped; likewise a curl or clump of size 0, which has no gradient to be found by. The fit keeps Adam's moments
 * in between; after the last step they are gone.
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED: the fit stands as before */
GROOM_MUST_CHECK groom_status paper_operators_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                                                   struct groom_diag *diag);

/* All steps of the stage, and how many moments the fit must hold between two. */
uint32_t paper_operators_iterations(const struct groom_fit *fit);
uint32_t paper_operators_moments(const struct groom_fit *fit);

#endif
