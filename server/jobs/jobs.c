#include "server/jobs/jobs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/queue.h"
#include "server/jobs/work.h"
#include "server/log.h"

groom_status jobs_create(struct store *store, struct blobs *blobs, struct jobs **jobs, struct groom_diag *diag)
{
    struct jobs *made = calloc(1, sizeof *made);
    if (!made || !(made->clock = stage_clock_create())) {
        free(made);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the queue");
    }
    made->store = store;
    made->blobs = blobs;
    pthread_mutex_init(&made->lock, NULL);
    *jobs = made;
    return GROOM_OK;
}

void jobs_destroy(struct jobs *jobs)
{
    if (!jobs)
        return;
    pthread_mutex_destroy(&jobs->lock);
    stage_clock_destroy(jobs->clock);
    free(jobs);
}

struct stage_clock *jobs_stage_clock(struct jobs *jobs) { return jobs->clock; }

void jobs_share_blobs(struct jobs *jobs, const char *folder)
{
    snprintf(jobs->shared_blobs, sizeof jobs->shared_blobs, "%s", folder);
}

bool jobs_attempt_is_stale(void *user, const char *name)
{
    struct jobs *jobs = user;
    struct store_job job = {0};
    char id[STORE_ID_SIZE];
    const char *dot = strrchr(name, '.');
    if (!dot || dot - name >= STORE_ID_SIZE)
        return false;
    snprintf(id, sizeof id, "%.*s", (int)(dot - name), name);
    if (store_job_get(jobs->store, id, &job, NULL) != GROOM_OK)
        return false; /* another daemon's, or nobody can tell */
    bool runs = job.state == STORE_JOB_RUNNING && job.attempt == (uint32_t)strtoul(dot + 1, NULL, 10);
    store_job_finish(&job);
    return !runs;
}

/* --- watching ------------------------------------------------------------------------- */

groom_status jobs_watch(struct jobs *jobs, const char *id, jobs_waker waker, void *user,
                        struct jobs_watch **watch)
{
    struct jobs_watch *made = calloc(1, sizeof *made);
    if (!made)
        return GROOM_ENOMEM;
    strncpy(made->job_id, id, sizeof made->job_id - 1);
    made->waker = waker;
    made->user = user;
    pthread_mutex_lock(&jobs->lock);
    made->next = jobs->watches;
    jobs->watches = made;
    pthread_mutex_unlock(&jobs->lock);
    *watch = made;
    return GROOM_OK;
}

void jobs_unwatch(struct jobs *jobs, struct jobs_watch *watch)
{
    if (!watch)
        return;
    pthread_mutex_lock(&jobs->lock);
    struct jobs_watch **at = &jobs->watches;
    while (*at && *at != watch)
        at = &(*at)->next;
    if (*at)
        *at = watch->next;
    pthread_mutex_unlock(&jobs->lock);
    free(watch);
}

size_t jobs_watching(struct jobs *jobs)
{
    size_t n = 0;
    pthread_mutex_lock(&jobs->lock);
    for (const struct jobs_watch *watch = jobs->watches; watch; watch = watch->next)
        n++;
    pthread_mutex_unlock(&jobs->lock);
    return n;
}

/* job_id NULL: all. The lock is held over the waker, so that jobs_unwatch waits for it. */
static void wake(struct jobs *jobs, const char *job_id)
{
    pthread_mutex_lock(&jobs->lock);
    for (struct jobs_watch *watch = jobs->watches; watch; watch = watch->next)
        if (!job_id || strcmp(watch->job_id, job_id) == 0)
            watch->waker(watch->user);
    pthread_mutex_unlock(&jobs->lock);
}

void jobs_notify(struct jobs *jobs, const char *job_id) { wake(jobs, job_id); }
void jobs_wake_all(struct jobs *jobs) { wake(jobs, NULL); }

void jobs_set_nudge(struct jobs *jobs, void (*nudge)(void *user), void *user)
{
    pthread_mutex_lock(&jobs->lock);
    jobs->nudge = nudge;
    jobs->nudge_user = user;
    pthread_mutex_unlock(&jobs->lock);
}

void jobs_nudge(struct jobs *jobs)
{
    pthread_mutex_lock(&jobs->lock);
    if (jobs->nudge)
        jobs->nudge(jobs->nudge_user);
    pthread_mutex_unlock(&jobs->lock);
}

/* --- moving ------------------------------------------------------------------------------ */

static groom_status is_referenced(void *user, const char *sha256, bool *referenced)
{
    return store_blob_referenced(user, sha256, referenced, NULL);
}

void jobs_drop_blob(struct jobs *jobs, const char *sha256)
{
    if (!sha256[0])
        return;
    groom_status status = blobs_collect(jobs->blobs, sha256, is_referenced, jobs->store, NULL, NULL);
    (void)status; /* garbage that stays is collected later */
}

groom_status jobs_collect_blobs(struct jobs *jobs, uint64_t *n_removed, struct groom_diag *diag)
{
    return blobs_collect_all(jobs->blobs, is_referenced, jobs->store, n_removed, diag);
}

/* Every change of a state; of an attempt that ended by itself also the first line of its last words. */
static void log_move(const struct store_job_move *move)
{
    char words[400], line[200] = "";
    if (move->last_words)
        snprintf(line, sizeof line, "%.*s", (int)strcspn(move->last_words, "\n"), move->last_words);
    log_job(CONFIG_LOG_INFO, "job", move->job_id, move->attempt, "\"state\":\"%s\"%s%s%s%s%s%s", store_job_state_name(move->to),
            move->attempt ? ",\"attempt_state\":\"" : "", move->attempt ? store_attempt_state_name(move->attempt_state) : "",
            move->attempt ? "\"" : "", line[0] ? ",\"last_words\":\"" : "", log_escape(line, words, sizeof words),
            line[0] ? "\"" : "");
}

groom_status jobs_move(struct jobs *jobs, const struct store_job_move *move, struct groom_diag *diag)
{
    char garbage[STORE_HASH_SIZE] = "";
    groom_status status = store_job_move(jobs->store, move, garbage, diag);
    if (status != GROOM_OK)
        return status;
    log_move(move);
    stage_clock_leave(jobs->clock, move->job_id, move->to == STORE_JOB_SUCCEEDED);
    jobs_drop_blob(jobs, garbage);
    jobs_notify(jobs, move->job_id);
    jobs_nudge(jobs);
    return GROOM_OK;
}

/* --- what HTTP calls ------------------------------------------------------------------------ */

void jobs_set_webhook(struct jobs *jobs, const struct store_webhook_new *webhook) { jobs->webhook = *webhook; }

/* The job's own and everybody's. returns  how many */
static size_t list_webhooks(const struct jobs *jobs, const struct jobs_request *request,
                            struct store_webhook_new webhooks[2])
{
    size_t n = 0;
    if (request->webhook)
        webhooks[n++] = *request->webhook;
    if (jobs->webhook.url)
        webhooks[n++] = jobs->webhook;
    return n;
}

groom_status jobs_submit(struct jobs *jobs, const struct jobs_request *request, struct store_job *job,
                         struct groom_diag *diag)
{
    char id[STORE_ID_SIZE];
    struct store_webhook_new webhooks[2];
    struct store_job_new row = {.webhooks = webhooks, .n_webhooks = list_webhooks(jobs, request, webhooks), .id = id, .kind = request->kind, .request = request->inputs,
                                .options = request->options, .priority = request->priority,
                                .project = request->project, .owner = request->owner,
                                .max_queued = request->max_queued,
                                .max_queued_of_owner = request->max_queued_of_owner};
    groom_status status = store_make_id("job_", id);
    if (status != GROOM_OK)
        return groom_fail(diag, status, "a job could not be made");
    if ((status = store_job_create(jobs->store, &row, diag)) != GROOM_OK)
        return status;
    log_job(CONFIG_LOG_INFO, "job", id, 0, "\"state\":\"queued\",\"kind\":\"%.20s\"", request->kind);
    jobs_nudge(jobs);
    return store_job_get(jobs->store, id, job, diag);
}

groom_status jobs_get(struct jobs *jobs, const char *id, struct store_job *job, struct groom_diag *diag)
{
    return store_job_get(jobs->store, id, job, diag);
}

groom_status jobs_list(struct jobs *jobs, const char *project, const enum store_job_state *state,
                       struct store_page page, struct store_job_list *list, struct groom_diag *diag)
{
    return store_jobs_list(jobs->store, project, state, page, list, diag);
}

/* A queued job may be taken between the look and the move: then it is a running one's turn. */
groom_status jobs_cancel(struct jobs *jobs, const char *id, struct store_job *job, struct groom_diag *diag)
{
    enum store_job_state state;
    groom_status status;
    do {
        if ((status = store_job_request_cancel(jobs->store, id, &state, diag)) != GROOM_OK)
            return status;
        if (state == STORE_JOB_QUEUED) {
            struct store_job_move move = {.job_id = id, .from = state, .to = STORE_JOB_CANCELLED};
            status = jobs_move(jobs, &move, diag);
        } else if (state == STORE_JOB_RUNNING) {
            jobs_nudge(jobs);
        }
    } while (status == GROOM_ECONFLICT);
    return status == GROOM_OK ? store_job_get(jobs->store, id, job, diag) : status;
}

groom_status jobs_events_since(struct jobs *jobs, const char *id, int64_t after, uint32_t limit,
                               struct store_event_list *list, struct groom_diag *diag)
{
    return store_events_since(jobs->store, id, after, limit, list, diag);
}
