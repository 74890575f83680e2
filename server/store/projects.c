/* Whose things are, and how much of it. */
#include <string.h>

#include "server/store/database.h"

const char *project_or_default(const char *project)
{
    return project && project[0] ? project : STORE_DEFAULT_PROJECT;
}

/* Where a thing of this id would stand. */
static const char *lookup_of(const char *id)
{
    static const struct {
        const char *prefix, *sql;
    } tables[] = {{"str_", "SELECT project FROM assets WHERE id = ?1 AND kind = 0"},
                  {"head_", "SELECT project FROM assets WHERE id = ?1 AND kind = 1"},
                  {"grm_", "SELECT project FROM grooms WHERE id = ?1"},
                  {"upl_", "SELECT project FROM uploads WHERE id = ?1"},
                  {"job_", "SELECT project FROM jobs WHERE id = ?1"}};
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++)
        if (strncmp(id, tables[i].prefix, strlen(tables[i].prefix)) == 0)
            return tables[i].sql;
    return NULL;
}

groom_status store_project_of(struct store *store, const char *id, char project[STORE_PROJECT_SIZE],
                              struct groom_diag *diag)
{
    char found[STORE_PROJECT_SIZE] = "";
    const char *sql = lookup_of(id);
    groom_status status = GROOM_OK;
    if (sql) {
        struct connection *c = read_begin(store);
        struct query q = query_open(c, sql, diag);
        query_text(&q, 1, id);
        if (query_row(&q))
            query_copy(&q, 0, found, sizeof found);
        status = query_end(&q);
        read_end(c);
    }
    if (status == GROOM_OK && !found[0])
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no %.40s", id);
    if (status == GROOM_OK)
        memcpy(project, found, sizeof found);
    return status;
}

groom_status usage_read(struct connection *c, const char *owner, struct store_usage *usage, struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT (SELECT coalesce(sum(n_bytes), 0) FROM assets WHERE owner = ?1) +"
                                   " (SELECT coalesce(sum(n_bytes), 0) FROM uploads WHERE owner = ?1 AND sha256 = ''),"
                                   " (SELECT count(*) FROM jobs WHERE owner = ?1 AND state = 0)", diag);
    query_text(&q, 1, owner);
    if (query_row(&q)) {
        usage->n_bytes = (uint64_t)query_int64(&q, 0);
        usage->n_queued = (uint32_t)query_int64(&q, 1);
    }
    return query_end(&q);
}

groom_status store_usage_of(struct store *store, const char *owner, struct store_usage *usage,
                            struct groom_diag *diag)
{
    struct store_usage found = {0};
    struct connection *c = read_begin(store);
    groom_status status = usage_read(c, owner, &found, diag);
    read_end(c);
    if (status == GROOM_OK)
        *usage = found;
    return status;
}
