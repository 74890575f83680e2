/* What only helped along the way and goes after a time. */
#include "server/store/database.h"

/* The text of a job's progress; states and stages stay as its history. */
static groom_status retire_events(struct connection *c, int64_t before, uint32_t max_jobs, uint64_t *n,
                                  struct groom_diag *diag)
{
    int64_t n_changed = 0;
    struct query q = query_open(c,
                                "DELETE FROM events WHERE type IN ('progress', 'loss') AND job_id IN"
                                " (SELECT id FROM jobs WHERE state >= 2 AND events_retired = 0 AND finished < ?1"
                                "  ORDER BY finished LIMIT ?2)", diag);
    query_integer(&q, 1, before);
    query_integer(&q, 2, max_jobs);
    groom_status status = query_run(&q, NULL);
    if (status != GROOM_OK)
        return status;
    struct query mark = query_open(c,
                                   "UPDATE jobs SET events_retired = 1 WHERE seq IN"
                                   " (SELECT seq FROM jobs WHERE state >= 2 AND events_retired = 0 AND finished < ?1"
                                   "  ORDER BY finished LIMIT ?2)", diag);
    query_integer(&mark, 1, before);
    query_integer(&mark, 2, max_jobs);
    status = query_run(&mark, &n_changed);
    *n += (uint64_t)n_changed;
    return status;
}

static groom_status retire_keys(struct connection *c, int64_t before, uint32_t max_rows, uint64_t *n,
                                struct groom_diag *diag)
{
    int64_t n_changed = 0;
    struct query q = query_open(c,
                                "DELETE FROM keys WHERE (project, key) IN"
                                " (SELECT project, key FROM keys WHERE expires < ?1 LIMIT ?2)", diag);
    query_integer(&q, 1, before);
    query_integer(&q, 2, max_rows);
    groom_status status = query_run(&q, &n_changed);
    *n += (uint64_t)n_changed;
    return status;
}

static groom_status retire_preparations(struct connection *c, int64_t before, uint32_t max_rows, uint64_t *n,
                                        struct groom_diag *diag)
{
    int64_t n_changed = 0;
    struct query q = query_open(c,
                                "DELETE FROM preparations WHERE key IN"
                                " (SELECT key FROM preparations WHERE used < ?1 LIMIT ?2)", diag);
    query_integer(&q, 1, before);
    query_integer(&q, 2, max_rows);
    groom_status status = query_run(&q, &n_changed);
    *n += (uint64_t)n_changed;
    return status;
}

#define THOSE                                                                                                      \
    "(SELECT id FROM jobs WHERE state >= 2 AND finished < ?1 ORDER BY finished LIMIT ?2)"

static groom_status retire_jobs(struct connection *c, int64_t before, uint32_t max_jobs, uint64_t *n,
                                struct groom_diag *diag)
{
    static const char *const tables[] = {"DELETE FROM events WHERE job_id IN " THOSE,
                                         "DELETE FROM losses WHERE job_id IN " THOSE,
                                         "DELETE FROM checkpoints WHERE job_id IN " THOSE,
                                         "DELETE FROM webhooks WHERE job_id IN " THOSE,
                                         "DELETE FROM keys WHERE subject IN " THOSE,
                                         "DELETE FROM attempts WHERE job_id IN " THOSE,
                                         "DELETE FROM jobs WHERE id IN " THOSE};
    groom_status status = GROOM_OK;
    int64_t n_changed = 0;
    for (size_t i = 0; status == GROOM_OK && i < sizeof tables / sizeof tables[0]; i++) {
        struct query q = query_open(c, tables[i], diag);
        query_integer(&q, 1, before);
        query_integer(&q, 2, max_jobs);
        status = query_run(&q, &n_changed);
    }
    *n += (uint64_t)n_changed;
    return status;
}

groom_status store_retire(struct store *store, const struct store_retention *retention, uint32_t max_rows,
                          struct store_retired *retired, struct groom_diag *diag)
{
    struct store_retired done = {0};
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    if (retention->jobs_before_ms > 0)
        status = retire_jobs(c, retention->jobs_before_ms, max_rows, &done.n_jobs, diag);
    if (status == GROOM_OK && retention->events_before_ms > 0)
        status = retire_events(c, retention->events_before_ms, max_rows, &done.n_event_streams, diag);
    if (status == GROOM_OK && retention->keys_before_ms > 0)
        status = retire_keys(c, retention->keys_before_ms, max_rows, &done.n_keys, diag);
    if (status == GROOM_OK && retention->preparations_before_ms > 0)
        status = retire_preparations(c, retention->preparations_before_ms, max_rows, &done.n_preparations, diag);
    if ((status = transaction_end(c, status, diag)) == GROOM_OK)
        *retired = done;
    return status;
}
