/* Counts for /metrics, and what keeps a blob alive. */
#include "server/store/database.h"

static groom_status count_jobs(struct connection *c, struct store_counts *counts, struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT state, count(*) FROM jobs GROUP BY state", diag);
    while (query_row(&q)) {
        int64_t state = query_int64(&q, 0);
        if (state >= 0 && state < STORE_JOB_STATES)
            counts->jobs[state] = (uint64_t)query_int64(&q, 1);
    }
    return query_end(&q);
}

groom_status store_count(struct store *store, struct store_counts *counts, struct groom_diag *diag)
{
    struct store_counts found = {0};
    struct connection *c = read_begin(store);
    groom_status status = count_jobs(c, &found, diag);
    if (status == GROOM_OK) {
        struct query q = query_open(c,
                                    "SELECT (SELECT count(*) FROM assets WHERE kind = 0),"
                                    " (SELECT count(*) FROM assets WHERE kind = 1),"
                                    " (SELECT count(*) FROM grooms), (SELECT count(*) FROM revisions),"
                                    " (SELECT count(*) FROM attempts WHERE state = 3)", diag);
        if (query_row(&q)) {
            found.strands = (uint64_t)query_int64(&q, 0);
            found.heads = (uint64_t)query_int64(&q, 1);
            found.grooms = (uint64_t)query_int64(&q, 2);
            found.revisions = (uint64_t)query_int64(&q, 3);
            found.attempts_died = (uint64_t)query_int64(&q, 4);
        }
        status = query_end(&q);
    }
    read_end(c);
    if (status == GROOM_OK)
        *counts = found;
    return status;
}

groom_status store_blob_referenced(struct store *store, const char *sha256, bool *referenced,
                                   struct groom_diag *diag)
{
    bool found;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT 1 FROM assets WHERE sha256 = ?1 UNION ALL"
                                       " SELECT 1 FROM checkpoints WHERE sha256 = ?1 UNION ALL"
                                       " SELECT 1 FROM preparations WHERE sha256 = ?1 UNION ALL"
                                       " SELECT 1 FROM uploads WHERE sha256 = ?1 LIMIT 1", diag);
    query_text(&q, 1, sha256);
    found = query_row(&q);
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *referenced = found;
    return status;
}
