/* The uploads that a job's request names, wherever they stand in it:
 *   {"strands":"str_…","head":"head_…","source":{"head":"head_…"},"targets":[{"head":"head_…"},…]} */
#ifndef JOBS_INPUTS_H
#define JOBS_INPUTS_H

#include "server/jobs/jobs.h"

struct cJSON;

/* Adds what a worker is told of each: "strands", "head", "source", "targets".
 * returns  GROOM_ENOTFOUND where one is gone */
GROOM_MUST_CHECK groom_status inputs_describe(struct jobs *jobs, const struct cJSON *request, struct cJSON *object,
                                              struct groom_diag *diag);
/* Is this blob one of them? */
GROOM_MUST_CHECK groom_status inputs_have(struct jobs *jobs, const struct cJSON *request, const char *sha256, bool *have,
                                          struct groom_diag *diag);
/* "path": where workers see the blob, if they do. */
void inputs_add_path(struct jobs *jobs, struct cJSON *object, const char *sha256);

#endif
