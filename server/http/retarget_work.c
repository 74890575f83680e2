/* The work protocol of retargetings: what their attempts ask for and hand in (proto/work.h). */
#include "server/http/retarget_work.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json_text.h"
#include "server/grooms/retargeted.h"
#include "server/http/handlers.h"
#include "server/http/strand_answer.h"
#include "server/jobs/work.h"

/* The groom that the attempt's job carries. */
struct subject {
    struct store_job job;
    cJSON *request;
    const char *groom; /* NULL: it carries uploaded strands */
    uint32_t revision;
};

static groom_status subject_open(struct request *request, struct subject *subject, struct groom_diag *diag)
{
    *subject = (struct subject){0};
    groom_status status = jobs_get(request->service->jobs, request->attempt.job_id, &subject->job, diag);
    if (status != GROOM_OK)
        return status;
    subject->request = json_text_parse(subject->job.request, strlen(subject->job.request), NULL);
    const cJSON *revision = cJSON_GetObjectItemCaseSensitive(subject->request, "revision");
    subject->groom = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(subject->request, "groom"));
    subject->revision = cJSON_IsNumber(revision) ? (uint32_t)revision->valuedouble : 0;
    if (strcmp(subject->job.kind, "retarget") != 0 || !subject->groom)
        return groom_fail(diag, GROOM_ENOTFOUND, "this job carries no groom to another head");
    return GROOM_OK;
}

static void subject_close(struct subject *subject)
{
    cJSON_Delete(subject->request);
    store_job_finish(&subject->job);
}

bool retarget_work_is(struct request *request)
{
    struct store_job job = {0};
    bool is = jobs_get(request->service->jobs, request->attempt.job_id, &job, NULL) == GROOM_OK &&
              strcmp(job.kind, "retarget") == 0;
    store_job_finish(&job);
    return is;
}

void work_call_groom(struct request *request)
{
    struct subject subject;
    struct groom_diag diag = {0};
    char *json;
    size_t n_bytes;
    uint32_t number;
    groom_status status = subject_open(request, &subject, &diag);
    if (status == GROOM_OK)
        status = grooms_document(request->service->grooms, subject.groom, subject.revision, true, &json, &n_bytes, &number,
                                 &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", json, n_bytes);
    subject_close(&subject);
}

static void release_dense(void *user)
{
    grooms_dense_finish(user);
    free(user);
}

static groom_status send_strands(struct request *request, const struct subject *subject, struct groom_diag *diag)
{
    struct grooms_dense *dense = calloc(1, sizeof *dense);
    if (!dense)
        return GROOM_ENOMEM;
    groom_status status = grooms_dense(request->service->grooms, subject->groom, subject->revision, 0, dense, diag);
    if (status == GROOM_OK)
        respond_strands(request, dense->strands, release_dense, dense);
    else
        free(dense);
    return status;
}

void retarget_work_strands(struct request *request)
{
    struct subject subject;
    struct groom_diag diag = {0};
    groom_status status = subject_open(request, &subject, &diag);
    if (status == GROOM_OK)
        status = send_strands(request, &subject, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    subject_close(&subject);
}

void work_call_preparation(struct request *request)
{
    uint64_t n_bytes = request->n_received;
    char sha256[BLOBS_HASH_SIZE];
    struct groom_diag diag = {0};
    struct blobs_writer *writer = request->blob;
    request->blob = NULL;
    groom_status status = blobs_commit(writer, NULL, sha256, &diag);
    if (status == GROOM_OK)
        status = work_preparation(request->service->jobs, &request->attempt, sha256, n_bytes, &diag);
    if (status == GROOM_OK)
        respond_empty(request, 204);
    else
        respond_failure(request, status, &diag);
}

groom_status retarget_work_result(struct request *request, const struct store_job *job, const char *bytes, size_t n_bytes,
                                  struct groom_diag *diag)
{
    struct grooms_retargeted *made = calloc(1, sizeof *made);
    if (!made)
        return GROOM_ENOMEM;
    groom_status status = grooms_retargeted_take(request->service->grooms, job, bytes, n_bytes, made, diag);
    if (status == GROOM_OK) {
        const struct work_made all = {made->grooms, made->n, made->assets, made->n_assets};
        status = work_made(request->service->jobs, &request->attempt, &all, made->result, diag);
    }
    grooms_retargeted_finish(made);
    free(made);
    return status;
}
