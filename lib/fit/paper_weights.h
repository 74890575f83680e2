/* Stage `instance_weights` by the paper's own method, as a reference (Chang et al. 2025, Section 5.3). */
#ifndef FIT_PAPER_WEIGHTS_H
#define FIT_PAPER_WEIGHTS_H

#include "fit/state.h"
#include "fit/weights.h"

/* Eq. 5 of strands first .. first+count-1 by options.stages.instance_weights.iterations steps of Adam on the w
 * of Eq. 3, from the weights that they have, over the guides that they have: each strand's steps are its own,
 * so that all of them are gone through at once. Guides are the clusters' mean strands. A strand whose
 * weights nearly cancel at the end keeps those that it had.
 * loss     added to
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED: the fit stands as before; same bits for any pool */
GROOM_MUST_CHECK groom_status paper_weights_solve(struct groom_fit *fit, uint32_t first, uint32_t count,
                                                  const struct groom_context *context, struct weights_loss *loss,
                                                  struct groom_diag *diag);

#endif
