/* The only place where a job goes from state to state. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/store/database.h"

/* The arrows of the picture in store.h. */
static bool allowed(enum store_job_state from, enum store_job_state to)
{
    switch (from) {
    case STORE_JOB_QUEUED: return to == STORE_JOB_CANCELLED || to == STORE_JOB_FAILED;
    case STORE_JOB_RUNNING: return to != STORE_JOB_RUNNING;
    default: return false; /* an end state is left by no one */
    }
}

/* --- taking --------------------------------------------------------------------------- */

/* The others' turn comes first now. */
static groom_status note_turn(struct connection *c, const char *owner, struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT INTO turns (owner, taken)"
                                   " SELECT ?1, coalesce(max(taken), 0) + 1 FROM turns WHERE true"
                                   " ON CONFLICT (owner) DO UPDATE SET taken = excluded.taken", diag);
    query_text(&q, 1, owner);
    return query_run(&q, NULL);
}

static groom_status take_first(struct connection *c, int64_t now, struct store_attempt_ref *ref,
                               struct groom_diag *diag)
{
    struct query q = query_open(c,
                                "UPDATE jobs SET state = 1, attempt = attempt + 1,"
                                " started = CASE started WHEN 0 THEN ?1 ELSE started END"
                                " WHERE seq = (SELECT seq FROM " QUEUE_IN_ORDER("AND not_before <= ?1")
                                "  WHERE position = 0) RETURNING id, attempt, owner", diag);
    char owner[STORE_OWNER_SIZE];
    query_integer(&q, 1, now);
    bool found = query_row(&q);
    if (found) {
        query_copy(&q, 0, ref->job_id, sizeof ref->job_id);
        ref->number = (uint32_t)query_int64(&q, 1);
        query_copy(&q, 2, owner, sizeof owner);
    }
    groom_status status = query_end(&q);
    return status == GROOM_OK && found ? note_turn(c, owner, diag) : status;
}

static groom_status insert_attempt(struct connection *c, const struct store_attempt_ref *ref,
                                   const char *token_hash, int64_t now, struct groom_diag *diag)
{
    char data[96];
    struct query q = query_open(c, "INSERT INTO attempts (job_id, number, token_hash, state, started)"
                                       " VALUES (?1, ?2, ?3, 0, ?4)", diag);
    query_text(&q, 1, ref->job_id);
    query_integer(&q, 2, ref->number);
    query_text(&q, 3, token_hash);
    query_integer(&q, 4, now);
    groom_status status = query_run(&q, NULL);
    if (status != GROOM_OK)
        return status;
    snprintf(data, sizeof data, "{\"state\":\"running\",\"attempt\":%u}", ref->number);
    return event_append(c, ref->job_id, "state", data, now, diag);
}

static groom_status read_next_time(struct connection *c, int64_t *next_ms, struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT coalesce(min(not_before), 0) FROM jobs WHERE state = 0", diag);
    if (query_row(&q))
        *next_ms = query_int64(&q, 0);
    return query_end(&q);
}

groom_status store_job_take(struct store *store, const char *token_hash, struct store_attempt_ref *ref,
                            bool *taken, int64_t *next_ms, struct groom_diag *diag)
{
    struct store_attempt_ref found = {0};
    int64_t next = 0, now = store_now_ms();
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    status = take_first(c, now, &found, diag);
    if (status == GROOM_OK)
        status = found.number ? insert_attempt(c, &found, token_hash, now, diag)
                              : read_next_time(c, &next, diag);
    if ((status = transaction_end(c, status, diag)) != GROOM_OK)
        return status;
    *taken = found.number > 0;
    *ref = found;
    *next_ms = next;
    return GROOM_OK;
}

/* --- moving ----------------------------------------------------------------------------- */

struct present {
    enum store_job_state state;
    uint32_t attempt;
    bool cancel_requested;
    char project[STORE_PROJECT_SIZE];
};

static groom_status read_present(struct connection *c, const char *job_id, struct present *present,
                                 struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT state, attempt, cancel_requested, project FROM jobs WHERE id = ?1", diag);
    query_text(&q, 1, job_id);
    bool found = query_row(&q);
    if (found) {
        present->state = (enum store_job_state)query_int64(&q, 0);
        present->attempt = (uint32_t)query_int64(&q, 1);
        present->cancel_requested = query_int64(&q, 2) != 0;
        query_copy(&q, 3, present->project, sizeof present->project);
    }
    groom_status status = query_end(&q);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no job %.40s", job_id);
    return status;
}

static groom_status check_move(const struct store_job_move *move, const struct present *present,
                               struct groom_diag *diag)
{
    if (!allowed(move->from, move->to))
        return groom_fail(diag, GROOM_ECONFLICT, "a job does not go from %s to %s",
                          store_job_state_name(move->from), store_job_state_name(move->to));
    if (present->state != move->from)
        return groom_fail(diag, GROOM_ECONFLICT, "the job is %s, not %s", store_job_state_name(present->state),
                          store_job_state_name(move->from));
    if (move->attempt != 0 && present->attempt != move->attempt)
        return groom_fail(diag, GROOM_ECONFLICT, "attempt %u has ended; the job is at attempt %u", move->attempt,
                          present->attempt);
    if (present->cancel_requested && (move->to == STORE_JOB_SUCCEEDED || move->to == STORE_JOB_QUEUED))
        return groom_fail(diag, GROOM_ECANCELLED, "the job's cancellation was asked for");
    return GROOM_OK;
}

static groom_status end_attempt(struct connection *c, const struct store_job_move *move, int64_t now,
                                struct groom_diag *diag)
{
    int64_t n_changed = 0;
    struct query q = query_open(c, "UPDATE attempts SET state = ?3, last_words = ?4, finished = ?5"
                                       " WHERE job_id = ?1 AND number = ?2 AND state = 0", diag);
    query_text(&q, 1, move->job_id);
    query_integer(&q, 2, move->attempt);
    query_integer(&q, 3, move->attempt_state);
    query_text(&q, 4, move->last_words ? move->last_words : "");
    query_integer(&q, 5, now);
    groom_status status = query_run(&q, &n_changed);
    if (status == GROOM_OK && n_changed == 0)
        status = groom_fail(diag, GROOM_ECONFLICT, "attempt %u has ended before", move->attempt);
    return status;
}

static groom_status update_job(struct connection *c, const struct store_job_move *move, int64_t now,
                               struct groom_diag *diag)
{
    bool end = store_job_state_is_end(move->to);
    struct query q = query_open(c,
                                "UPDATE jobs SET state = ?2, not_before = ?3, n_failures = n_failures + ?4,"
                                " result = ?5, error = ?6, finished = ?7, eta_s = -1,"
                                " progress = CASE ?2 WHEN 2 THEN 1.0 ELSE progress END WHERE id = ?1", diag);
    query_text(&q, 1, move->job_id);
    query_integer(&q, 2, move->to);
    query_integer(&q, 3, move->not_before_ms);
    query_integer(&q, 4, move->attempt != 0 && move->attempt_state == STORE_ATTEMPT_DIED);
    query_text(&q, 5, end ? move->result : NULL);
    query_text(&q, 6, end ? move->error : NULL);
    query_integer(&q, 7, end ? now : 0);
    return query_run(&q, NULL);
}

/* {"state":…,"attempt":N,"result":{…},"error":{…}} */
static groom_status append_state_event(struct connection *c, const struct store_job_move *move, uint32_t attempt,
                                       int64_t now, struct groom_diag *diag)
{
    size_t size = 128 + (move->result ? strlen(move->result) : 0) + (move->error ? strlen(move->error) : 0);
    char *data = malloc(size);
    if (!data)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for an event");
    int n = snprintf(data, size, "{\"state\":\"%s\",\"attempt\":%u", store_job_state_name(move->to), attempt);
    if (move->result)
        n += snprintf(data + n, size - (size_t)n, ",\"result\":%s", move->result);
    if (move->error)
        n += snprintf(data + n, size - (size_t)n, ",\"error\":%s", move->error);
    snprintf(data + n, size - (size_t)n, "}");
    groom_status status = event_append(c, move->job_id, "state", data, now, diag);
    free(data);
    return status;
}

static groom_status drop_checkpoint(struct connection *c, const char *job_id, char garbage[STORE_HASH_SIZE],
                                    struct groom_diag *diag)
{
    struct query q = query_open(c, "DELETE FROM checkpoints WHERE job_id = ?1 RETURNING sha256", diag);
    query_text(&q, 1, job_id);
    if (query_row(&q))
        query_copy(&q, 0, garbage, STORE_HASH_SIZE);
    return query_run(&q, NULL);
}

static groom_status write_made(struct connection *c, const struct store_job_move *move, const struct present *present,
                               int64_t now, struct groom_diag *diag)
{
    groom_status status = GROOM_OK;
    bool created;
    for (size_t i = 0; status == GROOM_OK && i < move->n_assets; i++)
        status = asset_insert(c, &move->assets[i], 0, now, &created, diag);
    if (status == GROOM_OK && move->groom_expected)
        return groom_add_revision(c, move->grooms, move->groom_expected, diag);
    for (size_t i = 0; status == GROOM_OK && i < move->n_grooms; i++)
        status = groom_insert(c, &move->grooms[i], present->project, now, diag);
    return status;
}

static groom_status write_move(struct connection *c, const struct store_job_move *move,
                               char garbage[STORE_HASH_SIZE], struct groom_diag *diag)
{
    struct present present = {0};
    int64_t now = store_now_ms();
    groom_status status = read_present(c, move->job_id, &present, diag);
    if (status == GROOM_OK)
        status = check_move(move, &present, diag);
    if (status == GROOM_OK && move->attempt != 0)
        status = end_attempt(c, move, now, diag);
    if (status == GROOM_OK)
        status = write_made(c, move, &present, now, diag);
    if (status == GROOM_OK)
        status = update_job(c, move, now, diag);
    if (status == GROOM_OK)
        status = append_state_event(c, move, present.attempt, now, diag);
    if (status == GROOM_OK && store_job_state_is_end(move->to))
        status = webhooks_release(c, move->job_id, now, diag);
    if (status == GROOM_OK && store_job_state_is_end(move->to))
        status = audit_append(c, present.project, "job.end", move->job_id, store_job_state_name(move->to), now, diag);
    if (status == GROOM_OK && store_job_state_is_end(move->to))
        status = drop_checkpoint(c, move->job_id, garbage, diag);
    return status;
}

groom_status store_job_move(struct store *store, const struct store_job_move *move, char garbage[STORE_HASH_SIZE],
                            struct groom_diag *diag)
{
    char dropped[STORE_HASH_SIZE] = "";
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    status = transaction_end(c, write_move(c, move, dropped, diag), diag);
    if (status == GROOM_OK)
        memcpy(garbage, dropped, STORE_HASH_SIZE);
    return status;
}
