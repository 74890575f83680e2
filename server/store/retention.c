/* What only helped along the way and goes after a time. */
#include "server/store/database.h"

#define ENDED_JOBS "(SELECT id FROM jobs WHERE state >= 2 AND finished < ?1 ORDER BY finished LIMIT ?2)"
#define TALKATIVE_JOBS \
    "(SELECT id FROM jobs WHERE state >= 2 AND events_retired = 0 AND finished < ?1 ORDER BY finished LIMIT ?2)"

static const char *const of_jobs[] = {
    "DELETE FROM events WHERE job_id IN " ENDED_JOBS,      "DELETE FROM losses WHERE job_id IN " ENDED_JOBS,
    "DELETE FROM checkpoints WHERE job_id IN " ENDED_JOBS, "DELETE FROM webhooks WHERE job_id IN " ENDED_JOBS,
    "DELETE FROM keys WHERE subject IN " ENDED_JOBS,       "DELETE FROM attempts WHERE job_id IN " ENDED_JOBS,
    "DELETE FROM jobs WHERE id IN " ENDED_JOBS};
/* The text of a job's progress; states and stages stay as its history. */
static const char *const of_events[] = {
    "DELETE FROM events WHERE type IN ('progress', 'loss') AND job_id IN " TALKATIVE_JOBS,
    "UPDATE jobs SET events_retired = 1 WHERE id IN " TALKATIVE_JOBS};
static const char *const of_keys[] = {
    "DELETE FROM keys WHERE (project, key) IN (SELECT project, key FROM keys WHERE expires < ?1 LIMIT ?2)"};
static const char *const of_preparations[] = {
    "DELETE FROM preparations WHERE key IN (SELECT key FROM preparations WHERE used < ?1 LIMIT ?2)"};

#define COUNT(list) (sizeof(list) / sizeof *(list))

/* Everything of a kind that is older than `before`, at most `most` of it: statements that see the same rows, of which
 * the last one's count is told. */
struct retiring {
    const char *const *statements; /* ?1: before, ?2: most */
    size_t n_statements;
    int64_t before; /* 0: never */
    uint64_t *n;
};

static groom_status retire(struct connection *c, const struct retiring *what, uint32_t most, struct groom_diag *diag)
{
    groom_status status = GROOM_OK;
    int64_t n_changed = 0;
    for (size_t i = 0; what->before > 0 && status == GROOM_OK && i < what->n_statements; i++) {
        struct query q = query_open(c, what->statements[i], diag);
        query_integer(&q, 1, what->before);
        query_integer(&q, 2, most);
        status = query_run(&q, &n_changed);
    }
    *what->n += (uint64_t)n_changed;
    return status;
}

groom_status store_retire(struct store *store, const struct store_retention *retention, uint32_t max_rows,
                          struct store_retired *retired, struct groom_diag *diag)
{
    struct store_retired done = {0};
    const struct retiring kinds[] = {
        {of_jobs, COUNT(of_jobs), retention->jobs_before_ms, &done.n_jobs},
        {of_events, COUNT(of_events), retention->events_before_ms, &done.n_event_streams},
        {of_keys, COUNT(of_keys), retention->keys_before_ms, &done.n_keys},
        {of_preparations, COUNT(of_preparations), retention->preparations_before_ms, &done.n_preparations}};
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    for (size_t k = 0; k < COUNT(kinds) && status == GROOM_OK; k++)
        status = retire(c, &kinds[k], max_rows, diag);
    if ((status = transaction_end(c, status, diag)) == GROOM_OK)
        *retired = done;
    return status;
}
