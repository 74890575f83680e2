#include "server/http/webhook_calls.h"

#include <cjson/cJSON.h>

#include "server/http/handlers.h"
#include "server/jobs/jobs.h"
#include "server/webhooks/webhooks.h"

static bool only_known(struct request *request, const cJSON *webhook)
{
    const cJSON *member;
    cJSON_ArrayForEach(member, webhook)
    {
        if (router_knows("url secret", member->string))
            continue;
        respond_bad_field(request, 400, "/webhook", "\"%.60s\" is not a member of a webhook; it takes url and secret",
                          member->string);
        return false;
    }
    return true;
}

bool webhook_take(struct request *request, const cJSON *body, struct store_webhook_new *webhook, size_t *n)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(body, "webhook");
    struct groom_diag diag = {0};
    *n = 0;
    if (!item || cJSON_IsNull(item))
        return true;
    if (!cJSON_IsObject(item)) {
        respond_bad_field(request, 400, "/webhook", "a webhook is an object with url and secret");
        return false;
    }
    webhook->url = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "url"));
    webhook->secret = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "secret"));
    if (!only_known(request, item))
        return false;
    if (!webhook->url || !webhook->secret) {
        respond_bad_field(request, 400, webhook->url ? "/webhook/secret" : "/webhook/url",
                          "a webhook has a url and a secret, which messages are signed with");
        return false;
    }
    if (webhook_url_check(webhook->url, request->service->config->webhook_allow, &diag) != GROOM_OK) {
        respond_bad_field(request, 400, "/webhook/url", "%s", diag.detail);
        return false;
    }
    if (webhook_secret_check(webhook->secret, &diag) != GROOM_OK) {
        respond_bad_field(request, 400, "/webhook/secret", "%s", diag.detail);
        return false;
    }
    *n = 1;
    return true;
}

/* --- the log of deliveries ----------------------------------------------------------------- */

static void add_time(cJSON *object, const char *name, int64_t time_ms)
{
    char text[32];
    store_time_text(time_ms, text);
    if (time_ms)
        cJSON_AddStringToObject(object, name, text);
    else
        cJSON_AddNullToObject(object, name);
}

/* Without the secret. */
static cJSON *describe(const struct store_webhook *webhook)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "id", webhook->id);
    cJSON_AddStringToObject(object, "url", webhook->url);
    cJSON_AddStringToObject(object, "state", store_webhook_state_name(webhook->state));
    cJSON_AddNumberToObject(object, "attempts", webhook->n_attempts);
    if (webhook->last_status)
        cJSON_AddNumberToObject(object, "last_status", webhook->last_status);
    else
        cJSON_AddNullToObject(object, "last_status");
    cJSON_AddStringToObject(object, "last_error", webhook->last_error);
    add_time(object, "next_attempt_at", webhook->state == STORE_WEBHOOK_WAITING ? webhook->due_ms : 0);
    add_time(object, "created_at", webhook->created_ms);
    add_time(object, "finished_at", webhook->finished_ms);
    return object;
}

void jobs_call_deliveries(struct request *request)
{
    struct store_job job = {0};
    struct store_webhook_list list = {0};
    struct groom_diag diag = {0};
    groom_status status = jobs_get(request->service->jobs, request->parameter[0], &job, &diag);
    store_job_finish(&job);
    if (status == GROOM_OK)
        status = store_webhooks_list(request->service->store, request->parameter[0], &list, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    cJSON *object = cJSON_CreateObject(), *array = cJSON_AddArrayToObject(object, "deliveries");
    for (size_t i = 0; i < list.n; i++)
        cJSON_AddItemToArray(array, describe(&list.items[i]));
    store_webhook_list_finish(&list);
    respond_json(request, 200, object);
}
