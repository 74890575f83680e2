#include "server/http/access.h"
#include "server/http/digest.h"
#include "server/http/events.h"
#include "server/http/server.h"

#include <errno.h>
#include <fcntl.h>
#include <microhttpd.h>
#include <netdb.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

#include <openssl/evp.h>

#include "proto/json_text.h"
#include "server/jobs/work.h"
#include "server/log.h"
#include "server/uploads/uploads.h"

/* A refused body up to this size is read and dropped, so that the client hears why: closing a
 * connection with unread bytes resets it. Larger ones are cut. */
#define DISCARD_MAX ((uint64_t)16 << 20)

enum phase {
    PHASE_HEAD,    /* the head has been read */
    PHASE_CHECKED, /* its token too */
    PHASE_BODY,
    PHASE_WORKING, /* a handler has it */
    PHASE_ANSWERED
};

struct server {
    const struct service *service;
    const struct route *routes;
    size_t n_routes;
    struct MHD_Daemon *mhd;
    struct lane *fast, *slow;
    struct followers *followers;
    struct connections *connections;
    struct metrics *metrics;
    struct export_cache *exports;
    pthread_t ticker;
    bool has_ticker;
    atomic_bool draining, closing, ending;
    atomic_long n_suspended, n_requests;
    uint64_t id_base;
    atomic_ullong next_id;
};

struct metrics *server_metrics(struct server *server) { return server->metrics; }
struct followers *server_followers(struct server *server) { return server->followers; }
uint64_t server_connections(struct server *server) { return connections_count(server->connections); }
struct export_cache *server_exports(struct server *server) { return server->exports; }
struct lane *server_lane(struct server *server, enum lane_name name)
{
    return name == LANE_SLOW ? server->slow : server->fast;
}
bool server_is_draining(const struct server *server) { return atomic_load(&server->draining); }

/* Count first, look after: server_stop sets `closing` first and reads the count after. */
bool server_suspended(struct server *server)
{
    atomic_fetch_add(&server->n_suspended, 1);
    if (!atomic_load(&server->closing))
        return true;
    atomic_fetch_sub(&server->n_suspended, 1);
    return false;
}

void server_resumed(struct server *server) { atomic_fetch_sub(&server->n_suspended, 1); }

static int64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

/* --- the head ---------------------------------------------------------------------------- */

static const char bad_request[] = "the request cannot be understood";

struct lengths {
    int n_hosts, n_lengths, n_codings;
    bool chunked, garbled;
    const char *length, *host;
};

/* libmicrohttpd 0.9.75 glues a folded line ("Transfer-Encoding:", then " chunked") to the name before it,
 * and takes the header for an unknown one; another program on the way would not. */
static bool is_garbled(const char *name)
{
    static const char *const framing[] = {"Transfer-Encoding", "Content-Length", "Host"};
    for (size_t i = 0; i < sizeof framing / sizeof framing[0]; i++) {
        size_t n = strlen(framing[i]);
        if (!strncasecmp(name, framing[i], n) && name[n])
            return true;
    }
    return false;
}

static enum MHD_Result count_header(void *user, enum MHD_ValueKind kind, const char *name, const char *value)
{
    struct lengths *lengths = user;
    (void)kind;
    lengths->garbled |= is_garbled(name);
    if (!strcasecmp(name, "Host")) {
        lengths->n_hosts++;
        lengths->host = value;
    }
    if (!strcasecmp(name, "Content-Length")) {
        lengths->n_lengths++;
        lengths->length = value;
    }
    if (!strcasecmp(name, "Transfer-Encoding")) {
        lengths->n_codings++;
        lengths->chunked = value && !strcasecmp(value, "chunked");
    }
    return MHD_YES;
}

/* The length of the body, read strictly: what two programs could read in two ways (request
 * smuggling) is refused. */
static bool read_length(struct request *request)
{
    struct lengths lengths = {0};
    char *end;
    MHD_get_connection_values(request->connection, MHD_HEADER_KIND, count_header, &lengths);
    request->n_expected = lengths.n_codings ? UINT64_MAX : 0;
    if (lengths.n_hosts != 1 && request->http_1_1) {
        respond_refusal(request, 400, "bad-request", bad_request, "send one Host header");
        request->close = true;
        return false;
    }
    if (lengths.garbled || lengths.n_lengths > 1 || lengths.n_codings > 1 || (lengths.n_lengths && lengths.n_codings) ||
        (lengths.n_codings && !lengths.chunked)) {
        respond_refusal(request, 400, "bad-request", bad_request,
                        "send one Content-Length, or Transfer-Encoding: chunked, and not both");
        request->close = true;
        return false;
    }
    if (!lengths.n_lengths)
        return true;
    errno = 0;
    request->n_expected = strtoull(lengths.length, &end, 10);
    if (errno || *end || lengths.length[strspn(lengths.length, "0123456789")] || end == lengths.length) {
        request->close = true;
        respond_refusal(request, 400, "bad-request", bad_request, "Content-Length is no number");
        return false;
    }
    return true;
}

/* The name in "name:port" is this service's: an address, localhost, or one of --hosts. Any other name
 * that leads here is somebody's who lets a browser take this machine for his own (DNS rebinding). */
static bool is_own_name(const struct config *config, const char *authority)
{
    char name[256];
    size_t n = strcspn(authority, ":");
    if (authority[0] == '[' || n == 0 || n >= sizeof name)
        return authority[0] == '[';
    memcpy(name, authority, n);
    name[n] = 0;
    return !name[strspn(name, "0123456789.")] || !strcasecmp(name, "localhost") ||
           router_knows(config->hosts, name);
}

/* A page of another site must not be able to command groomd through the browser of somebody who may: on
 * loopback nobody is asked for a token. */
static bool check_origin(struct request *request)
{
    const struct config *config = request->service->config;
    const char *host = request_header(request, "Host"), *origin = request_header(request, "Origin");
    if (host && !is_own_name(config, host)) {
        respond_refusal(request, 421, "misdirected-request", "this is not the service of that name",
                        "Host is %.100s; --hosts says which names this service has", host);
        return false;
    }
    if (!origin || !strcmp(request->method, "GET") || !strcmp(request->method, "HEAD"))
        return true;
    const char *authority = strstr(origin, "://");
    authority = authority ? authority + 3 : "";
    if ((host && !strcasecmp(authority, host)) || router_knows(config->hosts, authority) ||
        access_allows_origin(request, origin))
        return true;
    respond_refusal(request, 403, "cross-origin", "pages of other sites may not do this",
                    "Origin is %.100s, which is not this service; --cors-origins says which others may", origin);
    return false;
}

/* Some proxies let nothing but POST through: tus has its clients name the real method in a header. */
static void override_method(struct request *request)
{
    const char *method = request_header(request, "X-HTTP-Method-Override");
    if (method && !strcmp(request->method, "POST") && !strncmp(request->path, "/v1/uploads/", 12) &&
        (!strcmp(method, "PATCH") || !strcmp(method, "DELETE")))
        snprintf(request->method, sizeof request->method, "%s", method);
}

static bool find_route(struct request *request)
{
    struct server *server = request->server;
    struct router_match match;
    override_method(request);
    switch (router_find(server->routes, server->n_routes, request->method, &request->uri, &match)) {
    case ROUTER_FOUND:
        request->route = match.route;
        memcpy(request->parameter, match.parameter, sizeof request->parameter);
        if (!strncmp(match.route->pattern, "/v1/jobs/{id}", 13))
            snprintf(request->job_id, sizeof request->job_id, "%s", request->parameter[0]);
        return true;
    case ROUTER_NO_METHOD:
        if (!strcmp(request->method, "OPTIONS"))
            respond_empty(request, 204);
        else
            respond_refusal(request, 405, "method-not-allowed", "the resource has no such method",
                            "%s takes %s", request->path, match.allow);
        respond_header(request, "Allow", "%s", match.allow);
        return false;
    default:
        respond_refusal(request, 404, "not-found", "no such thing",
                        "nothing is at %s; /openapi.json says what there is", request->path);
        return false;
    }
}

static bool check_query(struct request *request)
{
    const char *known = request->route->query;
    for (size_t i = 0; i < request->uri.n_parameters; i++) {
        const char *name = request->uri.parameter[i].name;
        if (router_knows(known, name))
            continue;
        respond_bad_query(request, name, "\"%.40s\" is not a parameter of this call; it takes %s", name,
                          known[0] ? known : "none");
        return false;
    }
    return true;
}

/* application/json and application/anything+json; a body without a type is taken as JSON. */
static bool is_json(const char *type)
{
    if (!type)
        return true;
    size_t n = strcspn(type, "; ");
    return (n == 16 && !strncasecmp(type, "application/json", n)) ||
           (n > 5 && !strncasecmp(type + n - 5, "+json", 5));
}

static bool check_media(struct request *request)
{
    static const char title[] = "the body is of a kind that this call does not take";
    const char *type = request_header(request, "Content-Type"),
               *coding = request_header(request, "Content-Encoding");
    if (request->n_expected == 0)
        return true;
    if (coding && strcasecmp(coding, "identity")) {
        respond_refusal(request, 415, "unsupported-media-type", title,
                        "Content-Encoding %.40s is not taken; send the bytes as they are", coding);
        return false;
    }
    if (request->route->body == BODY_MEMORY && !is_json(type)) {
        respond_refusal(request, 415, "unsupported-media-type", title,
                        "Content-Type is %.60s; this call takes application/json", type);
        return false;
    }
    if (type && !strncasecmp(type, "multipart/", 10)) {
        respond_refusal(
            request, 415, "unsupported-media-type", title,
            "Content-Type is %.60s; send the bytes of the file themselves (curl --data-binary @FILE)", type);
        return false;
    }
    return true;
}

static uint64_t body_limit(const struct request *request)
{
    const struct config *config = request->service->config;
    switch (request->route ? request->route->body : BODY_NONE) {
    case BODY_NONE:
        return 0;
    case BODY_MEMORY:
        return config->max_body;
    default:
        return config->max_upload;
    }
}

static void refuse_large(struct request *request)
{
    respond_refusal(request, 413, groom_status_name(GROOM_ETOOBIG), groom_status_message(GROOM_ETOOBIG),
                    "the body is larger than the limit of %llu bytes (%s)",
                    (unsigned long long)body_limit(request),
                    request->route->body == BODY_MEMORY ? "--max-body" : "--max-upload");
}

static bool check_size(struct request *request)
{
    struct statvfs disk;
    if (request->n_expected == 0)
        return true;
    if (request->route->body == BODY_NONE) {
        respond_refusal(request, 400, "bad-request", bad_request, "%s %s takes no body", request->method,
                        request->path);
        return false;
    }
    bool known = request->n_expected != UINT64_MAX;
    if (known && request->n_expected > body_limit(request)) {
        refuse_large(request);
        return false;
    }
    if (request->route->body != BODY_MEMORY && !statvfs(request->service->temporary_folder, &disk) &&
        (uint64_t)disk.f_bavail * disk.f_frsize <
            request->service->config->min_free + (known ? request->n_expected : 0)) {
        respond_failure(request, GROOM_ENOSPC, NULL);
        return false;
    }
    return true;
}

/* --- the body ------------------------------------------------------------------------------ */

static bool open_body(struct request *request)
{
    struct groom_diag diag = {0};
    groom_status status = GROOM_OK;
    uint64_t known = request->n_expected == UINT64_MAX ? 0 : request->n_expected;
    if (request->route->body == BODY_BLOB)
        status = blobs_begin(request->service->blobs, known, &request->blob, &diag);
    if (request->route->body == BODY_FILE &&
        (request->body_fd = open(request->service->temporary_folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)) <
            0)
        status = groom_fail(&diag, errno == ENOSPC ? GROOM_ENOSPC : GROOM_EIO, "no temporary file: %s",
                            strerror(errno));
    if (status == GROOM_OK)
        return true;
    respond_failure(request, status, &diag);
    return false;
}

static groom_status keep_in_memory(struct request *request, const char *bytes, size_t n)
{
    if (request->n_body + n + 1 > request->body_capacity) {
        size_t capacity = 2 * (request->n_body + n) + 1;
        if (request->n_expected != UINT64_MAX && request->n_expected + 1 > capacity)
            capacity = (size_t)request->n_expected + 1;
        char *larger = realloc(request->body, capacity);
        if (!larger)
            return GROOM_ENOMEM;
        request->body = larger;
        request->body_capacity = capacity;
    }
    memcpy(request->body + request->n_body, bytes, n);
    request->body[request->n_body += n] = 0;
    return GROOM_OK;
}

static groom_status keep_in_file(int fd, const char *bytes, size_t n)
{
    while (n) {
        ssize_t written = write(fd, bytes, n);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return errno == ENOSPC ? GROOM_ENOSPC : GROOM_EIO;
        bytes += written;
        n -= (size_t)written;
    }
    return GROOM_OK;
}

static void take_bytes(struct request *request, const char *bytes, size_t n)
{
    struct groom_diag diag = {0};
    groom_status status;
    request->n_received += n;
    link_received(request->link, n);
    if (request->discard)
        return;
    if (request->n_received > body_limit(request)) {
        refuse_large(request);
        request->discard = true;
        return;
    }
    switch (request->route->body) {
    case BODY_MEMORY:
        status = keep_in_memory(request, bytes, n);
        break;
    case BODY_FILE:
        status = keep_in_file(request->body_fd, bytes, n);
        break;
    case BODY_UPLOAD:
        status = upload_write(request->upload, bytes, n, &diag);
        break;
    default:
        status = blobs_write(request->blob, bytes, n, &diag);
        break;
    }
    digest_update(request, bytes, n);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        request->discard = true;
    }
}

/* --- handlers in lanes ------------------------------------------------------------------------ */

void request_resume(struct request *request)
{
    struct server *server = request->server;
    MHD_resume_connection(request->connection); /* from here on the request is an HTTP thread's */
    server_resumed(server);
}

static void run_handler(struct task *task)
{
    struct request *request = (struct request *)task;
    const struct route *route = request->route;
    bool goes_on = (!access_needs_owner(request) || access_check_owner(request)) && access_begin_once(request);
    actor_set(&request->actor);
    json_memory_begin();
    if (goes_on)
        route->handle(request); /* where it resumes, the request may be gone by now */
    actor_set(NULL);
    if (goes_on && route->flags & ROUTE_RESUMES)
        return;
    if (goes_on)
        access_end_once(request);
    request_resume(request);
}

static void become_attempt(struct request *request)
{
    struct actor *actor = &request->actor;
    snprintf(actor->token, sizeof actor->token, "%.40s.%u", request->attempt.job_id, request->attempt.number);
    snprintf(actor->name, sizeof actor->name, "attempt");
    memcpy(request->job_id, request->attempt.job_id, sizeof request->job_id);
    request->scopes = ACCESS_WORK;
}

/* The bearer token of an attempt, against the store. */
static void check_attempt(struct request *request)
{
    struct groom_diag diag = {0};
    const char *header = request_header(request, "Authorization");
    const char *token = header && !strncasecmp(header, "Bearer ", 7) ? header + 7 : "";
    groom_status status = work_authenticate(request->service->jobs, token, &request->attempt, &diag);
    if (status == GROOM_ENOTFOUND)
        access_refuse(request, token[0] ? "invalid_token" : NULL, "this call takes the bearer token of an attempt");
    else if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        become_attempt(request);
}

static bool is_answered(const struct request *request) { return request->response.kind != RESPONSE_NONE; }

/* What has to wait before the body is read. */
static void run_check(struct task *task)
{
    struct request *request = (struct request *)task;
    int flags = request->route->flags;
    json_memory_begin(); /* a thread serves many: what failed for another is not ours */
    if (flags & ROUTE_WORK)
        check_attempt(request);
    else if (access_needs_owner(request))
        access_check_owner(request);
    if (!is_answered(request) && (flags & ROUTE_WAITS) && !request->route->check(request) && !is_answered(request))
        respond_failure(request, GROOM_EINTERNAL, NULL);
    request_resume(request);
}

static void refuse_busy(struct request *request, const char *why)
{
    respond_refusal(request, 503, "busy", "the service cannot take this now", "%s", why);
}

/* Suspend and hand to a lane; false where that is refused (and answered). */
static bool start(struct request *request, struct lane *lane, void (*run)(struct task *), bool always)
{
    if (!server_suspended(request->server)) {
        refuse_busy(request, "groomd is stopping; try again in a moment");
        request->close = true;
        return false;
    }
    request->task.run = run;
    MHD_suspend_connection(request->connection);
    if (always)
        lane_continue(lane, &request->task);
    else if (!lane_submit(lane, &request->task)) {
        refuse_busy(request, "too many requests wait for the machine; try again in a moment");
        request_resume(request);
    }
    return true;
}

static enum MHD_Result work(struct request *request)
{
    const struct route *route = request->route;
    request->phase = PHASE_WORKING;
    link_busy(request->link);
    if (!is_answered(request) && digest_check(request) && route->lane == LANE_INLINE)
        route->handle(request);
    if (!is_answered(request) &&
        start(request, server_lane(request->server, route->lane), run_handler, false))
        return MHD_YES;
    request->phase = PHASE_ANSWERED;
    return (enum MHD_Result)server_send(request);
}

/* --- the way through ---------------------------------------------------------------------------- */

/* The answer is known before the body: short ones are read and dropped, of others nothing is read. */
static enum MHD_Result refuse(struct request *request)
{
    bool waits = request_header(request, "Expect") != NULL;
    if (request->n_expected <= DISCARD_MAX && !waits && !request->close) {
        request->discard = true;
        request->phase = PHASE_BODY;
        link_body(request->link);
        return MHD_YES;
    }
    request->close |= request->n_expected > 0;
    request->phase = PHASE_ANSWERED;
    link_busy(request->link);
    return (enum MHD_Result)server_send(request);
}

static bool check_head(struct request *request)
{
    return !is_answered(request) && read_length(request) && check_origin(request) && find_route(request) &&
           access_check(request) && check_query(request) && check_media(request) && check_size(request) &&
           digest_start(request) &&
           (!request->route->check || (request->route->flags & ROUTE_WAITS) || request->route->check(request));
}

static enum MHD_Result on_checked(struct request *request)
{
    if (is_answered(request) || (request->n_expected && !open_body(request)))
        return refuse(request);
    request->phase = PHASE_BODY;
    link_body(request->link);
    return MHD_YES;
}

static enum MHD_Result on_head(struct request *request)
{
    link_busy(request->link);
    if (server_is_draining(request->server)) {
        refuse_busy(request, "groomd is stopping; try again in a moment");
        request->close = true;
        return refuse(request);
    }
    if (!check_head(request))
        return refuse(request);
    request->phase = PHASE_CHECKED;
    if (request->route->flags & (ROUTE_WORK | ROUTE_WAITS) || (request->n_expected && access_needs_owner(request))) {
        if (start(request, request->server->fast, run_check, true))
            return MHD_YES;
        return refuse(request);
    }
    return on_checked(request);
}

static enum MHD_Result on_body(struct request *request, const char *bytes, size_t *n_bytes)
{
    if (*n_bytes == 0)
        return work(request);
    take_bytes(request, bytes, *n_bytes);
    *n_bytes = 0;
    /* nobody is to pour into the void without end */
    if (request->discard && request->n_received > body_limit(request) + DISCARD_MAX &&
        request->n_received > DISCARD_MAX)
        return MHD_NO;
    return MHD_YES;
}

static enum MHD_Result on_access(void *user, struct MHD_Connection *connection, const char *url,
                                 const char *method, const char *version, const char *bytes, size_t *n_bytes,
                                 void **state)
{
    struct request *request = *state;
    (void)user, (void)url;
    if (!request)
        return MHD_NO;
    switch (request->phase) {
    case PHASE_HEAD:
        request->connection = connection;
        snprintf(request->method, sizeof request->method, "%s", method);
        request->http_1_1 = !strcmp(version, MHD_HTTP_VERSION_1_1);
        return on_head(request);
    case PHASE_CHECKED:
        return on_checked(request);
    case PHASE_BODY:
        return on_body(request, bytes, n_bytes);
    case PHASE_WORKING:
        request->phase = PHASE_ANSWERED;
        return (enum MHD_Result)server_send(request);
    default:
        *n_bytes = 0;
        return MHD_YES;
    }
}

/* --- begin and end of requests and connections ------------------------------------------------------ */

/* The request line is read: the first that is heard of a request, and the only place where its target
 * stands as it was sent. */
static void *on_target(void *user, const char *target, struct MHD_Connection *connection)
{
    struct server *server = user;
    struct request *request = calloc(1, sizeof *request);
    if (!request)
        return NULL;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    request->server = server;
    request->service = server->service;
    request->connection = connection;
    request->link = info ? info->socket_context : NULL;
    request->body_fd = -1;
    request->response.fd = -1;
    request->started_us = now_us();
    unsigned long long number = atomic_fetch_add(&server->next_id, 1);
    snprintf(request->id, sizeof request->id, "%08llx%06llx",
             (unsigned long long)server->id_base & 0xffffffff, number & 0xffffffffff);
    snprintf(request->actor.request, sizeof request->actor.request, "%s", request->id);
    snprintf(request->path, sizeof request->path, "%s", target);
    request->path[strcspn(request->path, "?")] = 0;
    atomic_fetch_add(&server->n_requests, 1);
    const char *wrong = uri_parse(target, &request->uri);
    if (wrong) {
        respond_refusal(request, strlen(target) > URI_MAX_LENGTH ? 414 : 400, "bad-request", bad_request,
                        "%s", wrong);
        request->close = true;
    }
    if (!request->link) {
        atomic_fetch_sub(&server->n_requests, 1);
        response_finish(&request->response);
        uri_finish(&request->uri);
        free(request);
        return NULL;
    }
    return request;
}

static void remote_of(struct request *request, char *text, size_t capacity)
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(request->connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    text[0] = 0;
    if (!info || !info->client_addr)
        return;
    socklen_t size =
        info->client_addr->sa_family == AF_INET6 ? sizeof(struct sockaddr_in6) : sizeof(struct sockaddr_in);
    if (getnameinfo(info->client_addr, size, text, (socklen_t)capacity, NULL, 0, NI_NUMERICHOST))
        text[0] = 0;
}

static void write_access_log(struct request *request, double seconds, enum MHD_RequestTerminationCode code)
{
    char members[1400], path[400], remote[64], job[120] = "", id[80];
    int status = request->response.status;
    bool quiet = request->route && (request->route->flags & ROUTE_QUIET);
    enum config_log_level level = status >= 500 ? CONFIG_LOG_WARNING
                                  : quiet       ? CONFIG_LOG_DEBUG
                                                : CONFIG_LOG_INFO;
    if (!log_wants(level))
        return;
    remote_of(request, remote, sizeof remote);
    if (request->job_id[0])
        snprintf(job, sizeof job, ",\"job\":\"%s\"", log_escape(request->job_id, id, sizeof id));
    snprintf(members, sizeof members,
             "\"request\":\"%s\",\"method\":\"%s\",\"path\":\"%s\",\"status\":%d,\"seconds\":%.6f,"
             "\"received\":%llu,\"sent\":%llu,\"remote\":\"%s\",\"token\":\"%s\",\"project\":\"%s\"%s%s",
             request->id, request->method, log_escape(request->path, path, sizeof path), status, seconds,
             (unsigned long long)request->n_received, (unsigned long long)request->n_sent, remote,
             request->actor.token, request->actor.project, job,
             code == MHD_REQUEST_TERMINATED_COMPLETED_OK ? "" : ",\"broken\":true");
    log_members(level, "request", members);
}

static void on_completed(void *user, struct MHD_Connection *connection, void **state,
                         enum MHD_RequestTerminationCode code)
{
    struct server *server = user;
    struct request *request = *state;
    (void)connection;
    if (!request)
        return;
    double seconds = (double)(now_us() - request->started_us) * 1e-6;
    size_t row = request->route ? (size_t)(request->route - server->routes) : server->n_routes;
    metrics_request(server->metrics, row, request->response.status, seconds, request->n_received,
                    request->n_sent);
    write_access_log(request, seconds, code);
    link_head(request->link);
    blobs_abort(request->blob);
    upload_abandon(request->upload);
    EVP_MD_CTX_free(request->hash);
    if (request->body_fd >= 0)
        close(request->body_fd);
    free(request->body);
    if (request->response.kind == RESPONSE_EVENTS && request->response.feed)
        events_drop(request->response.feed);
    response_finish(&request->response);
    uri_finish(&request->uri);
    free(request);
    *state = NULL;
    atomic_fetch_sub(&server->n_requests, 1);
}

static void on_connection(void *user, struct MHD_Connection *connection, void **context,
                          enum MHD_ConnectionNotificationCode code)
{
    struct server *server = user;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        *context = info ? connections_open(server->connections, info->connect_fd) : NULL;
    } else if (*context) {
        connections_close(server->connections, *context);
        *context = NULL;
    }
}

/* --- the daemon ------------------------------------------------------------------------------------- */

static void *tick(void *user)
{
    struct server *server = user;
    struct timespec pause = {0, 200000000};
    while (!atomic_load(&server->ending)) {
        followers_tick(server->followers);
        connections_sweep(server->connections);
        nanosleep(&pause, NULL);
    }
    return NULL;
}

static void on_log(void *user, const char *format, va_list arguments)
{
    char text[400];
    (void)user;
    vsnprintf(text, sizeof text, format, arguments);
    text[strcspn(text, "\n")] = 0;
    log_message(CONFIG_LOG_DEBUG, "libmicrohttpd: %s", text);
}

static struct MHD_Daemon *start_mhd(struct server *server, int listen_fd)
{
    const struct config *config = server->service->config;
    return MHD_start_daemon(
        MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG, 0, NULL, NULL,
        on_access, server, MHD_OPTION_EXTERNAL_LOGGER, on_log, NULL, MHD_OPTION_LISTEN_SOCKET,
        (MHD_socket)listen_fd, MHD_OPTION_THREAD_POOL_SIZE, (unsigned)config->http_threads,
        MHD_OPTION_CONNECTION_LIMIT, (unsigned)config->connections, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        (size_t)128 << 10, MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)config->idle_timeout_s,
        MHD_OPTION_URI_LOG_CALLBACK, on_target, server, MHD_OPTION_NOTIFY_COMPLETED, on_completed, server,
        MHD_OPTION_NOTIFY_CONNECTION, on_connection, server, MHD_OPTION_END);
}

groom_status server_start(const struct server_options *options, struct server **out, struct groom_diag *diag)
{
    const struct config *config = options->service->config;
    groom_status status = GROOM_ENOMEM;
    struct server *server = calloc(1, sizeof *server);
    if (!server)
        goto out;
    server->service = options->service;
    server->routes = options->routes;
    server->n_routes = options->n_routes;
    if (getrandom(&server->id_base, sizeof server->id_base, 0) < 0)
        server->id_base = (uint64_t)now_us();
    if ((status = lane_create(config->fast_threads, 10000, &server->fast)) != GROOM_OK ||
        (status = lane_create(config->slow_threads, config->slow_queue, &server->slow)) != GROOM_OK)
        goto out;
    status = GROOM_ENOMEM;
    if (!(server->followers = followers_create(options->service->jobs, server->fast)) ||
        !(server->connections = connections_create(config)) ||
        !(server->metrics = metrics_create(options->n_routes)) ||
        !(server->exports = export_cache_create(config->export_cache)) ||
        pthread_create(&server->ticker, NULL, tick, server))
        goto out;
    server->has_ticker = true;
    if (!(server->mhd = start_mhd(server, options->listen_fd))) {
        status = groom_fail(diag, GROOM_EIO, "libmicrohttpd does not start: %s", strerror(errno));
        goto out;
    }
    *out = server;
    return GROOM_OK;
out:
    close(options->listen_fd);
    server_destroy(server);
    return status;
}

static bool wait_until_zero(atomic_long *count, int64_t until_us)
{
    struct timespec pause = {0, 5000000};
    while (atomic_load(count) > 0 && now_us() < until_us)
        nanosleep(&pause, NULL);
    return atomic_load(count) <= 0;
}

bool server_stop(struct server *server, uint32_t timeout_ms)
{
    int64_t until = now_us() + (int64_t)timeout_ms * 1000;
    MHD_socket listening = MHD_quiesce_daemon(server->mhd);
    if (listening != MHD_INVALID_SOCKET) /* nobody gets in; closed when no thread can name it any more */
        shutdown(listening, SHUT_RDWR);
    atomic_store(&server->draining, true);
    followers_wake(server->followers);
    wait_until_zero(&server->n_requests, until - (int64_t)timeout_ms * 250);
    atomic_store(&server->closing, true);
    followers_wake(server->followers);
    if (!wait_until_zero(&server->n_suspended, until))
        return false;
    MHD_stop_daemon(server->mhd);
    server->mhd = NULL;
    if (listening != MHD_INVALID_SOCKET)
        close(listening);
    return true;
}

void server_destroy(struct server *server)
{
    if (!server)
        return;
    atomic_store(&server->ending, true);
    if (server->has_ticker)
        pthread_join(server->ticker, NULL);
    lane_destroy(server->slow);
    lane_destroy(server->fast);
    followers_destroy(server->followers);
    connections_destroy(server->connections);
    metrics_destroy(server->metrics);
    export_cache_destroy(server->exports);
    free(server);
}
