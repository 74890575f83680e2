/* Jobs: submit, look, wait, cancel, events, losses. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/fit.h"
#include "server/http/events.h"
#include "server/http/handlers.h"
#include "server/http/server.h"
#include "server/http/webhook_calls.h"
#include "server/jobs/jobs.h"

/* --- submit ----------------------------------------------------------------------------- */

#define QUEUE_RETRY_S 30 /* when to come again where a queue is full: fits take minutes */

/* A submission, field by field. */
struct submission {
    char *inputs, *options; /* JSON, malloc'ed */
    int32_t priority;
    struct store_webhook_new webhook; /* its texts are the body's */
    size_t n_webhooks;
};

static bool only_known(struct request *request, const cJSON *body)
{
    const cJSON *member;
    char pointer[96];
    cJSON_ArrayForEach(member, body)
    {
        if (router_knows("kind strands head options priority webhook", member->string))
            continue;
        snprintf(pointer, sizeof pointer, "/%.80s", member->string);
        respond_bad_field(
            request, 400, pointer,
            "\"%.60s\" is not a member of a job; it takes kind, strands, head, options, priority "
            "and webhook",
            member->string);
        return false;
    }
    return true;
}

/* Copies body's id of an upload into inputs, where that upload is there. */
static bool take_input(struct request *request, const cJSON *body, cJSON *inputs, const char *key,
                       enum store_asset_kind kind, bool needed)
{
    struct store_asset asset = {0};
    struct groom_diag diag = {0};
    char pointer[32];
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(body, key);
    const char *id = cJSON_GetStringValue(item);
    snprintf(pointer, sizeof pointer, "/%s", key);
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
    bool fine = inputs && take_input(request, body, inputs, "strands", STORE_STRANDS, true) &&
                take_input(request, body, inputs, "head", STORE_HEAD, false);
    if (fine && !(submission->inputs = cJSON_PrintUnformatted(inputs))) {
        respond_failure(request, GROOM_ENOMEM, NULL);
        fine = false;
    }
    cJSON_Delete(inputs);
    return fine;
}

/* Checked and with every default filled in, by the library that will read them. */
static bool take_options(struct request *request, const cJSON *body, struct submission *submission)
{
    struct groom_fit_options *options = malloc(sizeof *options);
    struct groom_diag diag = {0};
    const cJSON *given = cJSON_GetObjectItemCaseSensitive(body, "options");
    char *text = given && !cJSON_IsNull(given) ? cJSON_PrintUnformatted(given) : strdup("{}");
    groom_status status =
        options && text ? groom_fit_options_parse(text, strlen(text), options, &diag) : GROOM_ENOMEM;
    if (status == GROOM_OK)
        status = groom_fit_options_print(options, &submission->options, &diag);
    free(options);
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
    const char *kind = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(body, "kind"));
    if (!only_known(request, body))
        return false;
    if (!kind || strcmp(kind, "fit")) {
        respond_bad_field(request, 400, "/kind", "kind must be \"fit\"");
        return false;
    }
    return take_inputs(request, body, submission) && take_options(request, body, submission) &&
           take_priority(request, body, submission) &&
           webhook_take(request, body, &submission->webhook, &submission->n_webhooks);
}

void jobs_respond(struct request *request, int status, const struct store_job *job)
{
    respond_json(request, status, jobs_json(job));
    respond_header(request, "Location", "/v1/jobs/%s", job->id);
}

void jobs_charge(struct request *request, struct jobs_request *submission)
{
    submission->project = request->actor.project;
    submission->owner = request_owner(request);
    submission->max_queued = (uint32_t)request->service->config->max_queue;
    submission->max_queued_of_owner = (uint32_t)request->limits.queued;
    request->retry_after_s = QUEUE_RETRY_S;
}

static void submit(struct request *request, const struct submission *submission)
{
    struct store_job job = {0};
    struct groom_diag diag = {0};
    struct jobs_request wanted = {.kind = "fit",
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

/* --- look -------------------------------------------------------------------------------- */

void jobs_call_list(struct request *request)
{
    struct store_page page;
    struct store_job_list found = {0};
    struct groom_diag diag = {0};
    enum store_job_state state;
    const char *wanted = request_query(request, "state");
    if (!request_page(request, &page))
        return;
    if (wanted && store_job_state_parse(wanted, &state, &diag) != GROOM_OK) {
        respond_bad_query(request, "state", "%s", diag.detail);
        return;
    }
    groom_status status = jobs_list(request->service->jobs, request->actor.project, wanted ? &state : NULL, page, &found, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    cJSON *object = cJSON_CreateObject(), *array = cJSON_AddArrayToObject(object, "jobs");
    for (size_t i = 0; i < found.n; i++)
        cJSON_AddItemToArray(array, jobs_json(&found.items[i]));
    if (found.next)
        cJSON_AddNumberToObject(object, "next", (double)found.next);
    else
        cJSON_AddNullToObject(object, "next");
    store_job_list_finish(&found);
    respond_json(request, 200, object);
}

/* A request that waits for its job's end. */
struct waiting {
    struct request *request;
    int64_t until_ms;
};

/* The job as it is; false where `only_end` and it still goes on. */
static bool answer(struct request *request, bool only_end)
{
    struct store_job job = {0};
    struct groom_diag diag = {0};
    groom_status status = jobs_get(request->service->jobs, request->parameter[0], &job, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return true;
    }
    bool over = store_job_state_is_end(job.state);
    if (over || !only_end)
        jobs_respond(request, 200, &job);
    store_job_finish(&job);
    return over || !only_end;
}

static void act(struct follower *follower, void *user)
{
    struct waiting *waiting = user;
    struct request *request = waiting->request;
    bool time_is_up = follow_now_ms() >= waiting->until_ms || server_is_draining(request->server);
    follower_due(follower, waiting->until_ms);
    if (!answer(request, !time_is_up))
        return;
    follower_end(follower);
    request_resume(request);
}

/* Once the follower is there another thread may answer: nothing of the request is touched any more. */
static void park(struct request *request, uint32_t wait_s)
{
    struct follower *follower;
    struct waiting *waiting = malloc(sizeof *waiting);
    groom_status status = GROOM_ENOMEM;
    if (waiting) {
        *waiting = (struct waiting){request, follow_now_ms() + (int64_t)wait_s * 1000};
        status = follower_create(server_followers(request->server), request->parameter[0], act, free, waiting,
                                 &follower);
    }
    if (status == GROOM_OK)
        return;
    free(waiting);
    respond_failure(request, status, NULL);
    request_resume(request);
}

void jobs_call_get(struct request *request)
{
    uint32_t wait_s = request_wait_s(request);
    if (answer(request, wait_s > 0))
        request_resume(request);
    else
        park(request, wait_s);
}

void jobs_call_delete(struct request *request)
{
    struct store_job job = {0};
    struct groom_diag diag = {0};
    groom_status status = jobs_cancel(request->service->jobs, request->parameter[0], &job, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    /* 202: its worker still stops */
    jobs_respond(request, store_job_state_is_end(job.state) ? 200 : 202, &job);
    store_job_finish(&job);
}

/* --- events ---------------------------------------------------------------------------------- */

/* Where a client that comes again was: the header that browsers send, or ?after= where headers cannot be set.
 */
static bool last_event(struct request *request, int64_t *after)
{
    uint64_t number = 0;
    const char *header = request_header(request, "Last-Event-ID");
    if (!request_query_number(request, "after", 0, INT64_MAX, &number))
        return false;
    if (header) {
        char *end;
        number = strtoull(header, &end, 10);
        if (header[strspn(header, "0123456789")] || number > INT64_MAX) {
            respond_refusal(request, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL),
                            "Last-Event-ID is \"%.40s\"; it must be the id of an event", header);
            return false;
        }
    }
    *after = (int64_t)number;
    return true;
}

/* 204 tells an EventSource that nothing more will come. */
void jobs_call_events(struct request *request)
{
    int64_t after;
    struct store_job job = {0};
    struct store_event_list next = {0};
    struct groom_diag diag = {0};
    if (!last_event(request, &after))
        return;
    groom_status status = jobs_get(request->service->jobs, request->parameter[0], &job, &diag);
    if (status == GROOM_OK)
        status = jobs_events_since(request->service->jobs, job.id, after, 1, &next, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else if (store_job_state_is_end(job.state) && next.n == 0)
        respond_empty(request, 204);
    else
        events_respond(request, job.id, after);
    store_event_list_finish(&next);
    store_job_finish(&job);
}

void jobs_call_losses(struct request *request)
{
    char *text;
    struct groom_diag diag = {0};
    groom_status status = jobs_losses_json(request->service->jobs, request->parameter[0], &text, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", text, strlen(text));
}
