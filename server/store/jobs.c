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

static groom_status find_key(struct connection *c, const struct store_job_new *job, char id[STORE_ID_SIZE],
                             bool *known, struct groom_diag *diag)
{
    char hash[STORE_HASH_SIZE] = "";
    struct query q = query_open(c, "SELECT job_id, request_hash FROM idempotency_keys WHERE key = ?1", diag);
    query_text(&q, 1, job->idempotency_key);
    if ((*known = query_row(&q))) {
        query_copy(&q, 0, id, STORE_ID_SIZE);
        query_copy(&q, 1, hash, sizeof hash);
    }
    groom_status status = query_end(&q);
    if (status == GROOM_OK && *known && strcmp(hash, job->request_hash) != 0)
        status = groom_fail(diag, GROOM_ECONFLICT,
                            "this Idempotency-Key was used for another request: send a new key");
    return status;
}

static groom_status insert_key(struct connection *c, const struct store_job_new *job, int64_t now,
                               struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT INTO idempotency_keys (key, request_hash, job_id, created)"
                                       " VALUES (?1, ?2, ?3, ?4)", diag);
    query_text(&q, 1, job->idempotency_key);
    query_text(&q, 2, job->request_hash);
    query_text(&q, 3, job->id);
    query_integer(&q, 4, now);
    return query_run(&q, NULL);
}

static groom_status insert_job(struct connection *c, const struct store_job_new *job, int64_t now,
                               struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT INTO jobs (id, kind, state, priority, request, options, created)"
                                       " VALUES (?1, ?2, 0, ?3, ?4, ?5, ?6)", diag);
    query_text(&q, 1, job->id);
    query_text(&q, 2, job->kind);
    query_integer(&q, 3, job->priority);
    query_text(&q, 4, job->request);
    query_text(&q, 5, job->options);
    query_integer(&q, 6, now);
    groom_status status = query_run(&q, NULL);
    if (status == GROOM_OK && job->idempotency_key)
        status = insert_key(c, job, now, diag);
    for (size_t i = 0; status == GROOM_OK && i < job->n_webhooks; i++)
        status = webhook_insert(c, job->id, &job->webhooks[i], now, diag);
    return status == GROOM_OK ? event_append(c, job->id, "state", "{\"state\":\"queued\"}", now, diag) : status;
}

groom_status store_job_create(struct store *store, const struct store_job_new *job, char id[STORE_ID_SIZE],
                              bool *created, struct groom_diag *diag)
{
    char known_id[STORE_ID_SIZE];
    bool known = false;
    strncpy(known_id, job->id, sizeof known_id - 1);
    known_id[sizeof known_id - 1] = 0;
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    if (job->idempotency_key)
        status = find_key(c, job, known_id, &known, diag);
    if (status == GROOM_OK && !known)
        status = insert_job(c, job, store_now_ms(), diag);
    if ((status = transaction_end(c, status, diag)) == GROOM_OK) {
        memcpy(id, known_id, STORE_ID_SIZE);
        *created = !known;
    }
    return status;
}

/* --- reading --------------------------------------------------------------------------- */

#define SELECT_JOB                                                                                 \
    "SELECT seq, id, kind, state, priority, CASE state WHEN 0 THEN"                                \
    " (SELECT count(*) FROM jobs AS ahead WHERE ahead.state = 0 AND (ahead.priority > jobs.priority" \
    "  OR (ahead.priority = jobs.priority AND ahead.seq < jobs.seq))) ELSE -1 END,"                \
    " request, options, stage, stage_index, stage_count, progress, eta_s, loss, attempt, n_failures," \
    " cancel_requested, result, error, created, started, finished FROM jobs "

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

groom_status store_jobs_list(struct store *store, const enum store_job_state *state, struct store_page page,
                             struct store_job_list *list, struct groom_diag *diag)
{
    struct store_job_list found = {0};
    int64_t last = 0;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, state ? SELECT_JOB "WHERE seq < ?1 AND state = ?3 ORDER BY seq DESC LIMIT ?2"
                                             : SELECT_JOB "WHERE seq < ?1 ORDER BY seq DESC LIMIT ?2", diag);
    query_integer(&q, 1, page_before(page));
    query_integer(&q, 2, page_limit(page));
    if (state)
        query_integer(&q, 3, *state);
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

groom_status store_job_request_cancel(struct store *store, const char *id, enum store_job_state *state,
                                      struct groom_diag *diag)
{
    bool found;
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "UPDATE jobs SET cancel_requested = cancel_requested OR state = 1"
                                       " WHERE id = ?1 RETURNING state", diag);
    query_text(&q, 1, id);
    if ((found = query_row(&q)))
        *state = (enum store_job_state)query_int64(&q, 0);
    status = query_end(&q);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no job %.40s", id);
    return transaction_end(c, status, diag);
}
