/* Whether a head and strands were uploaded in one unit and up axis. */
#ifndef FIT_HEAD_FRAME_H
#define FIT_HEAD_FRAME_H

#include "groom/diag.h"
#include "groom/spatial.h"
#include "groom/strands.h"

/* Looks at some roots. Where hardly one is near the head, but most would be if the head were in another unit or its
 * other axis were up, that is what happened.
 * near     metres from the head that count: a quarter of the spread of the roots
 * outlier  [n_strands] nonzero: not asked
 * returns  GROOM_OK, GROOM_EINVAL at /head with the unit or axis that would fit */
GROOM_MUST_CHECK groom_status head_frame_check(const struct groom_bvh *head, const struct groom_strands *strands,
                                               const unsigned char *outlier, float near, struct groom_diag *diag);

#endif
