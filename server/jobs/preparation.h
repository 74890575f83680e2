/* What a retargeting works out of its source alone (groom_retarget_source), kept for its next target: found by a
 * key that names the strands, the body they are on, its skeleton, and the options that matter. */
#ifndef JOBS_PREPARATION_H
#define JOBS_PREPARATION_H

#include "server/jobs/jobs.h"

struct cJSON;

/* Adds "preparation" to an order: the blob, null where the worker is to hand one in, nothing where jobs like
 * this keep none. */
GROOM_MUST_CHECK groom_status preparation_describe(struct jobs *jobs, const struct store_job *job, struct cJSON *object,
                                                   struct groom_diag *diag);
/* Is this blob the job's? */
GROOM_MUST_CHECK groom_status preparation_is(struct jobs *jobs, const struct store_job *job, const char *sha256, bool *is,
                                             struct groom_diag *diag);
/* returns  GROOM_EINVAL where jobs like this keep none, GROOM_ECONFLICT (fenced) */
GROOM_MUST_CHECK groom_status preparation_keep(struct jobs *jobs, const struct store_attempt_ref *ref,
                                               const struct store_job *job, const char *sha256, uint64_t n_bytes,
                                               struct groom_diag *diag);

#endif
