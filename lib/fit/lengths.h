/* How long the strands of a curl are, on the whole. */
#ifndef FIT_LENGTHS_H
#define FIT_LENGTHS_H

#include "groom/groom.h"

/* What strands tell is how often they wind, not over what length: all strands of a curl may be a little longer and wind as
 * much less often a metre, and hardly be farther from their targets. But their scales are drawn one by one, so that the
 * mean of many is 1: what bundles are off it by, beyond what draws would be, is taken off their strands and given to the
 * curl's frequency, such that strands wind as often (by the expectation of a normal number that is measured with a normal
 * error, whose variance is what bundles have in excess of draws).
 * curl, scale  operators of the groom, both with random numbers; the scale comes first
 * returns      GROOM_OK, GROOM_ENOMEM: nothing has changed */
GROOM_MUST_CHECK groom_status lengths_settle(struct groom *groom, struct groom_operator *curl, struct groom_operator *scale,
                                             const struct groom_allocator *allocator, struct groom_diag *diag);

#endif
