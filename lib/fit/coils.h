/* How many curls there are, before anything else is known of them. */
#ifndef FIT_COILS_H
#define FIT_COILS_H

#include "fit/state.h"

/* Strands of one curl wind in step, and those of two do not: of a strand's neighbours on the scalp, the first of which are
 * mostly of its curl, fewer and fewer wind in step with it. Summed over their ranks, those that do are the strands of a
 * curl. What winds is what turns within a sixth of the strand; strands are compared at equal ways from the root, for curls
 * wind by the metre.
 * n_coils  a fifth more than there seem to be; 0: neighbours do not wind in step, or curls have more than a few dozen strands
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status coils_count(const struct groom_fit *fit, const struct groom_context *context, uint32_t *n_coils,
                                          struct groom_diag *diag);

#endif
