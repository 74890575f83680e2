/* What a retargeting does with a procedural groom beside carrying it. */
#ifndef WORKER_RETARGET_GROOM_H
#define WORKER_RETARGET_GROOM_H

#include "groom/groom.h"

/* The groom without the strands that balding gives up; *kept is the caller's.
 * returns  GROOM_EINVAL where a layer is enabled: it looks at whole dense strands */
GROOM_MUST_CHECK groom_status retarget_groom_without(const struct groom *groom, const unsigned char *bald,
                                                     const struct groom_context *context, struct groom **kept,
                                                     struct groom_diag *diag);

/* Of each strand, its length after over that before, as its operators make it (layers aside).
 * stretch  [n_strands] */
GROOM_MUST_CHECK groom_status retarget_groom_stretch(const struct groom *before, const struct groom *after,
                                                     const struct groom_context *context, float *stretch,
                                                     struct groom_diag *diag);

#endif
