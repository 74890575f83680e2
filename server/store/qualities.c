/* Quality reports, kept with what they are about. */
#include "server/store/database.h"

groom_status quality_insert(struct connection *c, const struct store_quality *key, const char *report, int64_t now,
                            struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT OR REPLACE INTO qualities (subject, number, target, report, created)"
                                       " VALUES (?1, ?2, ?3, ?4, ?5)", diag);
    query_text(&q, 1, key->subject);
    query_integer(&q, 2, key->number);
    query_text(&q, 3, key->target);
    query_text(&q, 4, report);
    query_integer(&q, 5, now);
    return query_run(&q, NULL);
}

groom_status store_quality_put(struct store *store, const struct store_quality *key, const char *report,
                               struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    return transaction_end(c, quality_insert(c, key, report, store_now_ms(), diag), diag);
}

groom_status store_quality_get(struct store *store, const struct store_quality *key, char **report,
                               struct groom_diag *diag)
{
    char *found = NULL;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT report FROM qualities WHERE subject = ?1 AND number = ?2 AND target = ?3", diag);
    query_text(&q, 1, key->subject);
    query_integer(&q, 2, key->number);
    query_text(&q, 3, key->target);
    bool row = query_row(&q);
    if (row)
        found = query_string(&q, 0);
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK && !row)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no quality report of %.40s against %.40s", key->subject,
                            key->target);
    if (status == GROOM_OK)
        *report = found;
    return status;
}
