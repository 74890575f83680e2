/* One attempt of an edit in curvature space: a layer on many strands. */
#ifndef WORKER_EDIT_ATTEMPT_H
#define WORKER_EDIT_ATTEMPT_H

#include "groom/mesh.h"
#include "server/worker/progress_report.h"

/* From the layer to the acknowledged result.
 * head     or NULL
 * returns  GROOM_OK, GROOM_ECANCELLED, what is wrong with the edit */
GROOM_MUST_CHECK groom_status edit_attempt(struct work_link *link, const struct groom_mesh *head,
                                           const struct groom_context *context, struct progress_report *report,
                                           struct groom_diag *diag);

#endif
