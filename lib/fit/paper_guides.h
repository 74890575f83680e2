/* Stage `guides` by the paper's own method, as a reference (Chang et al. 2025, Section 5.4). */
#ifndef FIT_PAPER_GUIDES_H
#define FIT_PAPER_GUIDES_H

#include "fit/state.h"

/* The next steps of descent on Eq. 7, from fit->iteration on, until a second's work is done or
 * options.stages.guides.iterations are reached; *ended with the last one. What is moved are the curvatures,
 * lengths and root angles of Eq. 10, in the paper's unit; the gradient (Eq. 8, of the strands there are)
 * and its square are averaged as Adam does, both averages filtered across guides (Eq. 9), and the second one
 * replaced by the largest of its kind. The filter is made anew with each call. The fit keeps parameters and
 * averages in between; after the last step they are gone.
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED: the fit stands as before */
GROOM_MUST_CHECK groom_status paper_guides_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                                                struct groom_diag *diag);

/* How many numbers the fit must hold between two such steps. */
uint32_t paper_guides_moments(const struct groom_fit *fit);

#endif
