/* Strands that got among the wrong ones. */
#ifndef FIT_STRAYS_H
#define FIT_STRAYS_H

#include "fit/random_search.h"

/* A strand whose numbers were found for another operator guide than its own, or in another valley of its error than the
 * deepest, is farther from its target than strands usually are, and Newton's steps do not bring it back: with any one of
 * its numbers changed it would be farther still. So strands that are far off look at the operator guides around them with
 * all numbers looked for anew for each, and keep what is best.
 *
 * Of strands first .. first + count - 1, those that are several times as far off as the strand in the middle of all.
 * search   of the fit's groom
 * follow   whether they look at other operator guides than their own
 * returns  GROOM_OK, GROOM_ENOMEM: nothing has changed
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status strays_settle(struct random_search *search, uint32_t first, uint32_t count, int follow,
                                            const struct groom_context *context, struct groom_diag *diag);

#endif
