/* The part of the work protocol that is a retargeting's alone. */
#ifndef HTTP_RETARGET_WORK_H
#define HTTP_RETARGET_WORK_H

#include "server/http/request.h"

/* Is the attempt's job a retargeting? */
bool retarget_work_is(struct request *request);
/* GET /v1/work/strands: the groom's dense strands, evaluated. */
void retarget_work_strands(struct request *request);
/* POST /v1/work/result: grooms and their uploads, and the end of the job. */
GROOM_MUST_CHECK groom_status retarget_work_result(struct request *request, const struct store_job *job,
                                                   const char *bytes, size_t n_bytes, struct groom_diag *diag);

#endif
