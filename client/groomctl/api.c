#include "client/groomctl/api.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/problem.h"
#include "proto/url.h"

const char *api_text(const cJSON *object, const char *name)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    return text ? text : "";
}

double api_number(const cJSON *object, const char *name, double otherwise)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : otherwise;
}

void api_print(const struct groomctl *ctl, const cJSON *json)
{
    char *text = ctl->json ? cJSON_PrintUnformatted(json) : cJSON_Print(json);
    puts(text ? text : "null");
    fflush(stdout);
    free(text);
}

/* --- complaints ----------------------------------------------------------------------- */

/* The way out, by status. */
static const char *way_out(int status)
{
    switch (status) {
    case 401:
        return "give the server's token in GROOMD_TOKEN (or --token, --token-file); `groomd token create` makes one";
    case 403:
        return "this token may not do that; ask for one with the scope that is missing";
    case 404:
        return "`groomctl list strands|heads|jobs|grooms` shows what is there";
    case 412:
        return "it was changed meanwhile: look at it (`groomctl get`), then do it again";
    case 413:
        return "send less, or raise the server's limit (`groomd --help`)";
    case 415:
        return "name the format with --format; `groomctl upload --help` lists them";
    case 429:
    case 503:
        return "the server is busy: try again in a moment";
    case 507:
        return "the server's disk is full: make room there";
    default:
        return NULL;
    }
}

static void explain_problem(const struct http_response *response, const struct problem *problem)
{
    const char *help = way_out(response->status);
    fprintf(stderr, "groomctl: %s (%d)\n", problem->title[0] ? problem->title : "the server refused",
            response->status);
    if (problem->detail[0])
        fprintf(stderr, "  %s\n", problem->detail);
    if (problem->pointer[0])
        fprintf(stderr, "  at %s\n", problem->pointer);
    if (problem->byte_offset >= 0)
        fprintf(stderr, "  at byte %lld\n", (long long)problem->byte_offset);
    if (response->retry_after_s >= 0)
        fprintf(stderr, "  try again in %d s\n", response->retry_after_s);
    else if (help)
        fprintf(stderr, "  %s\n", help);
}

static int complain_of_answer(const struct groomctl *ctl, const struct http_response *response)
{
    cJSON *json = response->body ? cJSON_ParseWithLength(response->body, response->n_body) : NULL;
    struct problem problem;
    int is_problem = problem_from_json(json, &problem);
    if (!is_problem)
        problem = (struct problem){.status = response->status, .byte_offset = -1};
    if (!is_problem && (response->status < 500 || response->status > 504))
        fprintf(stderr,
                "groomctl: %s answers (%d), but not as a groomd does\n  name the daemon's address with --server URL; it prints it "
                "when it starts\n",
                http_client_base_url(ctl->client), response->status);
    else if (ctl->json && json)
        fprintf(stderr, "%.*s\n", (int)response->n_body, response->body);
    else
        explain_problem(response, &problem);
    cJSON_Delete(json);
    return REFUSED;
}

int api_complain(struct groomctl *ctl, http_outcome outcome, const struct http_response *response)
{
    switch (outcome) {
    case HTTP_ANSWERED:
        return complain_of_answer(ctl, response);
    case HTTP_INTERRUPTED:
        return INTERRUPTED;
    case HTTP_UNREACHABLE:
        fprintf(stderr,
                "groomctl: no server answers at %s (%s)\n"
                "  start one with `groomd --data DIR --listen 127.0.0.1:8080`, or name another with --server "
                "URL\n",
                http_client_base_url(ctl->client), response->failure);
        return REFUSED;
    case HTTP_REFUSED_URL:
        fprintf(stderr, "groomctl: %s is not the address of a server (%s); http://HOST:PORT is\n",
                http_client_base_url(ctl->client), response->failure);
        return WRONG_USAGE;
    case HTTP_NO_MEMORY:
        fputs("groomctl: out of memory\n", stderr);
        return REFUSED;
    case HTTP_BROKEN:
        break;
    }
    fprintf(stderr,
            "groomctl: the connection to %s broke (%s)\n  do it again; `groomctl health` says whether the "
            "server is well\n",
            http_client_base_url(ctl->client), response->failure);
    return REFUSED;
}

/* --- calls -------------------------------------------------------------------------------- */

int api_call(struct groomctl *ctl, const struct http_request *request, struct http_response *response)
{
    http_outcome outcome = http_perform(ctl->client, request, response);
    if (outcome == HTTP_ANSWERED && response->status >= 200 && response->status < 300)
        return DONE;
    return api_complain(ctl, outcome, response);
}

static int take_json(const struct http_response *response, cJSON **answer)
{
    *answer = response->n_body ? cJSON_ParseWithLength(response->body, response->n_body) : NULL;
    if (*answer || !response->n_body)
        return DONE;
    fprintf(stderr, "groomctl: the server's answer is not JSON; is this a groomd?\n");
    return REFUSED;
}

int api_json(struct groomctl *ctl, const char *method, const char *path, const cJSON *body,
             const char *header, cJSON **answer)
{
    char *text = body ? cJSON_PrintUnformatted(body) : NULL;
    struct http_request request = {.method = method,
                                   .path = path,
                                   .headers = {header},
                                   .body = text,
                                   .n_body = text ? strlen(text) : 0,
                                   .content_type = text ? "application/json" : NULL};
    struct http_response response;
    int status = api_call(ctl, &request, &response);
    if (status == DONE && answer)
        status = take_json(&response, answer);
    http_response_finish(&response);
    free(text);
    return status;
}

int api_if_match(struct groomctl *ctl, const char *groom, char *header, size_t size)
{
    struct url url;
    struct http_response response;
    url_init(&url, "/v1/grooms");
    url_segment(&url, groom);
    url_query(&url, "arrays", "false");
    int status = api_call(ctl, &(struct http_request){.method = "GET", .path = url.text}, &response);
    if (status == DONE)
        snprintf(header, size, "If-Match: %s", response.etag);
    http_response_finish(&response);
    return status;
}
