/* Operator guides that strands may follow in place of theirs. */
#ifndef FIT_FOLLOW_H
#define FIT_FOLLOW_H

#include "groom/groom.h"

/* Of the k operator guides nearest to each place, those that some strand follows: of others, numbers tell nothing.
 * uv         [n] scalp coordinates
 * candidate  [n][k] out, UINT32_MAX: none
 * returns    GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status follow_candidates(const struct groom *groom, const float (*uv)[2], uint32_t n, uint32_t k,
                                                uint32_t *candidate, const struct groom_context *context,
                                                struct groom_diag *diag);

#endif
