/* Jobs: creating and reading them. What changes their state is in moves.c. */
#include <stdlib.h>
#include <string.h>

#include "server/store/database.h"

static const char *const state_names[STORE_JOB_STATES] = {
    [STORE_JOB_QUEUED] = "queued",       [STORE_JOB_RUNNING] = "running",
    [STORE_JOB_SUCCEEDED] = "succeeded", [STORE_JOB_FAILED] = "failed",
    [STORE_JOB_CANCELLED] = "cancelled",
};

const char *store_job_state_name(enum store_job_state state)
{
    return (unsigned)state < STORE_JOB_STATES ? state_names[state] : "unknown";
}

groom_status store_job_state_parse(const char *name, enum store_job_state *state, struct groom_diag *diag)
{
    for (int i = 0; i < STORE_JOB_STATES; i++) {
        if (strcmp(name, state_names[i]) == 0) {
            *state = (enum store_job_state)i;
            return GROOM_OK;
        }
    }
    return groom_fail(diag, GROOM_EINVAL,
                      "the state is queued, running, succeeded, failed or cancelled, not %.40s", name);
}

bool store_job_state_is_end(enum store_job_state state) { return state >= STORE_JOB_SUCCEEDED; }

/* --- creating ------------------------------------------------------------------------- */

static groom_status check_queue(struct connection *c, const struct store_job_new *job, const char *owner,
                                struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT count(*), count(*) FILTER (WHERE owner = ?1) FROM jobs WHERE state = 0",
                                diag);
    int64_t all = 0, own = 0;
    query_text(&q, 1, owner);
    if (query_row(&q)) {
        all = query_int64(&q, 0);
        own = query_int64(&q, 1);
    }
    groom_status status = query_end(&q);
    if (status != GROOM_OK)
        return status;
    if (job->max_queued_of_owner && own >= job->max_queued_of_owner)
        return groom_fail(diag, GROOM_ELIMIT, "%lld jobs of this token wait, which is its limit", (long long)own);
    if (job->max_queued && all >= job->max_queued)
        return groom_fail(diag, GROOM_ELIMIT, "the queue is full: %lld jobs wait", (long long)all);
    return GROOM_OK;
}

static groom_status insert_job(struct connection *c, const struct store_job_new *job, const char *project,
                               const char *owner, int64_t now, struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT INTO jobs (id, kind, state, priority, request, options, created, project,"
                                   " owner) VALUES (?1, ?2, 0, ?3, ?4, ?5, ?6, ?7, ?8)", diag);
    query_text(&q, 1, job->id);
    query_text(&q, 2, job->kind);
    query_integer(&q, 3, job->priority);
    query_text(&q, 4, job->request);
    query_text(&q, 5, job->options);
    query_integer(&q, 6, now);
    query_text(&q, 7, project);
    query_text(&q, 8, owner);
    groom_status status = query_run(&q, NULL);
    for (size_t i = 0; status == GROOM_OK && i < job->n_webhooks; i++)
        status = webhook_insert(c, job->id, &job->webhooks[i], now, diag);
    return status;
}

groom_status store_job_create(struct store *store, const struct store_job_new *job, struct groom_diag *diag)
{
    const char *project = project_or_default(job->project), *owner = job->owner ? job->owner : project;
    int64_t now = store_now_ms();
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    /* the key first: a repeated request is not refused because the queue has filled meanwhile */
    if ((status = key_insert(c, project, job->id, 0, now, diag)) == GROOM_OK &&
        (status = check_queue(c, job, owner, diag)) == GROOM_OK &&
        (status = insert_job(c, job, project, owner, now, diag)) == GROOM_OK &&
        (status = event_append(c, job->id, "state", "{\"state\":\"queued\"}", now, diag)) == GROOM_OK)
        status = audit_append(c, project, "job.create", job->id, job->kind, now, diag);
    return transaction_end(c, status, diag);
}

/* --- reading --------------------------------------------------------------------------- */

/* With the place in the queue as `position`: of one job, or of a list's from one look at the queue. */
#define COLUMNS(position)                                                                          \
    "SELECT jobs.seq, id, kind, state, priority, " position ", request, options, stage, stage_index," \
    " stage_count, progress, eta_s, loss, attempt, n_failures, cancel_requested, result, error, created," \
    " started, finished, project, owner FROM jobs "
#define SELECT_JOB                                                                                 \
    COLUMNS("CASE state WHEN 0 THEN (SELECT position FROM " QUEUE_IN_ORDER("") " AS line WHERE line.seq = jobs.seq)" \
            " ELSE -1 END")
#define SELECT_JOBS                                                                                \
    COLUMNS("coalesce(line.position, -1)")                                                         \
    "LEFT JOIN " QUEUE_IN_ORDER("") " AS line ON line.seq = jobs.seq WHERE jobs.seq < ?1 AND project = ?4 "

/* returns the row's place in lists */
static int64_t read_job(struct query *q, struct store_job *job)
{
    query_copy(q, 1, job->id, sizeof job->id);
    job->kind = query_string(q, 2);
    job->state = (enum store_job_state)query_int64(q, 3);
    job->priority = (int32_t)query_int64(q, 4);
    job->queue_position = query_int64(q, 5);
    job->request = query_string(q, 6);
    job->options = query_string(q, 7);
    job->stage = query_string(q, 8);
    job->stage_index = (uint32_t)query_int64(q, 9);
    job->stage_count = (uint32_t)query_int64(q, 10);
    job->progress = query_double(q, 11);
    job->eta_s = query_double(q, 12);
    job->loss = query_string(q, 13);
    job->attempt = (uint32_t)query_int64(q, 14);
    job->n_failures = (uint32_t)query_int64(q, 15);
    job->cancel_requested = query_int64(q, 16) != 0;
    job->result = query_string(q, 17);
    job->error = query_string(q, 18);
    job->created_ms = query_int64(q, 19);
    job->started_ms = query_int64(q, 20);
    job->finished_ms = query_int64(q, 21);
    query_copy(q, 22, job->project, sizeof job->project);
    query_copy(q, 23, job->owner, sizeof job->owner);
    return query_int64(q, 0);
}

groom_status store_job_get(struct store *store, const char *id, struct store_job *job, struct groom_diag *diag)
{
    struct store_job row = {0};
    bool found;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, SELECT_JOB "WHERE id = ?1", diag);
    query_text(&q, 1, id);
    if ((found = query_row(&q)))
        read_job(&q, &row);
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no job %.40s", id);
    if (status == GROOM_OK)
        *job = row;
    else
        store_job_finish(&row);
    return status;
}

groom_status store_jobs_list(struct store *store, const char *project, const enum store_job_state *state,
                             struct store_page page, struct store_job_list *list, struct groom_diag *diag)
{
    struct store_job_list found = {0};
    int64_t last = 0;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, state ? SELECT_JOBS "AND state = ?3 ORDER BY jobs.seq DESC LIMIT ?2"
                                         : SELECT_JOBS "ORDER BY jobs.seq DESC LIMIT ?2", diag);
    query_integer(&q, 1, page_before(page));
    query_integer(&q, 2, page_limit(page));
    if (state)
        query_integer(&q, 3, *state);
    query_text(&q, 4, project_or_default(project));
    while (query_row(&q)) {
        if ((int64_t)found.n == page_limit(page) - 1) {
            found.next = last;
            break;
        }
        struct store_job *job = query_append(&q, &found.items, &found.n, sizeof *job);
        if (job)
            last = read_job(&q, job);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_job_list_finish(&found);
    return status;
}

void store_job_finish(struct store_job *job)
{
    if (!job)
        return;
    free(job->kind);
    free(job->request);
    free(job->options);
    free(job->stage);
    free(job->loss);
    free(job->result);
    free(job->error);
    *job = (struct store_job){0};
}

void store_job_list_finish(struct store_job_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++)
        store_job_finish(&list->items[i]);
    free(list->items);
    *list = (struct store_job_list){0};
}

/* Its cancellation is asked for, and that is in the audit, once. */
static groom_status ask_to_cancel(struct connection *c, const char *id, const char *project, struct groom_diag *diag)
{
    int64_t n_changed;
    struct query q = query_open(c, "UPDATE jobs SET cancel_requested = 1"
                                   " WHERE id = ?1 AND state = 1 AND NOT cancel_requested", diag);
    query_text(&q, 1, id);
    groom_status status = query_run(&q, &n_changed);
    if (status == GROOM_OK && n_changed)
        status = audit_append(c, project, "job.cancel", id, NULL, store_now_ms(), diag);
    return status;
}

groom_status store_job_request_cancel(struct store *store, const char *id, enum store_job_state *state,
                                      struct groom_diag *diag)
{
    char project[STORE_PROJECT_SIZE];
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "SELECT state, project FROM jobs WHERE id = ?1", diag);
    query_text(&q, 1, id);
    bool found = query_row(&q);
    if (found) {
        *state = (enum store_job_state)query_int64(&q, 0);
        query_copy(&q, 1, project, sizeof project);
    }
    status = query_end(&q);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no job %.40s", id);
    if (status == GROOM_OK)
        status = ask_to_cancel(c, id, project, diag);
    return transaction_end(c, status, diag);
}
