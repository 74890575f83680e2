#include "server/http/request.h"

#include <cjson/cJSON.h>
#include <ctype.h>
#include <errno.h>
#include <microhttpd.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "proto/json_text.h"
#include "server/store/store.h"

/* --- reading ---------------------------------------------------------------------- */

const char *request_header(const struct request *request, const char *name)
{
    return MHD_lookup_connection_value(request->connection, MHD_HEADER_KIND, name);
}

const char *request_query(const struct request *request, const char *name)
{
    return uri_query(&request->uri, name);
}

bool request_is_head(const struct request *request) { return !strcmp(request->method, "HEAD"); }

static bool parse_number(const char *text, uint64_t *value)
{
    char *end;
    errno = 0;
    if (!isdigit((unsigned char)text[0]))
        return false;
    *value = strtoull(text, &end, 10);
    return !errno && !*end;
}

bool request_query_number(struct request *request, const char *name, uint64_t minimum, uint64_t maximum,
                          uint64_t *value)
{
    const char *text = request_query(request, name);
    uint64_t number;
    if (!text)
        return true;
    if (!parse_number(text, &number) || number < minimum || number > maximum) {
        respond_bad_query(request, name, "%s is \"%.40s\"; it must be a whole number from %llu to %llu", name,
                          text, (unsigned long long)minimum, (unsigned long long)maximum);
        return false;
    }
    *value = number;
    return true;
}

bool request_query_real(struct request *request, const char *name, double minimum, double maximum, double *value)
{
    const char *text = request_query(request, name);
    char *end;
    if (!text)
        return true;
    double number = strtod(text, &end);
    if (end == text || *end || !(number >= minimum && number <= maximum)) {
        respond_bad_query(request, name, "%s is \"%.40s\"; it must be a number from %g to %g", name, text, minimum,
                          maximum);
        return false;
    }
    *value = number;
    return true;
}

bool request_query_bool(struct request *request, const char *name, bool *value)
{
    const char *text = request_query(request, name);
    if (!text)
        return true;
    if (strcmp(text, "true") && strcmp(text, "false")) {
        respond_bad_query(request, name, "%s is \"%.40s\"; it must be true or false", name, text);
        return false;
    }
    *value = text[0] == 't';
    return true;
}

cJSON *request_json(struct request *request)
{
    struct json_text_error error;
    struct problem problem;
    cJSON *json = json_text_parse(request->body ? request->body : "", request->n_body, &error);
    if (!json) {
        problem_set(&problem, 400, "invalid-json", "the body is not JSON that can be taken", "%s",
                    error.detail);
        problem.byte_offset = error.byte_offset;
        respond_problem(request, &problem);
    } else if (!cJSON_IsObject(json)) {
        respond_bad_field(request, 400, "", "the body must be a JSON object");
        cJSON_Delete(json);
        json = NULL;
    }
    return json;
}

bool request_page(struct request *request, struct store_page *page)
{
    uint64_t limit = 100, before = 0;
    if (!request_query_number(request, "limit", 1, 1000, &limit) ||
        !request_query_number(request, "before", 1, INT64_MAX, &before))
        return false;
    *page = (struct store_page){.before = (int64_t)before, .limit = (uint32_t)limit};
    return true;
}

bool request_if_match(struct request *request, uint32_t *revision)
{
    uint64_t number = 0;
    char text[24];
    const char *value = request_header(request, "If-Match");
    if (!value) {
        respond_refusal(request, 428, "precondition-required", "the request must name what it changes",
                        "send If-Match with the ETag of the revision that this edit starts from");
        return false;
    }
    size_t n = strlen(value);
    bool quoted = n >= 3 && n < sizeof text && value[0] == '"' && value[n - 1] == '"';
    if (quoted) {
        memcpy(text, value + 1, n - 2);
        text[n - 2] = 0;
    }
    if (!quoted || !parse_number(text, &number) || number == 0 || number > UINT32_MAX) {
        respond_refusal(request, 412, "precondition-failed", "it was changed meanwhile",
                        "If-Match is %.60s; it must be the ETag of a revision, like \"3\" with its quotes",
                        value);
        return false;
    }
    *revision = (uint32_t)number;
    return true;
}

/* RFC 9110, 13.1.2: a list of quoted tags or *; weak comparison. */
static bool list_names(const char *list, const char *etag)
{
    size_t n = strlen(etag);
    if (!strcmp(list, "*"))
        return true;
    for (const char *at = strchr(list, '"'); at; at = strchr(at, '"')) {
        const char *end = strchr(++at, '"');
        if (!end)
            return false;
        if ((size_t)(end - at) == n && !strncmp(at, etag, n))
            return true;
        at = end + 1;
    }
    return false;
}

bool request_not_modified(struct request *request, const char *etag)
{
    const char *list = request_header(request, "If-None-Match");
    if (!list || !list_names(list, etag))
        return false;
    respond_empty(request, 304);
    respond_etag(request, "%s", etag);
    return true;
}

uint32_t request_wait_s(const struct request *request)
{
    const char *prefer = request_header(request, "Prefer");
    const char *wait = prefer ? strcasestr(prefer, "wait=") : NULL;
    if (!wait || (wait > prefer && !strchr(" ,;", wait[-1])))
        return 0;
    unsigned long seconds = strtoul(wait + 5, NULL, 10);
    uint64_t most = request->service->config->max_wait_s;
    return (uint32_t)(seconds < most ? seconds : most);
}

/* --- answering ---------------------------------------------------------------------- */

void response_finish(struct response *response)
{
    if (response->kind == RESPONSE_BYTES && !response->is_static)
        free(response->bytes);
    if (response->kind == RESPONSE_FILE && response->fd >= 0)
        close(response->fd);
    if (response->kind == RESPONSE_PIECES && response->pieces)
        response->pieces->release(response->pieces);
    *response = (struct response){.fd = -1};
}

static struct response *begin(struct request *request, enum response_kind kind, int status,
                              const char *content_type)
{
    struct response *response = &request->response;
    response_finish(response);
    *response = (struct response){.kind = kind, .status = status, .content_type = content_type, .fd = -1};
    return response;
}

void respond_bytes(struct request *request, int status, const char *content_type, char *bytes, size_t n_bytes)
{
    struct response *response = begin(request, RESPONSE_BYTES, status, content_type);
    response->bytes = bytes;
    response->n_bytes = n_bytes;
}

void respond_static(struct request *request, int status, const char *content_type, const char *bytes,
                    size_t n_bytes)
{
    struct response *response = begin(request, RESPONSE_BYTES, status, content_type);
    response->bytes = (char *)(size_t)bytes; /* only read: is_static */
    response->n_bytes = n_bytes;
    response->is_static = true;
}

void respond_empty(struct request *request, int status) { respond_static(request, status, NULL, "", 0); }

void respond_file(struct request *request, const char *content_type, int fd, uint64_t n_bytes)
{
    struct response *response = begin(request, RESPONSE_FILE, 200, content_type);
    response->fd = fd;
    response->n_file = n_bytes;
}

void respond_pieces(struct request *request, const char *content_type, struct response_pieces *pieces)
{
    begin(request, RESPONSE_PIECES, 200, content_type)->pieces = pieces;
}

void respond_events(struct request *request, struct event_feed *feed)
{
    begin(request, RESPONSE_EVENTS, 200, "text/event-stream")->feed = feed;
}

static const char no_memory[] =
    "{\"type\":\"/problems/out-of-memory\",\"title\":\"memory ran out\",\"status\":507}";

void respond_json(struct request *request, int status, cJSON *json)
{
    char *text = json ? cJSON_PrintUnformatted(json) : NULL;
    cJSON_Delete(json);
    if (text && json_memory_failed()) { /* a member is missing */
        free(text);
        text = NULL;
    }
    if (text)
        respond_bytes(request, status, "application/json", text, strlen(text));
    else
        respond_static(request, 507, PROBLEM_MEDIA_TYPE, no_memory, sizeof no_memory - 1);
}

void respond_problem(struct request *request, const struct problem *problem)
{
    struct problem full = *problem;
    snprintf(full.instance, sizeof full.instance, "%s", request->path);
    snprintf(full.request, sizeof full.request, "%s", request->id);
    char *text = problem_print(&full);
    if (text)
        respond_bytes(request, full.status, PROBLEM_MEDIA_TYPE, text, strlen(text));
    else
        respond_static(request, 507, PROBLEM_MEDIA_TYPE, no_memory, sizeof no_memory - 1);
    if (full.status == 429 || full.status == 503)
        respond_header(request, "Retry-After", "%u", request->retry_after_s ? request->retry_after_s : 2);
}

void respond_failure(struct request *request, groom_status status, const struct groom_diag *diag)
{
    struct problem problem;
    bool has_detail = diag && diag->status == status;
    problem_set(&problem, groom_status_http(status), groom_status_name(status), groom_status_message(status),
                "%s", has_detail ? diag->detail : "");
    if (has_detail) {
        snprintf(problem.pointer, sizeof problem.pointer, "%s", diag->pointer);
        problem.byte_offset = diag->byte_offset;
    }
    respond_problem(request, &problem);
}

void respond_refusal(struct request *request, int status, const char *name, const char *title,
                     const char *format, ...)
{
    char detail[512];
    struct problem problem;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    respond_problem(request, problem_set(&problem, status, name, title, "%s", detail));
}

void respond_bad_query(struct request *request, const char *parameter, const char *format, ...)
{
    char detail[512];
    struct problem problem;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    problem_set(&problem, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL), "%s",
                detail);
    snprintf(problem.parameter, sizeof problem.parameter, "%s", parameter);
    respond_problem(request, &problem);
}

void respond_bad_field(struct request *request, int status, const char *pointer, const char *format, ...)
{
    char detail[512];
    struct problem problem;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    problem_set(&problem, status, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL), "%s",
                detail);
    snprintf(problem.pointer, sizeof problem.pointer, "%s", pointer);
    respond_problem(request, &problem);
}

void respond_header(struct request *request, const char *name, const char *format, ...)
{
    struct response *response = &request->response;
    va_list arguments;
    if (response->n_headers == RESPONSE_MAX_HEADERS)
        return;
    va_start(arguments, format);
    vsnprintf(response->headers[response->n_headers].value, sizeof response->headers[0].value, format,
              arguments);
    va_end(arguments);
    response->headers[response->n_headers++].name = name;
}

void respond_etag(struct request *request, const char *format, ...)
{
    char tag[72];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(tag, sizeof tag, format, arguments);
    va_end(arguments);
    snprintf(request->response.etag, sizeof request->response.etag, "\"%s\"", tag);
}
