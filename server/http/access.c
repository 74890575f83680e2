#include "server/http/access.h"

#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/mman.h>

#include "server/access/access.h"
#include "server/http/handlers.h"
#include "server/jobs/jobs.h"
#include "server/jobs/work.h"

/* --- credentials ------------------------------------------------------------------------- */

void access_refuse(struct request *request, const char *error, const char *detail)
{
    respond_refusal(request, 401, "unauthorized", "the request needs a valid token", "%s", detail);
    respond_header(request, "WWW-Authenticate", "Bearer realm=\"groomd\"%s%s%s", error ? ", error=\"" : "",
                   error ? error : "", error ? "\"" : "");
}

static void become(struct request *request, const struct access_token *token)
{
    struct actor *actor = &request->actor;
    snprintf(actor->token, sizeof actor->token, "%s", token->id);
    snprintf(actor->name, sizeof actor->name, "%s", token->name);
    snprintf(actor->project, sizeof actor->project, "%s", token->project);
    request->scopes = token->scopes;
    request->limits = token->limits;
}

static bool came_by_proxy(const struct request *request)
{
    static const char *const signs[] = {"X-Forwarded-For", "Forwarded", "X-Real-IP", "Via"};
    for (size_t i = 0; i < sizeof signs / sizeof signs[0]; i++)
        if (request_header(request, signs[i]))
            return true;
    return false;
}

/* Nobody has made a token, and we listen on loopback. What a proxy passes on comes from elsewhere. */
static bool become_anybody(struct request *request)
{
    const struct access_token anybody = {.name = "anybody", .project = STORE_DEFAULT_PROJECT, .scopes = ACCESS_ALL};
    if (!came_by_proxy(request)) {
        become(request, &anybody);
        return true;
    }
    if (request->route->flags & ROUTE_PUBLIC)
        return true;
    access_refuse(request, NULL,
                  "this came through a proxy, and groomd has no tokens yet: make one with `groomd token create` on "
                  "its machine");
    return false;
}

/* The session's cookie, copied; false where there is none. */
static bool session_of(const struct request *request, char session[ACCESS_SESSION_SIZE])
{
    const char *value = MHD_lookup_connection_value(request->connection, MHD_COOKIE_KIND, ACCESS_COOKIE);
    if (!value || !value[0] || strlen(value) >= ACCESS_SESSION_SIZE)
        return false;
    strcpy(session, value);
    return true;
}

static bool is_looking(const struct request *request)
{
    return !strcmp(request->method, "GET") || !strcmp(request->method, "HEAD");
}

/* returns  GROOM_ENOTFOUND where it came with nothing that is good */
static groom_status identify(struct request *request, struct access_token *token, bool *came_with, struct groom_diag *diag)
{
    struct access *access = request->service->access;
    const char *header = request_header(request, "Authorization");
    char session[ACCESS_SESSION_SIZE];
    *came_with = true;
    if (header && !strncasecmp(header, "Bearer ", 7))
        return access_find(access, header + 7 + strspn(header + 7, " "), token, diag);
    if (!header && is_looking(request) && session_of(request, session))
        return access_session_find(access, session, token, diag);
    *came_with = false;
    return groom_fail(diag, GROOM_ENOTFOUND, "send a token: `Authorization: Bearer TOKEN`");
}

static bool take_turn(struct request *request, const struct access_token *token)
{
    int64_t wait_ms = access_take_turn(request->service->access, token);
    if (!wait_ms)
        return true;
    request->retry_after_s = (uint32_t)((wait_ms + 999) / 1000);
    respond_refusal(request, 429, "too-many-requests", "this token asks too often",
                    "it may ask %llu times a second; wait %lld ms", (unsigned long long)token->limits.requests_per_s,
                    (long long)wait_ms);
    return false;
}

static enum access_scope scope_needed(const struct request *request)
{
    if (request->route->flags & ROUTE_ADMIN)
        return ACCESS_ADMIN;
    return is_looking(request) || request->route->flags & ROUTE_LOOKS ? ACCESS_READ : ACCESS_SUBMIT;
}

static bool check_scope(struct request *request)
{
    enum access_scope needed = scope_needed(request);
    char has[ACCESS_TEXT_SIZE];
    if (request->scopes & needed)
        return true;
    access_scopes_print(request->scopes, has);
    respond_refusal(request, 403, "insufficient-scope", "the token may not do that",
                    "this call needs the scope %s, and the token has %s", access_scope_name(needed), has);
    respond_header(request, "WWW-Authenticate", "Bearer realm=\"groomd\", error=\"insufficient_scope\", scope=\"%s\"",
                   access_scope_name(needed));
    return false;
}

bool access_check(struct request *request)
{
    struct access_token token = {0};
    struct groom_diag diag = {0};
    bool came_with, public = request->route->flags & ROUTE_PUBLIC;
    if (request->route->flags & ROUTE_WORK) /* an attempt's own token: asked of the store */
        return true;
    if (access_is_open(request->service->access))
        return become_anybody(request);
    if (identify(request, &token, &came_with, &diag) != GROOM_OK) {
        if (!public)
            access_refuse(request, came_with ? "invalid_token" : NULL, diag.detail);
        return public;
    }
    become(request, &token);
    if (public)
        return true;
    return take_turn(request, &token) && check_scope(request);
}

/* --- projects ------------------------------------------------------------------------------- */

bool access_needs_owner(const struct request *request)
{
    return !(request->route->flags & ROUTE_WORK) && strstr(request->route->pattern, "/{id}") && !request->owned;
}

/* Another project's is answered with the very words for what does not exist. */
bool access_check_id(struct request *request, const char *id)
{
    char project[STORE_PROJECT_SIZE];
    struct groom_diag diag = {0};
    groom_status status = store_project_of(request->service->store, id, project, &diag);
    if (status == GROOM_OK && strcmp(project, request->actor.project) != 0)
        status = groom_fail(&diag, GROOM_ENOTFOUND, "there is no %.40s", id);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    return status == GROOM_OK;
}

bool access_check_owner(struct request *request)
{
    request->owned = access_check_id(request, request->parameter[0]);
    return request->owned;
}

/* --- repeated requests ------------------------------------------------------------------------- */

/* Of the method, the target and the body's bytes. */
static groom_status hash_request(const struct request *request, char hash[STORE_HASH_SIZE])
{
    char head[URI_MAX_LENGTH + 200], body[STORE_HASH_SIZE];
    size_t n = request->body_fd >= 0 ? (size_t)request->n_received : request->n_body;
    void *mapped = request->body_fd >= 0 && n ? mmap(NULL, n, PROT_READ, MAP_PRIVATE, request->body_fd, 0) : NULL;
    if (mapped == MAP_FAILED)
        return GROOM_EIO;
    work_hash(mapped ? mapped : request->body ? request->body : "", n, body);
    if (mapped)
        munmap(mapped, n);
    int at = snprintf(head, sizeof head, "%s %s %s", request->method, request->path, body);
    for (size_t i = 0; i < request->uri.n_parameters && at < (int)sizeof head; i++)
        at += snprintf(head + at, sizeof head - (size_t)at, "&%s=%s", request->uri.parameter[i].name,
                       request->uri.parameter[i].value);
    work_hash(head, strlen(head), hash);
    return GROOM_OK;
}

static void replay(struct request *request, const struct store_key *made)
{
    struct store_job job = {0};
    struct groom_diag diag = {0};
    if (strncmp(made->subject, "job_", 4) != 0) {
        grooms_respond_revision(request, made->subject, made->number);
    } else {
        groom_status status = jobs_get(request->service->jobs, made->subject, &job, &diag);
        if (status == GROOM_OK)
            jobs_respond(request, 202, &job);
        else
            respond_failure(request, status, &diag);
        store_job_finish(&job);
    }
    if (request->response.status < 400)
        respond_header(request, "Idempotent-Replayed", "true");
}

/* returns  whether it has been answered */
static bool find_earlier(struct request *request)
{
    struct store_key made;
    struct groom_diag diag = {0};
    groom_status status = store_key_find(request->service->store, request->actor.project, request->actor.key,
                                         request->key_hash, &made, &diag);
    if (status == GROOM_ENOTFOUND)
        return false;
    if (status == GROOM_OK)
        replay(request, &made);
    else if (status == GROOM_ECONFLICT)
        respond_refusal(request, 422, "idempotency-key-reused", "the key stands for another request", "%s",
                        diag.detail);
    else
        respond_failure(request, status, &diag);
    return true;
}

/* 0: for ever, which is a thousand years. */
static int64_t lifetime_ms(uint64_t seconds) { return (int64_t)(seconds ? seconds : (uint64_t)1000 * 365 * 86400) * 1000; }

/* Uploads are idempotent by themselves: their ids are made of their bytes. */
bool access_begin_once(struct request *request)
{
    const char *key = request_header(request, "Idempotency-Key");
    if (!key || request->route->flags & ROUTE_WORK ||
        (request->route->body != BODY_MEMORY && request->route->body != BODY_FILE))
        return true;
    if (!key[0] || strlen(key) > 255) {
        respond_refusal(request, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL),
                        "an Idempotency-Key has 1 to 255 characters");
        return false;
    }
    groom_status status = hash_request(request, request->key_hash);
    if (status != GROOM_OK) {
        respond_failure(request, status, NULL);
        return false;
    }
    request->actor.key = key;
    request->actor.key_hash = request->key_hash;
    request->actor.key_lifetime_ms = lifetime_ms(request->service->config->keep_keys_s);
    return !find_earlier(request);
}

/* Where another with the same key came first meanwhile, this one could not do it again. */
void access_end_once(struct request *request)
{
    if (request->actor.key && request->response.status >= 400)
        find_earlier(request);
}

/* --- pages of other sites -------------------------------------------------------------------------- */

bool access_allows_origin(const struct request *request, const char *origin)
{
    return router_knows(request->service->config->cors, origin);
}

void access_add_cors(const struct request *request, struct MHD_Response *response)
{
    const char *origin = request_header(request, "Origin");
    if (!request->service->config->cors[0])
        return;
    MHD_add_response_header(response, "Vary", "Origin");
    if (!origin || !access_allows_origin(request, origin))
        return;
    MHD_add_response_header(response, "Access-Control-Allow-Origin", origin);
    MHD_add_response_header(response, "Access-Control-Expose-Headers",
                            "ETag, Location, Retry-After, X-Request-Id, Idempotent-Replayed, Content-Disposition, "
                            "Content-Range, WWW-Authenticate, Upload-Offset, Upload-Length, Upload-Expires, "
                            "Tus-Resumable, Tus-Version, Tus-Extension, Tus-Max-Size, Tus-Checksum-Algorithm");
    if (strcmp(request->method, "OPTIONS") || !request_header(request, "Access-Control-Request-Method"))
        return;
    MHD_add_response_header(response, "Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, PATCH, DELETE");
    MHD_add_response_header(response, "Access-Control-Allow-Headers",
                            "Authorization, Content-Type, Content-Digest, If-Match, If-None-Match, Idempotency-Key, "
                            "Last-Event-ID, Prefer, Range, Tus-Resumable, Upload-Length, Upload-Metadata, "
                            "Upload-Offset, Upload-Checksum");
    MHD_add_response_header(response, "Access-Control-Max-Age", "600");
}
