/* How far the expectation of strands is from their targets (Chang et al. 2025, Eq. 7). */
#ifndef FIT_LOSS_GUIDES_H
#define FIT_LOSS_GUIDES_H

#include "fit/state.h"

/* The chain as it is on average: clumps alone, for scale, bend, curl and frizz keep strands where they are.
 * A view: it borrows everything but the list of operators, for which `operators` has room, and is not destroyed. */
struct groom loss_guides_mean(const struct groom *groom, struct groom_operator operators[GROOM_FIT_MAX_OPERATORS]);

/* Eq. 7 a vertex, in square metres: the mean over strands and vertices of |E[x] - x^|^2.
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status loss_guides(const struct groom_fit *fit, double *loss, const struct groom_context *context,
                                          struct groom_diag *diag);

#endif
