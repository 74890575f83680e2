/* Who am I, sessions for browsers, and the audit. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "server/access/access.h"
#include "server/http/access.h"
#include "server/http/handlers.h"

/* --- sessions ------------------------------------------------------------------------------- */

static cJSON *describe_scopes(unsigned scopes)
{
    cJSON *array = cJSON_CreateArray();
    for (unsigned scope = ACCESS_READ; scope <= ACCESS_ADMIN; scope *= 2)
        if (scopes & scope)
            cJSON_AddItemToArray(array, cJSON_CreateString(access_scope_name((enum access_scope)scope)));
    return array;
}

static void add_limit(cJSON *object, const char *name, uint64_t limit)
{
    if (limit)
        cJSON_AddNumberToObject(object, name, (double)limit);
    else
        cJSON_AddNullToObject(object, name);
}

/* returns  NULL where it was answered: the store failed */
static cJSON *describe(struct request *request)
{
    struct store_usage usage = {0};
    struct groom_diag diag = {0};
    groom_status status = store_usage_of(request->service->store, request_owner(request), &usage, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return NULL;
    }
    cJSON *object = cJSON_CreateObject(), *limits = cJSON_CreateObject(), *used = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "name", request->actor.name);
    cJSON_AddStringToObject(object, "project", request->actor.project);
    cJSON_AddItemToObject(object, "scopes", describe_scopes(request->scopes));
    add_limit(limits, "requests_per_s", request->limits.requests_per_s);
    add_limit(limits, "bytes", request->limits.bytes);
    add_limit(limits, "queued", request->limits.queued);
    cJSON_AddItemToObject(object, "limits", limits);
    cJSON_AddNumberToObject(used, "bytes", (double)usage.n_bytes);
    cJSON_AddNumberToObject(used, "queued", usage.n_queued);
    cJSON_AddItemToObject(object, "used", used);
    cJSON_AddBoolToObject(object, "token_needed", request->actor.token[0] != 0);
    return object;
}

void session_call_get(struct request *request)
{
    cJSON *object = describe(request);
    if (object)
        respond_json(request, 200, object);
}

/* Behind a proxy that speaks TLS the cookie never goes over anything else. */
static void set_cookie(struct request *request, const char *value, uint64_t seconds)
{
    const char *proto = request_header(request, "X-Forwarded-Proto");
    respond_header(request, "Set-Cookie", ACCESS_COOKIE "=%s; Path=/; Max-Age=%llu; HttpOnly; SameSite=Strict%s", value,
                   (unsigned long long)seconds, proto && !strcmp(proto, "https") ? "; Secure" : "");
}

void session_call_post(struct request *request)
{
    char session[ACCESS_SESSION_SIZE];
    uint64_t seconds = request->service->config->session_time_s;
    cJSON *object = describe(request);
    if (!object)
        return;
    respond_json(request, 201, object);
    if (!request->actor.token[0]) /* nobody is asked for anything */
        return;
    access_session_make(request->service->access, request->actor.token, ((int64_t)time(NULL) + (int64_t)seconds) * 1000,
                        session);
    set_cookie(request, session, seconds);
}

void session_call_delete(struct request *request)
{
    respond_empty(request, 204);
    set_cookie(request, "", 0);
}

/* --- the audit -------------------------------------------------------------------------------- */

static cJSON *describe_entry(const struct store_audit_entry *entry)
{
    char time[32];
    cJSON *object = cJSON_CreateObject(), *who = cJSON_CreateObject();
    store_time_text(entry->created_ms, time);
    cJSON_AddNumberToObject(object, "sequence", (double)entry->sequence);
    cJSON_AddStringToObject(object, "at", time);
    cJSON_AddStringToObject(who, "name", entry->name);
    cJSON_AddStringToObject(who, "token", entry->token);
    cJSON_AddItemToObject(object, "who", who);
    cJSON_AddStringToObject(object, "request", entry->request);
    cJSON_AddStringToObject(object, "project", entry->project);
    cJSON_AddStringToObject(object, "action", entry->action);
    cJSON_AddStringToObject(object, "subject", entry->subject);
    cJSON_AddStringToObject(object, "detail", entry->detail);
    return object;
}

void audit_call_list(struct request *request)
{
    struct store_page page;
    struct store_audit_list found = {0};
    struct groom_diag diag = {0};
    if (!request_page(request, &page))
        return;
    groom_status status = store_audit_list(request->service->store, page, &found, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    cJSON *object = cJSON_CreateObject(), *array = cJSON_AddArrayToObject(object, "audit");
    for (size_t i = 0; i < found.n; i++)
        cJSON_AddItemToArray(array, describe_entry(&found.items[i]));
    if (found.next)
        cJSON_AddNumberToObject(object, "next", (double)found.next);
    else
        cJSON_AddNullToObject(object, "next");
    store_audit_list_finish(&found);
    respond_json(request, 200, object);
}
