/* Jobs: look, wait, cancel, events, losses; submission.c has how they are made. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/events.h"
#include "server/http/handlers.h"
#include "server/http/server.h"
#include "server/jobs/jobs.h"

/* --- what all calls share ------------------------------------------------------------------ */

#define QUEUE_RETRY_S 30 /* when to come again where a queue is full: fits take minutes */

void jobs_respond(struct request *request, int status, const struct store_job *job)
{
    respond_json(request, status, jobs_json(job));
    respond_header(request, "Location", "/v1/jobs/%s", job->id);
    memcpy(request->job_id, job->id, sizeof request->job_id);
}

void jobs_charge(struct request *request, struct jobs_request *submission)
{
    submission->project = request->actor.project;
    submission->owner = request_owner(request);
    submission->max_queued = (uint32_t)request->service->config->max_queue;
    submission->max_queued_of_owner = (uint32_t)request->limits.queued;
    request->retry_after_s = QUEUE_RETRY_S;
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
