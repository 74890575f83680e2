/* POST /v1/jobs. */
#include "server/http/submission.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/handlers.h"
#include "server/http/webhook_calls.h"
#include "server/jobs/jobs.h"

static const struct job_kind *const kinds[] = {&job_kind_fit, &job_kind_retarget};
#define N_KINDS (sizeof kinds / sizeof kinds[0])

/* --- what all kinds share ------------------------------------------------------------------ */

static const struct job_kind *take_kind(struct request *request, const cJSON *body)
{
    const char *name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(body, "kind"));
    char list[160] = "";
    for (size_t i = 0, n = 0; i < N_KINDS; i++) {
        if (name && strcmp(name, kinds[i]->name) == 0)
            return kinds[i];
        n += (size_t)snprintf(list + n, sizeof list - n, "%s\"%s\"", i ? " or " : "", kinds[i]->name);
    }
    respond_bad_field(request, 400, "/kind", "kind must be %s", list);
    return NULL;
}

bool submission_only_known(struct request *request, const cJSON *body, const struct job_kind *kind)
{
    const cJSON *member;
    char pointer[96];
    cJSON_ArrayForEach(member, body)
    {
        if (router_knows("kind options priority webhook", member->string) || router_knows(kind->members, member->string))
            continue;
        snprintf(pointer, sizeof pointer, "/%.80s", member->string);
        respond_bad_field(request, 400, pointer,
                          "\"%.60s\" is not a member of a %s; it takes kind, options, priority and webhook, and of its own: %s",
                          member->string, kind->name, kind->members);
        return false;
    }
    return true;
}

bool submission_take_upload(struct request *request, const cJSON *object, const char *key, const char *pointer,
                            enum store_asset_kind kind, bool needed, cJSON *inputs)
{
    struct store_asset asset = {0};
    struct groom_diag diag = {0};
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    const char *id = cJSON_GetStringValue(item);
    if (!needed && (!item || cJSON_IsNull(item)))
        return true;
    if (!id) {
        respond_bad_field(request, 400, pointer, "a job needs \"%s\", the id of an upload", key);
        return false;
    }
    groom_status status = store_asset_get(request->service->store, request->actor.project, kind, id, &asset, &diag);
    if (status == GROOM_ENOTFOUND)
        respond_bad_field(request, 422, pointer, "there is no upload \"%.40s\"", id);
    else if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else if (!cJSON_AddStringToObject(inputs, key, id))
        respond_failure(request, status = GROOM_ENOMEM, NULL);
    store_asset_finish(&asset);
    return status == GROOM_OK;
}

static bool take_inputs(struct request *request, const cJSON *body, struct submission *submission)
{
    cJSON *inputs = cJSON_CreateObject();
    bool fine = inputs && submission->kind->take_inputs(request, body, inputs);
    if (fine && !(submission->inputs = cJSON_PrintUnformatted(inputs))) {
        respond_failure(request, GROOM_ENOMEM, NULL);
        fine = false;
    }
    cJSON_Delete(inputs);
    return fine;
}

static bool take_options(struct request *request, const cJSON *body, struct submission *submission)
{
    struct groom_diag diag = {0};
    const cJSON *given = cJSON_GetObjectItemCaseSensitive(body, "options");
    char *text = given && !cJSON_IsNull(given) ? cJSON_PrintUnformatted(given) : strdup("{}");
    groom_status status =
        text ? submission->kind->complete_options(text, strlen(text), &submission->options, &diag) : GROOM_ENOMEM;
    free(text);
    if (status == GROOM_EINVAL) {
        char pointer[sizeof diag.pointer + 8];
        snprintf(pointer, sizeof pointer, "/options%s", diag.pointer);
        respond_bad_field(request, 400, pointer, "%s", diag.detail);
    } else if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
    }
    return status == GROOM_OK;
}

static bool take_priority(struct request *request, const cJSON *body, struct submission *submission)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(body, "priority");
    if (!item)
        return true;
    double value = cJSON_IsNumber(item) ? item->valuedouble : 1e9;
    if (value < -100 || value > 100 || value > (double)(int)value || value < (double)(int)value) {
        respond_bad_field(request, 400, "/priority", "priority must be a whole number from -100 to 100");
        return false;
    }
    if (value > 0 && !(request->scopes & ACCESS_ADMIN)) {
        respond_bad_field(request, 403, "/priority",
                          "a priority above 0 goes ahead of other people's jobs: that needs the scope admin");
        return false;
    }
    submission->priority = (int32_t)value;
    return true;
}

static bool take_body(struct request *request, const cJSON *body, struct submission *submission)
{
    return (submission->kind = take_kind(request, body)) && submission_only_known(request, body, submission->kind) &&
           take_inputs(request, body, submission) && take_options(request, body, submission) &&
           take_priority(request, body, submission) &&
           webhook_take(request, body, &submission->webhook, &submission->n_webhooks);
}

/* --- the call ---------------------------------------------------------------------------------- */

static void submit(struct request *request, const struct submission *submission)
{
    struct store_job job = {0};
    struct groom_diag diag = {0};
    struct jobs_request wanted = {.kind = submission->kind->name,
                                  .inputs = submission->inputs,
                                  .options = submission->options,
                                  .priority = submission->priority,
                                  .webhook = submission->n_webhooks ? &submission->webhook : NULL};
    jobs_charge(request, &wanted);
    groom_status status = jobs_submit(request->service->jobs, &wanted, &job, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    jobs_respond(request, 202, &job);
    store_job_finish(&job);
}

void jobs_call_post(struct request *request)
{
    struct submission submission = {0};
    cJSON *body = request_json(request);
    if (body && take_body(request, body, &submission))
        submit(request, &submission);
    cJSON_Delete(body);
    free(submission.inputs);
    free(submission.options);
}
