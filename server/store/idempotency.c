/* Idempotency keys: what a key stands for is written with what it made, in one transaction. */
#include <string.h>

#include "server/actor.h"
#include "server/store/database.h"

groom_status key_insert(struct connection *c, const char *project, const char *subject, uint32_t number, int64_t now,
                        struct groom_diag *diag)
{
    const struct actor *actor = actor_get();
    int64_t n_changed = 0;
    if (!actor->key)
        return GROOM_OK;
    struct query old = query_open(c, "DELETE FROM keys WHERE project = ?1 AND key = ?2 AND expires <= ?3", diag);
    query_text(&old, 1, project);
    query_text(&old, 2, actor->key);
    query_integer(&old, 3, now);
    groom_status status = query_run(&old, NULL);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "INSERT INTO keys (project, key, request_hash, subject, number, expires)"
                                   " VALUES (?1, ?2, ?3, ?4, ?5, ?6) ON CONFLICT DO NOTHING", diag);
    query_text(&q, 1, project);
    query_text(&q, 2, actor->key);
    query_text(&q, 3, actor->key_hash);
    query_text(&q, 4, subject);
    query_integer(&q, 5, number);
    query_integer(&q, 6, now + actor->key_lifetime_ms);
    status = query_run(&q, &n_changed);
    if (status == GROOM_OK && n_changed == 0)
        status = groom_fail(diag, GROOM_ECONFLICT, "a request with this Idempotency-Key came first");
    return status;
}

groom_status store_key_find(struct store *store, const char *project, const char *key, const char *request_hash,
                            struct store_key *found, struct groom_diag *diag)
{
    struct store_key row = {0};
    char hash[STORE_HASH_SIZE] = "";
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT subject, number, request_hash FROM keys"
                                   " WHERE project = ?1 AND key = ?2 AND expires > ?3", diag);
    query_text(&q, 1, project);
    query_text(&q, 2, key);
    query_integer(&q, 3, store_now_ms());
    bool known = query_row(&q);
    if (known) {
        query_copy(&q, 0, row.subject, sizeof row.subject);
        row.number = (uint32_t)query_int64(&q, 1);
        query_copy(&q, 2, hash, sizeof hash);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK && !known)
        status = groom_fail(diag, GROOM_ENOTFOUND, "this Idempotency-Key is new");
    if (status == GROOM_OK && strcmp(hash, request_hash) != 0)
        status = groom_fail(diag, GROOM_ECONFLICT,
                            "this Idempotency-Key came with another request before; take a new key for a new one");
    if (status == GROOM_OK)
        *found = row;
    return status;
}
