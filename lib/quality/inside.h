/* What of a set of strands lies inside the head. */
#ifndef QUALITY_INSIDE_H
#define QUALITY_INSIDE_H

#include "groom/quality.h"
#include "groom/spatial.h"
#include "quality/set.h"

/* returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status quality_inside(const struct quality_set *set, const struct groom_bvh *head,
                                             const struct groom_context *context, struct groom_quality_head *result,
                                             struct groom_diag *diag);

#endif
