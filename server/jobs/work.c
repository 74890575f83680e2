/* What an attempt may ask and tell; its progress is in work_progress.c. */
#include "server/jobs/work.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include <cjson/cJSON.h>
#include <openssl/evp.h>

#include "proto/json_text.h"
#include "proto/problem.h"
#include "server/jobs/inputs.h"
#include "server/jobs/preparation.h"
#include "server/jobs/queue.h"

/* --- tokens ---------------------------------------------------------------------------- */

static void write_hex(const unsigned char *bytes, char hex[65])
{
    for (int i = 0; i < 32; i++)
        snprintf(hex + 2 * i, 3, "%02x", bytes[i]);
}

void work_hash(const void *bytes, size_t n_bytes, char hash[STORE_HASH_SIZE])
{
    unsigned char digest[EVP_MAX_MD_SIZE] = {0};
    EVP_Digest(bytes, n_bytes, digest, NULL, EVP_sha256(), NULL);
    write_hex(digest, hash);
}

groom_status work_token_make(char token[WORK_TOKEN_SIZE], char hash[STORE_HASH_SIZE])
{
    unsigned char random[32];
    if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random)
        return GROOM_EIO;
    write_hex(random, token);
    work_hash(token, strlen(token), hash);
    return GROOM_OK;
}

/* ".3" behind a token; 0 where there is nothing, or something else (which then opens nothing). */
static uint32_t read_run(const char *text)
{
    char *end;
    unsigned long run = text[0] == '.' && text[1] >= '0' && text[1] <= '9' ? strtoul(text + 1, &end, 10) : 0;
    return run > 0 && run < UINT32_MAX && *end == 0 ? (uint32_t)run : 0;
}

/* Found by its hash: how long the search takes says nothing of the token. */
groom_status work_authenticate(struct jobs *jobs, const char *token, struct store_attempt_ref *ref,
                               struct groom_diag *diag)
{
    char hash[STORE_HASH_SIZE];
    size_t n = strcspn(token, ".");
    uint32_t run = read_run(token + n);
    work_hash(token, run ? n : strlen(token), hash);
    return store_attempt_find(jobs->store, hash, run, ref, diag);
}

/* The first run has nothing to fence off. */
groom_status work_begin(struct jobs *jobs, const struct store_attempt_ref *ref, struct groom_diag *diag)
{
    return ref->run > 0 ? store_attempt_begin_run(jobs->store, ref, diag) : GROOM_OK;
}

/* --- what is to be done ------------------------------------------------------------------ */

static groom_status add_checkpoint(struct jobs *jobs, const char *job_id, cJSON *object, struct groom_diag *diag)
{
    struct store_checkpoint checkpoint;
    groom_status status = store_checkpoint_get(jobs->store, job_id, &checkpoint, diag);
    if (status == GROOM_ENOTFOUND) {
        cJSON_AddNullToObject(object, "checkpoint");
        return GROOM_OK;
    }
    if (status != GROOM_OK)
        return status;
    cJSON *item = cJSON_AddObjectToObject(object, "checkpoint");
    cJSON_AddStringToObject(item, "sha256", checkpoint.sha256);
    cJSON_AddNumberToObject(item, "bytes", (double)checkpoint.n_bytes);
    cJSON_AddNumberToObject(item, "stage", checkpoint.stage);
    inputs_add_path(jobs, item, checkpoint.sha256);
    return GROOM_OK;
}

groom_status work_describe(struct jobs *jobs, const struct store_attempt_ref *ref, char **text,
                           struct groom_diag *diag)
{
    struct store_job job = {0};
    groom_status status = store_job_get(jobs->store, ref->job_id, &job, diag);
    if (status != GROOM_OK)
        return status;
    cJSON *object = cJSON_CreateObject(), *request = cJSON_Parse(job.request);
    cJSON_AddStringToObject(object, "job", job.id);
    cJSON_AddStringToObject(object, "kind", job.kind);
    cJSON_AddNumberToObject(object, "attempt", ref->number);
    cJSON_AddItemToObject(object, "options", cJSON_Parse(job.options));
    status = inputs_describe(jobs, request, cJSON_AddObjectToObject(object, "inputs"), diag);
    if (status == GROOM_OK)
        status = add_checkpoint(jobs, job.id, object, diag);
    if (status == GROOM_OK)
        status = preparation_describe(jobs, &job, object, diag);
    cJSON_AddItemToObject(object, "request", request);
    char *printed = status == GROOM_OK ? cJSON_PrintUnformatted(object) : NULL;
    cJSON_Delete(object);
    store_job_finish(&job);
    if (status == GROOM_OK && !printed)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory to describe a job");
    if (status == GROOM_OK)
        *text = printed;
    return status;
}

groom_status work_may_read(struct jobs *jobs, const struct store_attempt_ref *ref, const char *sha256,
                           struct groom_diag *diag)
{
    struct store_job job = {0};
    struct store_checkpoint checkpoint = {0};
    bool may = false;
    groom_status status = store_job_get(jobs->store, ref->job_id, &job, diag);
    if (status != GROOM_OK)
        return status;
    cJSON *request = cJSON_Parse(job.request);
    status = inputs_have(jobs, request, sha256, &may, diag);
    cJSON_Delete(request);
    if (status == GROOM_OK && !may)
        status = preparation_is(jobs, &job, sha256, &may, diag);
    store_job_finish(&job);
    if (status == GROOM_OK && !may &&
        (status = store_checkpoint_get(jobs->store, ref->job_id, &checkpoint, diag)) == GROOM_OK)
        may = strcmp(checkpoint.sha256, sha256) == 0;
    if (status == GROOM_OK && !may)
        status = GROOM_ENOTFOUND;
    if (status == GROOM_ENOTFOUND)
        return groom_fail(diag, status, "this job has no blob %.64s", sha256);
    return status;
}

/* --- what it hands in ------------------------------------------------------------------------ */

groom_status work_checkpoint(struct jobs *jobs, const struct store_attempt_ref *ref, const char *sha256,
                             uint64_t n_bytes, uint32_t stage, struct groom_diag *diag)
{
    struct store_checkpoint checkpoint = {.n_bytes = n_bytes, .stage = stage};
    char replaced[STORE_HASH_SIZE] = "";
    strncpy(checkpoint.sha256, sha256, STORE_HASH_SIZE - 1);
    groom_status status = store_attempt_checkpoint(jobs->store, ref, &checkpoint, replaced, diag);
    blobs_unpin(jobs->blobs, sha256);
    jobs_drop_blob(jobs, status == GROOM_OK ? replaced : sha256);
    return status;
}

groom_status work_preparation(struct jobs *jobs, const struct store_attempt_ref *ref, const char *sha256,
                              uint64_t n_bytes, struct groom_diag *diag)
{
    struct store_job job = {0};
    groom_status status = store_job_get(jobs->store, ref->job_id, &job, diag);
    if (status == GROOM_OK)
        status = preparation_keep(jobs, ref, &job, sha256, n_bytes, diag);
    blobs_unpin(jobs->blobs, sha256);
    if (status != GROOM_OK)
        jobs_drop_blob(jobs, sha256);
    store_job_finish(&job);
    return status;
}

groom_status work_made(struct jobs *jobs, const struct store_attempt_ref *ref, const struct work_made *made,
                       const char *result, struct groom_diag *diag)
{
    struct store_job_move move = {.job_id = ref->job_id, .from = STORE_JOB_RUNNING, .to = STORE_JOB_SUCCEEDED,
                                  .attempt = ref->number, .attempt_state = STORE_ATTEMPT_SUCCEEDED,
                                  .result = result, .grooms = made->grooms, .n_grooms = made->n_grooms,
                                  .assets = made->assets, .n_assets = made->n_assets};
    return jobs_move(jobs, &move, diag);
}

groom_status work_edited(struct jobs *jobs, const struct store_attempt_ref *ref, const struct store_revision_new *groom,
                         uint32_t expected, const char *result, struct groom_diag *diag)
{
    struct store_job_move move = {.job_id = ref->job_id, .from = STORE_JOB_RUNNING, .to = STORE_JOB_SUCCEEDED,
                                  .attempt = ref->number, .attempt_state = STORE_ATTEMPT_SUCCEEDED,
                                  .result = result, .grooms = groom, .n_grooms = 1, .groom_expected = expected};
    return jobs_move(jobs, &move, diag);
}

groom_status work_result(struct jobs *jobs, const struct store_attempt_ref *ref,
                         const struct store_revision_new *groom, struct groom_diag *diag)
{
    char result[96];
    snprintf(result, sizeof result, "{\"groom\":\"%.31s\",\"revision\":1}", groom->groom_id);
    struct store_job_move move = {.job_id = ref->job_id, .from = STORE_JOB_RUNNING, .to = STORE_JOB_SUCCEEDED,
                                  .attempt = ref->number, .attempt_state = STORE_ATTEMPT_SUCCEEDED,
                                  .result = result, .grooms = groom, .n_grooms = 1};
    return jobs_move(jobs, &move, diag);
}

/* A name as problems have it: "/problems/out-of-memory". */
static bool is_problem_name(const char *name)
{
    return name[0] && !name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789-")];
}

/* A problem object, printed anew: what is kept, and shown as the job's error, is a problem whatever was sent. */
static groom_status read_problem(const char *body, size_t n_body, char **text, struct groom_diag *diag)
{
    struct problem problem;
    cJSON *json = cJSON_ParseWithLength(body, n_body);
    bool good = json && problem_from_json(json, &problem) && is_problem_name(problem.name) && problem.detail[0];
    cJSON_Delete(json);
    if (!good)
        return groom_fail(diag, GROOM_EINVAL,
                          "a failure is a problem object with a type (/problems/ and a-z, 0-9, -) and a detail");
    if (!problem.title[0])
        snprintf(problem.title, sizeof problem.title, "the job failed");
    if (!(*text = problem_print(&problem)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a problem");
    return GROOM_OK;
}

groom_status work_failed(struct jobs *jobs, const struct store_attempt_ref *ref, const char *body, size_t n_body,
                         struct groom_diag *diag)
{
    struct store_job job = {0};
    char *problem = NULL;
    groom_status status = store_job_get(jobs->store, ref->job_id, &job, diag);
    bool cancelled = status == GROOM_OK && job.cancel_requested;
    store_job_finish(&job);
    if (cancelled) /* it stopped because it was told to: the supervisor says so once it is gone */
        return groom_fail(diag, GROOM_ECANCELLED, "the job's cancellation was asked for");
    if (status == GROOM_OK)
        status = read_problem(body, n_body, &problem, diag);
    if (status != GROOM_OK)
        return status;
    struct store_job_move move = {.job_id = ref->job_id, .from = STORE_JOB_RUNNING, .to = STORE_JOB_FAILED,
                                  .attempt = ref->number, .attempt_state = STORE_ATTEMPT_FAILED,
                                  .error = problem};
    status = jobs_move(jobs, &move, diag);
    cJSON_free(problem);
    return status;
}

groom_status work_ended(struct jobs *jobs, const struct store_attempt_ref *ref, const char *body, size_t n_body,
                        struct groom_diag *diag)
{
    cJSON *json = json_text_parse(body, n_body, NULL);
    const char *words = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "words"));
    groom_status status = words && strlen(words) <= WORK_MAX_WORDS
                              ? store_attempt_ended(jobs->store, ref, words, diag)
                              : groom_fail_field(diag, GROOM_EINVAL, "/words",
                                                 "words are a string of at most %d bytes", WORK_MAX_WORDS);
    cJSON_Delete(json);
    if (status == GROOM_OK)
        jobs_nudge(jobs);
    return status;
}
