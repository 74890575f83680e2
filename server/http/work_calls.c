/* The work protocol (proto/work.h): what one attempt asks and tells. The server has authenticated it:
 * request->attempt says who it is. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "proto/json_text.h"
#include "server/blobs/blobs.h"
#include "server/grooms/grooms.h"
#include "server/http/handlers.h"
#include "server/http/retarget_work.h"
#include "server/http/strand_answer.h"
#include "server/http/tool.h"
#include "server/jobs/work.h"

static void respond_done(struct request *request, groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        respond_empty(request, 204);
    else
        respond_failure(request, status, diag);
}

void work_call_job(struct request *request)
{
    char *text;
    struct groom_diag diag = {0};
    groom_status status = work_begin(request->service->jobs, &request->attempt, &diag);
    if (status == GROOM_OK)
        status = work_describe(request->service->jobs, &request->attempt, &text, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", text, strlen(text));
}

void work_call_blob(struct request *request)
{
    int fd;
    uint64_t n_bytes;
    struct groom_diag diag = {0};
    const char *sha256 = request->parameter[0];
    groom_status status = work_may_read(request->service->jobs, &request->attempt, sha256, &diag);
    if (status == GROOM_OK)
        status = blobs_read(request->service->blobs, sha256, &fd, &n_bytes, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_file(request, "application/octet-stream", fd, n_bytes);
}

void work_call_progress(struct request *request)
{
    bool cancel;
    struct groom_diag diag = {0};
    groom_status status = work_progress(request->service->jobs, &request->attempt,
                                        request->body ? request->body : "", request->n_body, &cancel, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    const char *answer = cancel ? "{\"cancel\":true}" : "{\"cancel\":false}";
    respond_static(request, 200, "application/json", answer, strlen(answer));
}

/* stage=N of a checkpoint. */
static bool stage_of(struct request *request, uint64_t *stage)
{
    if (request_query(request, "stage"))
        return request_query_number(request, "stage", 0, 1000, stage);
    respond_bad_query(request, "stage", "stage is missing: the number of stages that are done");
    return false;
}

int work_check_stage(struct request *request)
{
    uint64_t stage;
    return stage_of(request, &stage);
}

static void respond_empty_body(struct request *request)
{
    respond_refusal(request, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL),
                    "the body is empty");
}

void work_call_checkpoint(struct request *request)
{
    uint64_t stage, n_bytes = request->n_received;
    char sha256[BLOBS_HASH_SIZE];
    struct groom_diag diag = {0};
    struct blobs_writer *writer = request->blob;
    if (!stage_of(request, &stage))
        return;
    if (n_bytes == 0) {
        respond_empty_body(request);
        return;
    }
    request->blob = NULL;
    groom_status status = blobs_commit(writer, NULL, sha256, &diag);
    if (status == GROOM_OK)
        status = work_checkpoint(request->service->jobs, &request->attempt, sha256, n_bytes, (uint32_t)stage,
                                 &diag);
    respond_done(request, status, &diag);
}

/* --- the result ------------------------------------------------------------------------------ */

/* The groom says where it comes from: the job, and what that was given. What is prepared borrows from
 * the job, so that both end here. */
static groom_status take_result(struct request *request, const char *document, size_t n_bytes,
                                struct groom_diag *diag)
{
    struct store_job job = {0};
    struct grooms_prepared prepared = {0};
    groom_status status = jobs_get(request->service->jobs, request->attempt.job_id, &job, diag);
    if (status != GROOM_OK)
        return status;
    cJSON *inputs = json_text_parse(job.request, strlen(job.request), NULL);
    const struct grooms_source source = {
        .strands = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(inputs, "strands")),
        .head = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(inputs, "head")),
        .job = job.id,
        .note = job.kind};
    status = grooms_prepare(request->service->grooms, document, n_bytes, &source, &prepared, diag);
    if (status == GROOM_OK)
        status = work_result(request->service->jobs, &request->attempt, &prepared.revision, diag);
    grooms_prepared_finish(&prepared);
    cJSON_Delete(inputs);
    store_job_finish(&job);
    return status;
}

/* --- edits ----------------------------------------------------------------------------------- */

/* The attempt's job where that is an edit; false where it was refused (and answered). */
static bool take_edit(struct request *request, struct store_job *job, struct grooms_layer_job *edit)
{
    struct groom_diag diag = {0};
    groom_status status = jobs_get(request->service->jobs, request->attempt.job_id, job, &diag);
    if (status == GROOM_OK && (!strcmp(job->kind, "fit") || !strcmp(job->kind, "retarget"))) {
        status = groom_fail(&diag, GROOM_ENOTFOUND, "this job is a %s: it has no layer", job->kind);
        store_job_finish(job);
    }
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return false;
    }
    *edit = (struct grooms_layer_job){job->kind, job->request, job->options, job->project};
    return true;
}

void work_call_layer(struct request *request)
{
    struct store_job job = {0};
    struct grooms_layer_job edit;
    struct groom_diag diag = {0};
    char *json;
    if (!take_edit(request, &job, &edit))
        return;
    groom_status status = grooms_job_layer(request->service->grooms, &edit, &json, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", json, strlen(json));
    store_job_finish(&job);
}

static void release_held(void *user)
{
    grooms_release(user);
    free(user);
}

static groom_status send_strands(struct request *request, const struct grooms_layer_job *edit, struct groom_diag *diag)
{
    struct grooms_held *held = calloc(1, sizeof *held);
    if (!held)
        return GROOM_ENOMEM;
    groom_status status = grooms_job_strands(request->service->grooms, edit, held, diag);
    if (status == GROOM_OK)
        respond_strands(request, held->strands, release_held, held);
    else
        free(held);
    return status;
}

void work_call_strands(struct request *request)
{
    struct store_job job = {0};
    struct grooms_layer_job edit;
    struct groom_diag diag = {0};
    if (retarget_work_is(request)) {
        retarget_work_strands(request);
        return;
    }
    if (!take_edit(request, &job, &edit))
        return;
    groom_status status = send_strands(request, &edit, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    store_job_finish(&job);
}

static groom_status store_edited(void *user, const struct store_revision_new *next, uint32_t expected, const char *answer,
                                 struct groom_diag *diag)
{
    struct request *request = user;
    return work_edited(request->service->jobs, &request->attempt, next, expected, answer, diag);
}

/* A fit hands in a document, an edit the strands that it has made, a retargeting either for each target. */
static groom_status take_any(struct request *request, const char *bytes, size_t n_bytes, struct groom_diag *diag)
{
    struct store_job job = {0};
    groom_status status = jobs_get(request->service->jobs, request->attempt.job_id, &job, diag);
    if (status != GROOM_OK)
        return status;
    const struct grooms_layer_job edit = {job.kind, job.request, job.options, job.project};
    if (strcmp(job.kind, "fit") == 0)
        status = take_result(request, bytes, n_bytes, diag);
    else if (strcmp(job.kind, "retarget") == 0)
        status = retarget_work_result(request, &job, bytes, n_bytes, diag);
    else
        status = grooms_job_result(request->service->grooms, &edit, bytes, n_bytes, store_edited, request, diag);
    store_job_finish(&job);
    return status;
}

void work_call_result(struct request *request)
{
    struct groom_diag diag = {0};
    size_t n_bytes = (size_t)request->n_received;
    if (n_bytes == 0) {
        respond_empty_body(request);
        return;
    }
    char *document = mmap(NULL, n_bytes, PROT_READ, MAP_PRIVATE, request->body_fd, 0);
    if (document == MAP_FAILED) {
        respond_failure(request, GROOM_EIO, NULL);
        return;
    }
    groom_status status = take_any(request, document, n_bytes, &diag);
    munmap(document, n_bytes);
    respond_done(request, status, &diag);
}

void work_call_failed(struct request *request)
{
    struct groom_diag diag = {0};
    groom_status status = work_failed(request->service->jobs, &request->attempt,
                                      request->body ? request->body : "", request->n_body, &diag);
    respond_done(request, status, &diag);
}

void work_call_ended(struct request *request)
{
    struct groom_diag diag = {0};
    groom_status status = work_ended(request->service->jobs, &request->attempt,
                                     request->body ? request->body : "", request->n_body, &diag);
    respond_done(request, status, &diag);
}
