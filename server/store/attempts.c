/* Attempts: who works on a job, what it reports, and the fence around it. */
#include <stdlib.h>
#include <string.h>

#include "server/store/database.h"

const char *store_attempt_state_name(enum store_attempt_state state)
{
    static const char *const names[STORE_ATTEMPT_STATES] = {
        [STORE_ATTEMPT_RUNNING] = "running", [STORE_ATTEMPT_SUCCEEDED] = "succeeded",
        [STORE_ATTEMPT_FAILED] = "failed",   [STORE_ATTEMPT_DIED] = "died",
        [STORE_ATTEMPT_STOPPED] = "stopped", [STORE_ATTEMPT_CANCELLED] = "cancelled",
    };
    return (unsigned)state < STORE_ATTEMPT_STATES ? names[state] : "unknown";
}

/* --- the fence ------------------------------------------------------------------------- */

groom_status attempt_may_speak(struct connection *c, const struct store_attempt_ref *ref, bool *cancel,
                               struct groom_diag *diag)
{
    struct query q = query_open(c,
                                "SELECT jobs.cancel_requested FROM attempts JOIN jobs ON jobs.id = attempts.job_id"
                                " WHERE job_id = ?1 AND number = ?2 AND run <= ?3 AND attempts.state = 0"
                                " AND jobs.state = 1 AND jobs.attempt = number", diag);
    query_text(&q, 1, ref->job_id);
    query_integer(&q, 2, ref->number);
    query_integer(&q, 3, ref->run);
    bool passed = query_row(&q);
    if (passed && cancel)
        *cancel = query_int64(&q, 0) != 0;
    groom_status status = query_end(&q);
    if (status == GROOM_OK && !passed)
        status = groom_fail(diag, GROOM_ECONFLICT, "attempt %u of %.40s has ended: stop working on it",
                            ref->number, ref->job_id);
    return status;
}

groom_status store_attempt_find(struct store *store, const char *token_hash, uint32_t run,
                                struct store_attempt_ref *ref, struct groom_diag *diag)
{
    struct store_attempt_ref found = {.run = run};
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT job_id, number FROM attempts WHERE token_hash = ?1", diag);
    query_text(&q, 1, token_hash);
    if (query_row(&q)) {
        query_copy(&q, 0, found.job_id, sizeof found.job_id);
        found.number = (uint32_t)query_int64(&q, 1);
    }
    groom_status status = query_end(&q);
    if (status == GROOM_OK && found.number == 0)
        status = groom_fail(diag, GROOM_ENOTFOUND, "this token belongs to no attempt");
    if (status == GROOM_OK)
        status = attempt_may_speak(c, &found, NULL, diag);
    read_end(c);
    if (status == GROOM_OK)
        *ref = found;
    return status;
}

groom_status store_attempt_launched(struct store *store, const struct store_attempt_ref *ref, const char *handle,
                                    struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "UPDATE attempts SET handle = ?3 WHERE job_id = ?1 AND number = ?2", diag);
    query_text(&q, 1, ref->job_id);
    query_integer(&q, 2, ref->number);
    query_text(&q, 3, handle);
    return transaction_end(c, query_run(&q, NULL), diag);
}

/* An update of an attempt that may speak: `sql` takes job, number and `value`. */
static groom_status update_fenced(struct store *store, const struct store_attempt_ref *ref, const char *sql,
                                  const char *text, int64_t integer, struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    if ((status = attempt_may_speak(c, ref, NULL, diag)) == GROOM_OK) {
        struct query q = query_open(c, sql, diag);
        query_text(&q, 1, ref->job_id);
        query_integer(&q, 2, ref->number);
        query_integer(&q, 3, integer);
        if (text)
            query_text(&q, 4, text);
        status = query_run(&q, NULL);
    }
    return transaction_end(c, status, diag);
}

groom_status store_attempt_begin_run(struct store *store, const struct store_attempt_ref *ref,
                                     struct groom_diag *diag)
{
    return update_fenced(store, ref, "UPDATE attempts SET run = ?3 WHERE job_id = ?1 AND number = ?2", NULL,
                         ref->run, diag);
}

groom_status store_attempt_ended(struct store *store, const struct store_attempt_ref *ref,
                                 const char *last_words, struct groom_diag *diag)
{
    return update_fenced(store, ref,
                         "UPDATE attempts SET finished = ?3, last_words = ?4 WHERE job_id = ?1 AND number = ?2",
                         last_words, store_now_ms(), diag);
}

/* --- what it reports --------------------------------------------------------------------- */

static groom_status update_progress(struct connection *c, const struct store_attempt_ref *ref,
                                    const struct store_progress *progress, struct groom_diag *diag)
{
    struct query q = query_open(c,
                                "UPDATE jobs SET stage = coalesce(?2, stage),"
                                " stage_index = CASE WHEN ?2 IS NULL THEN stage_index ELSE ?3 END,"
                                " stage_count = CASE WHEN ?2 IS NULL THEN stage_count ELSE ?4 END,"
                                " progress = CASE WHEN ?5 < 0 THEN progress ELSE ?5 END, eta_s = ?6,"
                                " loss = coalesce(?7, loss) WHERE id = ?1", diag);
    query_text(&q, 1, ref->job_id);
    query_text(&q, 2, progress->stage);
    query_integer(&q, 3, progress->stage_index);
    query_integer(&q, 4, progress->stage_count);
    query_real(&q, 5, progress->progress);
    query_real(&q, 6, progress->eta_s);
    query_text(&q, 7, progress->loss);
    return query_run(&q, NULL);
}

static groom_status insert_loss(struct connection *c, const char *job_id, const struct store_loss *loss,
                                struct groom_diag *diag)
{
    struct query q = query_open(c,
                                "INSERT INTO losses (job_id, stage, name, iteration, value)"
                                " VALUES (?1, ?2, ?3, ?4, ?5) ON CONFLICT (job_id, stage, name, iteration)"
                                " DO UPDATE SET value = excluded.value", diag);
    query_text(&q, 1, job_id);
    query_text(&q, 2, loss->stage);
    query_text(&q, 3, loss->name);
    query_integer(&q, 4, loss->iteration);
    query_real(&q, 5, loss->value);
    return query_run(&q, NULL);
}

static groom_status write_progress(struct connection *c, const struct store_attempt_ref *ref,
                                   const struct store_progress *progress, bool *cancel, struct groom_diag *diag)
{
    int64_t now = store_now_ms();
    groom_status status = attempt_may_speak(c, ref, cancel, diag);
    if (status == GROOM_OK)
        status = update_progress(c, ref, progress, diag);
    for (size_t i = 0; status == GROOM_OK && i < progress->n_losses; i++)
        status = insert_loss(c, ref->job_id, &progress->losses[i], diag);
    for (size_t i = 0; status == GROOM_OK && i < progress->n_events; i++)
        status = event_append(c, ref->job_id, progress->events[i].type, progress->events[i].data, now, diag);
    return status;
}

groom_status store_attempt_progress(struct store *store, const struct store_attempt_ref *ref,
                                    const struct store_progress *progress, bool *cancel, struct groom_diag *diag)
{
    bool asked = false;
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    status = transaction_end(c, write_progress(c, ref, progress, &asked, diag), diag);
    if (status == GROOM_OK)
        *cancel = asked;
    return status;
}

/* --- checkpoints ---------------------------------------------------------------------------- */

static groom_status read_checkpoint(struct connection *c, const char *job_id, struct store_checkpoint *checkpoint,
                                    bool *found, struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT sha256, n_bytes, stage FROM checkpoints WHERE job_id = ?1", diag);
    query_text(&q, 1, job_id);
    if ((*found = query_row(&q))) {
        query_copy(&q, 0, checkpoint->sha256, sizeof checkpoint->sha256);
        checkpoint->n_bytes = (uint64_t)query_int64(&q, 1);
        checkpoint->stage = (uint32_t)query_int64(&q, 2);
    }
    return query_end(&q);
}

static groom_status forget_failures(struct connection *c, const char *job_id, struct groom_diag *diag)
{
    struct query q = query_open(c, "UPDATE jobs SET n_failures = 0 WHERE id = ?1", diag);
    query_text(&q, 1, job_id);
    return query_run(&q, NULL);
}

static groom_status write_checkpoint(struct connection *c, const struct store_attempt_ref *ref,
                                     const struct store_checkpoint *checkpoint, struct store_checkpoint *before,
                                     struct groom_diag *diag)
{
    bool found;
    groom_status status = attempt_may_speak(c, ref, NULL, diag);
    if (status == GROOM_OK)
        status = read_checkpoint(c, ref->job_id, before, &found, diag);
    if (status == GROOM_OK && strcmp(before->sha256, checkpoint->sha256) != 0)
        status = forget_failures(c, ref->job_id, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c,
                                "INSERT INTO checkpoints (job_id, sha256, n_bytes, stage, created)"
                                " VALUES (?1, ?2, ?3, ?4, ?5) ON CONFLICT (job_id) DO UPDATE SET"
                                " sha256 = ?2, n_bytes = ?3, stage = ?4, created = ?5", diag);
    query_text(&q, 1, ref->job_id);
    query_text(&q, 2, checkpoint->sha256);
    query_integer(&q, 3, (int64_t)checkpoint->n_bytes);
    query_integer(&q, 4, checkpoint->stage);
    query_integer(&q, 5, store_now_ms());
    return query_run(&q, NULL);
}

groom_status store_attempt_checkpoint(struct store *store, const struct store_attempt_ref *ref,
                                      const struct store_checkpoint *checkpoint, char replaced[STORE_HASH_SIZE],
                                      struct groom_diag *diag)
{
    struct store_checkpoint before = {0};
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    status = transaction_end(c, write_checkpoint(c, ref, checkpoint, &before, diag), diag);
    if (status == GROOM_OK) {
        bool same = strcmp(before.sha256, checkpoint->sha256) == 0;
        memcpy(replaced, same ? "" : before.sha256, same ? 1 : STORE_HASH_SIZE);
    }
    return status;
}

groom_status store_checkpoint_get(struct store *store, const char *job_id, struct store_checkpoint *checkpoint,
                                  struct groom_diag *diag)
{
    struct store_checkpoint row = {0};
    bool found = false;
    struct connection *c = read_begin(store);
    groom_status status = read_checkpoint(c, job_id, &row, &found, diag);
    read_end(c);
    if (status == GROOM_OK && !found)
        return groom_fail(diag, GROOM_ENOTFOUND, "the job %.40s has no checkpoint", job_id);
    if (status == GROOM_OK)
        *checkpoint = row;
    return status;
}

/* --- lists ------------------------------------------------------------------------------------- */

groom_status store_attempts_list(struct store *store, const char *job_id, struct store_attempt_list *list,
                                 struct groom_diag *diag)
{
    struct store_attempt_list found = {0};
    struct connection *c = read_begin(store);
    struct query q =
        query_open(c, job_id ? "SELECT job_id, number, state, handle, last_words, started, finished"
                                   " FROM attempts WHERE job_id = ?1 ORDER BY number"
                                 : "SELECT job_id, number, state, handle, last_words, started, finished"
                                   " FROM attempts WHERE state = 0 ORDER BY started, job_id", diag);
    if (job_id)
        query_text(&q, 1, job_id);
    while (query_row(&q)) {
        struct store_attempt *attempt = query_append(&q, &found.items, &found.n, sizeof *attempt);
        if (!attempt)
            break;
        query_copy(&q, 0, attempt->ref.job_id, sizeof attempt->ref.job_id);
        attempt->ref.number = (uint32_t)query_int64(&q, 1);
        attempt->state = (enum store_attempt_state)query_int64(&q, 2);
        attempt->handle = query_string(&q, 3);
        attempt->last_words = query_string(&q, 4);
        attempt->started_ms = query_int64(&q, 5);
        attempt->finished_ms = query_int64(&q, 6);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_attempt_list_finish(&found);
    return status;
}

void store_attempt_list_finish(struct store_attempt_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++) {
        free(list->items[i].handle);
        free(list->items[i].last_words);
    }
    free(list->items);
    *list = (struct store_attempt_list){0};
}
