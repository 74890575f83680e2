/* Strands out of the head: the last look at what a fit has made. */
#ifndef FIT_HEAD_CLEAR_H
#define FIT_HEAD_CLEAR_H

#include "fit/random_search.h"

/* Strands first .. first + count - 1 that are in the head take Newton's steps with a stiff price on depth. Those that are
 * deeper in than the deepest of their targets come out at any cost, if need be blended from others of the guides near
 * them; those that follow their targets in, only where they come out as near to these as they were. What does not come
 * out has its own back: a groom has no vertices of single strands, and a curl is shared by all strands of its operator
 * guide, so that some stay in.
 * search   of the fit's groom; its weights are those of its last pass
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status head_clear(struct random_search *search, uint32_t first, uint32_t count,
                                         const struct groom_context *context, struct groom_diag *diag);

#endif
