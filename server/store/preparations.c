/* Preparations: what was worked out of strands alone. */
#include "server/store/database.h"

static groom_status insert_preparation(struct connection *c, const char *key, const char *subject,
                                       const struct store_preparation *preparation, struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT INTO preparations (key, subject, sha256, n_bytes, used)"
                                   " VALUES (?1, ?2, ?3, ?4, ?5) ON CONFLICT (key) DO UPDATE SET"
                                   " sha256 = ?3, n_bytes = ?4, used = ?5", diag);
    query_text(&q, 1, key);
    query_text(&q, 2, subject);
    query_text(&q, 3, preparation->sha256);
    query_integer(&q, 4, (int64_t)preparation->n_bytes);
    query_integer(&q, 5, store_now_ms());
    return query_run(&q, NULL);
}

groom_status store_attempt_preparation(struct store *store, const struct store_attempt_ref *ref, const char *key,
                                       const char *subject, const struct store_preparation *preparation,
                                       struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    if ((status = attempt_may_speak(c, ref, NULL, diag)) == GROOM_OK)
        status = insert_preparation(c, key, subject, preparation, diag);
    return transaction_end(c, status, diag);
}

groom_status store_preparation_get(struct store *store, const char *key, struct store_preparation *preparation,
                                   struct groom_diag *diag)
{
    struct store_preparation row = {0};
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "UPDATE preparations SET used = ?2 WHERE key = ?1 RETURNING sha256, n_bytes", diag);
    query_text(&q, 1, key);
    query_integer(&q, 2, store_now_ms());
    bool found = query_row(&q);
    if (found) {
        query_copy(&q, 0, row.sha256, sizeof row.sha256);
        row.n_bytes = (uint64_t)query_int64(&q, 1);
    }
    status = transaction_end(c, query_run(&q, NULL), diag);
    if (status == GROOM_OK && !found)
        return groom_fail(diag, GROOM_ENOTFOUND, "nothing is prepared under %.64s", key);
    if (status == GROOM_OK)
        *preparation = row;
    return status;
}
