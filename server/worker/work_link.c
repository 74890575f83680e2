#include "server/worker/work_link.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "proto/problem.h"
#include "proto/work.h"
#include "server/worker/clock.h"

#define MENTION_TIMEOUT_MS 500
#define CLOSING_TIMEOUT_MS 800
#define BACKOFF_FIRST_MS   100
#define BACKOFF_LAST_MS    5000

static int asked_to_stop(void *user)
{
    const struct work_link *link = user;
    return *link->stop && !link->closing;
}

static double number_of_environment(const char *name, double otherwise)
{
    const char *text = getenv(name);
    return text && text[0] >= '0' && text[0] <= '9' ? strtod(text, NULL) : otherwise;
}

int work_link_open(struct work_link *link, const char *url, const char *token,
                   const volatile sig_atomic_t *stop)
{
    char numbered[320];
    memset(link, 0, sizeof *link);
    link->stop = stop;
    link->patience_s = number_of_environment(WORK_ENV_PATIENCE, 60);
    unsigned run = (unsigned)number_of_environment(WORK_ENV_RUN, 0);
    if (run > 0) {
        snprintf(numbered, sizeof numbered, "%.300s.%u", token, run);
        token = numbered;
    }
    link->client = http_client_create(&(struct http_client_options){.base_url = url,
                                                                    .token = token,
                                                                    .agent = "groom-worker",
                                                                    .interrupted = asked_to_stop,
                                                                    .user = link});
    return link->client != NULL;
}

void work_link_close(struct work_link *link)
{
    http_client_destroy(link->client);
    link->client = NULL;
}

/* --- what an answer means -------------------------------------------------------------- */

static groom_status leave(struct work_link *link, const char *why)
{
    snprintf(link->why, sizeof link->why, "%s", why);
    return GROOM_ECANCELLED;
}

static groom_status refused(const struct http_response *response, struct groom_diag *diag)
{
    cJSON *json = response->body ? cJSON_ParseWithLength(response->body, response->n_body) : NULL;
    struct problem problem;
    int known = problem_from_json(json, &problem);
    cJSON_Delete(json);
    if (response->status == 507)
        return groom_fail(diag, GROOM_ENOSPC, "%s", known ? problem.detail : "the daemon's disk is full");
    if (response->status == 413)
        return groom_fail(diag, GROOM_ETOOBIG, "%s", known ? problem.detail : "the daemon takes less");
    return groom_fail(diag, GROOM_EIO, "the daemon answered %d: %.300s", response->status,
                      known ? (problem.detail[0] ? problem.detail : problem.title) : "no reason given");
}

static int is_fence(int status) { return status == 401 || status == 409 || status == 410; }

static int is_passing(http_outcome outcome, int status)
{
    return outcome == HTTP_UNREACHABLE || outcome == HTTP_BROKEN || outcome == HTTP_NO_MEMORY ||
           (outcome == HTTP_ANSWERED &&
            (status == 429 || status == 408 || (status >= 500 && status != 507 && status != 501)));
}

static groom_status judge(struct work_link *link, http_outcome outcome, const struct http_response *response,
                          struct groom_diag *diag)
{
    if (outcome == HTTP_INTERRUPTED)
        return leave(link, "asked to stop");
    if (outcome == HTTP_REFUSED_URL)
        return groom_fail(diag, GROOM_EINVAL, "the daemon's address is not a URL: %.200s", response->failure);
    if (outcome != HTTP_ANSWERED)
        return leave(link, "the daemon does not answer");
    if (is_fence(response->status))
        return leave(link, "the daemon has given this work to another attempt, or ended it");
    return response->status >= 200 && response->status < 300 ? GROOM_OK : refused(response, diag);
}

/* --- calls -------------------------------------------------------------------------------- */

/* Sleeps in short naps, so that a signal is seen at once. */
static void nap(const struct work_link *link, int ms)
{
    for (; ms > 0 && !asked_to_stop((void *)(uintptr_t)link); ms -= 50) {
        struct timespec t = {0, 50 * 1000000L};
        nanosleep(&t, NULL);
    }
}

groom_status work_link_call(struct work_link *link, const struct http_request *request,
                            struct http_response *response, struct groom_diag *diag)
{
    struct http_response unread = {0}, *answer = response ? response : &unread;
    struct http_request timed = *request;
    double give_up = clock_s() + (link->closing ? 0 : link->patience_s);
    http_outcome outcome;
    if (link->closing)
        timed.timeout_ms = CLOSING_TIMEOUT_MS;
    for (int backoff_ms = BACKOFF_FIRST_MS;;
         backoff_ms = backoff_ms < BACKOFF_LAST_MS ? 2 * backoff_ms : BACKOFF_LAST_MS) {
        outcome = http_perform(link->client, &timed, answer);
        if (!is_passing(outcome, answer->status) || clock_s() >= give_up || asked_to_stop(link))
            break;
        http_response_finish(answer);
        nap(link, backoff_ms);
    }
    groom_status st = judge(link, outcome, answer, diag);
    if (!response)
        http_response_finish(&unread);
    return st;
}

groom_status work_link_mention(struct work_link *link, const struct http_request *request,
                               struct http_response *response, struct groom_diag *diag)
{
    struct http_request timed = *request;
    timed.timeout_ms = MENTION_TIMEOUT_MS;
    http_outcome outcome = http_perform(link->client, &timed, response);
    if (!is_passing(outcome, response->status))
        return judge(link, outcome, response, diag);
    response->status = 0;
    return GROOM_OK;
}

void work_link_farewell(struct work_link *link, const char *words)
{
    cJSON *message = cJSON_CreateObject();
    cJSON_AddStringToObject(message, "words", words);
    char *text = cJSON_PrintUnformatted(message);
    cJSON_Delete(message);
    struct http_request request = {.method = "POST",
                                   .path = WORK_PATH_ENDED,
                                   .content_type = "application/json",
                                   .body = text,
                                   .n_body = text ? strlen(text) : 0};
    link->closing = 1;
    /* where it does not get through, the launcher says it later */
    if (text && work_link_call(link, &request, NULL, NULL) != GROOM_OK)
        fprintf(stderr, "groom-worker: the daemon was not told how it ended\n");
    free(text);
}
