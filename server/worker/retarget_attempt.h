/* An attempt of a retargeting: strands, or a procedural groom, are carried from the body they are on to others. */
#ifndef WORKER_RETARGET_ATTEMPT_H
#define WORKER_RETARGET_ATTEMPT_H

#include "server/worker/order.h"
#include "server/worker/progress_report.h"
#include "server/worker/work_link.h"

/* Does all of it, the result handed in. returns  what failed, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status retarget_attempt(struct work_link *link, const struct order *order,
                                               const struct groom_context *context, struct progress_report *report,
                                               struct groom_diag *diag);

#endif
