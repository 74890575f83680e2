/* watch: jobs, live from their event streams. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "client/groomctl/jobs.h"
#include "proto/url.h"

/* How long a server that went away is waited for. */
#define PATIENCE_S 60

struct watch;
struct following {
    struct watch *watch;
    struct job_view *view;
    struct event_stream stream;
    char path[160], last_event_header[96];
};

struct watch {
    struct groomctl *ctl;
    struct following *jobs;
    size_t n;
    size_t n_lines; /* drawn on the terminal */
    int draws;      /* bars rather than lines */
    double heard_s; /* when the server last said something */
};

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec;
}

/* --- showing ----------------------------------------------------------------------------- */

static void draw(void *user)
{
    struct watch *w = user;
    char lines[JOBS_MAX_WATCHED][256], note[64];
    struct progress_line line;
    if (!w->draws)
        return;
    for (size_t i = 0; i < w->n; i++) {
        job_view_line(w->jobs[i].view, w->n > 1, note, &line);
        progress_bar_text(&line, progress_columns(), lines[i], sizeof lines[i]);
    }
    w->n_lines = progress_draw((const char(*)[256])lines, w->n, w->n_lines);
}

static void print_line(const struct job_view *view)
{
    char text[256], note[64];
    struct progress_line line;
    if (job_state_is_end(view->state))
        return; /* said at the end */
    job_view_line(view, 1, note, &line);
    progress_plain_text(&line, text, sizeof text);
    printf("%s\n", text);
    fflush(stdout);
}

static void print_event(const struct following *f, const char *event, const cJSON *data)
{
    cJSON *object = cJSON_CreateObject();
    const cJSON *item;
    cJSON_AddStringToObject(object, "job", f->view->id);
    cJSON_AddStringToObject(object, "event", event);
    cJSON_ArrayForEach(item, data)
    {
        if (item->string && !cJSON_HasObjectItem(object, item->string))
            cJSON_AddItemToObject(object, item->string, cJSON_Duplicate(item, 1));
    }
    api_print(f->watch->ctl, object);
    cJSON_Delete(object);
}

/* --- hearing --------------------------------------------------------------------------------- */

static void on_event(void *user, const struct event *event)
{
    struct following *f = user;
    cJSON *data = cJSON_Parse(event->data);
    if (cJSON_IsObject(data)) {
        int is_news = job_view_event(f->view, event->name, data);
        if (f->watch->ctl->json)
            print_event(f, event->name, data);
        else if (is_news && !f->watch->draws)
            print_line(f->view);
    }
    cJSON_Delete(data);
}

static size_t on_bytes(void *user, const char *bytes, size_t n)
{
    struct following *f = user;
    f->watch->heard_s = now_s();
    event_stream_feed(&f->stream, bytes, n);
    return job_state_is_end(f->view->state) ? 0 : n;
}

static struct http_request request_for(struct following *f)
{
    struct http_request request = {.method = "GET",
                                   .path = f->path,
                                   .headers = {"Accept: text/event-stream"},
                                   .sink = on_bytes,
                                   .user = f,
                                   .is_vital = 1,
                                   .idle_timeout_s = 45};
    event_stream_reconnect(&f->stream);
    if (!f->stream.id[0])
        return request;
    snprintf(f->last_event_header, sizeof f->last_event_header, "Last-Event-ID: %s", f->stream.id);
    request.headers[1] = f->last_event_header;
    return request;
}

/* A refusal ends the watching; a server that went away is waited for. */
static int judge(struct watch *w, const http_outcome *outcomes, const struct http_response *responses,
                 size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (outcomes[i] == HTTP_ANSWERED && responses[i].status >= 400 && responses[i].status < 500)
            return api_complain(w->ctl, outcomes[i], &responses[i]);
    for (size_t i = 0; i < n; i++)
        if (outcomes[i] != HTTP_ANSWERED && outcomes[i] != HTTP_INTERRUPTED &&
            now_s() - w->heard_s > PATIENCE_S)
            return api_complain(w->ctl, outcomes[i], &responses[i]);
    return groomctl_interrupted() ? INTERRUPTED : DONE;
}

/* One round: all jobs that have not ended, until a stream ends. *left: how many there were. */
static int listen_once(struct watch *w, size_t *left)
{
    struct http_request requests[JOBS_MAX_WATCHED];
    struct http_response responses[JOBS_MAX_WATCHED];
    http_outcome outcomes[JOBS_MAX_WATCHED];
    size_t n = 0;
    for (size_t i = 0; i < w->n; i++)
        if (!job_state_is_end(w->jobs[i].view->state))
            requests[n++] = request_for(&w->jobs[i]);
    *left = n;
    if (!n)
        return DONE;
    http_perform_all(w->ctl->client, requests, n, responses, outcomes, draw, w);
    int status = judge(w, outcomes, responses, n);
    for (size_t i = 0; i < n; i++)
        http_response_finish(&responses[i]);
    return status;
}

static void nap(void)
{
    struct timespec t = {0, 200 * 1000000L};
    nanosleep(&t, NULL);
}

static int listen_to_all(struct watch *w)
{
    size_t left = 1;
    int status = DONE;
    w->heard_s = now_s();
    for (;;) {
        status = listen_once(w, &left);
        if (status != DONE || !left)
            return status;
        nap();
    }
}

/* --- ends ----------------------------------------------------------------------------------------- */

static int finish(struct watch *w)
{
    int status = DONE;
    for (size_t i = 0; i < w->n; i++) {
        struct job_view *view = w->jobs[i].view;
        if (view->state != JOB_STATE_SUCCEEDED)
            status = REFUSED;
        /* the resource knows all of it: the groom, or the whole problem */
        int looked = jobs_look(w->ctl, view, NULL);
        if (looked != DONE)
            return looked;
        if (!w->ctl->json)
            job_view_print_end(view);
    }
    return status;
}

static void say_that_they_go_on(const struct watch *w)
{
    for (size_t i = 0; i < w->n; i++)
        if (!job_state_is_end(w->jobs[i].view->state))
            fprintf(stderr,
                    "groomctl: interrupted; %s goes on. Watch it: groomctl watch %s; end it: groomctl cancel "
                    "%s\n",
                    w->jobs[i].view->id, w->jobs[i].view->id, w->jobs[i].view->id);
}

int jobs_watch_all(struct groomctl *ctl, struct job_view *views, size_t n)
{
    struct watch watch = {.ctl = ctl, .n = n, .draws = ctl->is_terminal && !ctl->json};
    watch.jobs = calloc(n, sizeof *watch.jobs);
    if (!watch.jobs)
        return REFUSED;
    for (size_t i = 0; i < n; i++) {
        struct following *f = &watch.jobs[i];
        f->watch = &watch;
        f->view = &views[i];
        snprintf(f->path, sizeof f->path, "/v1/jobs/%s/events", views[i].id);
        event_stream_init(&f->stream, on_event, f);
    }
    int status = listen_to_all(&watch);
    if (status != INTERRUPTED)
        draw(&watch);
    if (status == DONE)
        status = finish(&watch);
    if (status == INTERRUPTED)
        say_that_they_go_on(&watch);
    free(watch.jobs);
    return status;
}

int jobs_look(struct groomctl *ctl, struct job_view *view, cJSON **resource)
{
    struct url url;
    cJSON *job = NULL;
    url_init(&url, "/v1/jobs");
    url_segment(&url, view->id);
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &job);
    if (status == DONE)
        job_view_resource(view, job);
    if (status == DONE && resource)
        *resource = job;
    else
        cJSON_Delete(job);
    return status;
}

/* --- the command ------------------------------------------------------------------------------------ */

/* Jobs in this state, behind those that are there already; as many as can be watched. */
static int add_jobs(struct groomctl *ctl, const char *state, struct job_view *views, size_t *n)
{
    struct url url;
    cJSON *page = NULL;
    const cJSON *job;
    url_init(&url, "/v1/jobs");
    url_query(&url, "state", state);
    url_query_number(&url, "limit", JOBS_MAX_WATCHED);
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &page);
    cJSON_ArrayForEach(job, cJSON_GetObjectItemCaseSensitive(page, "jobs"))
    {
        if (*n < JOBS_MAX_WATCHED)
            job_view_init(&views[(*n)++], api_text(job, "id"));
    }
    cJSON_Delete(page);
    return status;
}

static int watch_all(struct groomctl *ctl)
{
    struct job_view views[JOBS_MAX_WATCHED];
    size_t n = 0;
    int status = add_jobs(ctl, "running", views, &n);
    if (status == DONE)
        status = add_jobs(ctl, "queued", views, &n);
    if (status == DONE && n == 0 && !ctl->json)
        printf("no job runs or waits\n");
    return status == DONE && n ? jobs_watch_all(ctl, views, n) : status;
}

int command_watch(struct groomctl *ctl, const struct arguments *arguments)
{
    struct job_view views[JOBS_MAX_WATCHED];
    if (!argument(arguments, "all") == !arguments->n_operands)
        return groomctl_usage_error("watch", "name jobs, or give --all");
    if (argument(arguments, "all"))
        return watch_all(ctl);
    if (arguments->n_operands > JOBS_MAX_WATCHED)
        return groomctl_usage_error("watch", "at most %d jobs at a time", JOBS_MAX_WATCHED);
    for (size_t i = 0; i < arguments->n_operands; i++) {
        job_view_init(&views[i], arguments->operands[i]);
        int status = jobs_look(ctl, &views[i], NULL);
        if (status != DONE)
            return status;
        if (ctl->json) /* all events, of jobs that have ended too */
            job_view_init(&views[i], arguments->operands[i]);
    }
    return jobs_watch_all(ctl, views, arguments->n_operands);
}
