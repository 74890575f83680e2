/* Edits in curvature space, of grooms and of uploaded strands. */
#include <cjson/cJSON.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "server/grooms/grooms.h"
#include "server/http/handlers.h"
#include "server/http/server.h"
#include "server/jobs/jobs.h"

/* Larger ones are refused before they are looked at: 5 million anchors. */
#define MOST_BODY ((uint64_t)128 << 20)

int layers_check(struct request *request)
{
    uint32_t revision;
    if (request->n_expected != UINT64_MAX && request->n_expected > MOST_BODY) {
        respond_refusal(request, 413, groom_status_name(GROOM_ETOOBIG), groom_status_message(GROOM_ETOOBIG),
                        "an edit has at most %llu bytes", (unsigned long long)MOST_BODY);
        return 0;
    }
    return !request_header(request, "If-Match") || request_if_match(request, &revision);
}

static void respond_edited(struct request *request, struct grooms_layer_edited *edited)
{
    char *json = edited->json;
    edited->json = NULL;
    respond_bytes(request, edited->end == GROOMS_EDITED ? 201 : 200, "application/json", json, strlen(json));
    if (edited->end == GROOMS_EDITED) {
        respond_header(request, "Location", "/v1/grooms/%s", edited->groom_id);
        respond_etag(request, "%u", edited->revision);
    }
}

/* More strands than may be edited now: a job of their own. */
static void submit(struct request *request, const struct grooms_layer_edit *wanted, const struct grooms_layer_edited *edited)
{
    struct store_job job = {0};
    struct groom_diag diag = {0};
    struct jobs_request submission = {.kind = groom_operator_name(wanted->type), .inputs = edited->inputs,
                                      .options = edited->json};
    jobs_charge(request, &submission);
    groom_status status = jobs_submit(request->service->jobs, &submission, &job, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    respond_json(request, 202, jobs_json(&job));
    respond_header(request, "Location", "/v1/jobs/%s", job.id);
    store_job_finish(&job);
}

static void edit(struct request *request, struct grooms_layer_edit *wanted)
{
    struct grooms_layer_edited edited = {0};
    struct groom_diag diag = {0};
    groom_status status = grooms_edit_layer(request->service->grooms, wanted, &edited, &diag);
    if (status == GROOM_ECONFLICT)
        respond_refusal(request, 412, "precondition-failed", "it was changed meanwhile", "%s", diag.detail);
    else if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else if (edited.end == GROOMS_TOO_MANY)
        submit(request, wanted, &edited);
    else
        respond_edited(request, &edited);
    grooms_layer_edited_finish(&edited);
}

static void respond_empty_body(struct request *request)
{
    respond_refusal(request, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL),
                    "the body is empty; {} takes every default");
}

static void call(struct request *request, groom_operator_type type)
{
    struct grooms_layer_edit wanted = {.project = request->actor.project, .type = type, .n_body = (size_t)request->n_received};
    if (strstr(request->route->pattern, "/v1/strands"))
        wanted.strands_id = request->parameter[0];
    else
        wanted.groom_id = request->parameter[0];
    if (request_header(request, "If-Match") && !request_if_match(request, &wanted.expected))
        return;
    if (wanted.n_body == 0) {
        respond_empty_body(request);
        return;
    }
    char *body = mmap(NULL, wanted.n_body, PROT_READ, MAP_PRIVATE, request->body_fd, 0);
    if (body == MAP_FAILED) {
        respond_failure(request, GROOM_EIO, NULL);
        return;
    }
    wanted.body = body;
    edit(request, &wanted);
    munmap(body, wanted.n_body);
}

void layers_call_ruffle(struct request *request) { call(request, GROOM_OPERATOR_RUFFLE); }
void layers_call_sculpt(struct request *request) { call(request, GROOM_OPERATOR_SCULPT); }
void layers_call_interpolate(struct request *request) { call(request, GROOM_OPERATOR_INTERPOLATE); }
void layers_call_curl_scale(struct request *request) { call(request, GROOM_OPERATOR_CURL_SCALE); }
