/* What a user removes: uploads that no unfinished job needs, grooms with all their revisions. */
#include <string.h>

#include "server/store/database.h"

static groom_status run_for(struct connection *c, const char *sql, const char *id, struct groom_diag *diag)
{
    struct query q = query_open(c, sql, diag);
    query_text(&q, 1, id);
    return query_run(&q, NULL);
}

/* Reports that compare it with something, or something with it; but a groom keeps what it measured against
 * strands that are gone since. */
static groom_status delete_qualities(struct connection *c, const char *id, struct groom_diag *diag)
{
    return run_for(c, "DELETE FROM qualities WHERE subject = ?1 OR target LIKE ?1 || '/%'"
                      " OR (target = ?1 AND subject NOT LIKE 'grm%')", id, diag);
}

static groom_status delete_preparations(struct connection *c, const char *id, struct groom_diag *diag)
{
    return run_for(c, "DELETE FROM preparations WHERE subject = ?1", id, diag);
}

/* --- uploads ------------------------------------------------------------------------------ */

/* Jobs that have not ended read their inputs again with each attempt. */
static groom_status check_unused(struct connection *c, const char *id, struct groom_diag *diag)
{
    char job[STORE_ID_SIZE] = "";
    struct query q = query_open(c,
                                "SELECT id FROM jobs WHERE state < 2 AND EXISTS"
                                " (SELECT 1 FROM json_tree(jobs.request) WHERE atom = ?1) LIMIT 1", diag);
    query_text(&q, 1, id);
    if (query_row(&q))
        query_copy(&q, 0, job, sizeof job);
    groom_status status = query_end(&q);
    if (status == GROOM_OK && job[0])
        status = groom_fail(diag, GROOM_ECONFLICT, "%s needs it: cancel that job, or wait for its end", job);
    return status;
}

static groom_status delete_asset(struct connection *c, enum store_asset_kind kind, const char *id,
                                 char sha256[STORE_HASH_SIZE], struct groom_diag *diag)
{
    char project[STORE_PROJECT_SIZE];
    struct query q = query_open(c, "DELETE FROM assets WHERE id = ?1 AND kind = ?2 RETURNING sha256, project", diag);
    query_text(&q, 1, id);
    query_integer(&q, 2, kind);
    bool found = query_row(&q);
    if (found)
        query_copy(&q, 0, sha256, STORE_HASH_SIZE);
    if (found)
        query_copy(&q, 1, project, sizeof project);
    groom_status status = query_run(&q, NULL);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no %s %.40s",
                            kind == STORE_STRANDS ? "upload of strands" : "head", id);
    if (status == GROOM_OK)
        status = audit_append(c, project, kind == STORE_STRANDS ? "strands.remove" : "head.remove", id, NULL,
                              store_now_ms(), diag);
    return status;
}

groom_status store_asset_remove(struct store *store, enum store_asset_kind kind, const char *id,
                                char garbage[STORE_HASH_SIZE], struct groom_diag *diag)
{
    char sha256[STORE_HASH_SIZE] = "";
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    if ((status = delete_asset(c, kind, id, sha256, diag)) == GROOM_OK)
        status = check_unused(c, id, diag);
    if (status == GROOM_OK)
        status = delete_qualities(c, id, diag);
    if (status == GROOM_OK)
        status = delete_preparations(c, id, diag);
    if ((status = transaction_end(c, status, diag)) == GROOM_OK)
        memcpy(garbage, sha256, STORE_HASH_SIZE);
    return status;
}

/* --- grooms -------------------------------------------------------------------------------- */

/* Arrays that no other groom's revision has go with it. */
static groom_status delete_arrays(struct connection *c, const char *id, struct groom_diag *diag)
{
    struct query arrays = query_open(c,
                                     "DELETE FROM arrays WHERE sha256 IN"
                                     " (SELECT sha256 FROM revision_arrays WHERE groom_id = ?1) AND NOT EXISTS"
                                     " (SELECT 1 FROM revision_arrays AS other WHERE other.sha256 = arrays.sha256"
                                     "  AND other.groom_id <> ?1)", diag);
    query_text(&arrays, 1, id);
    return query_run(&arrays, NULL);
}


static groom_status delete_groom_row(struct connection *c, const char *id, struct groom_diag *diag)
{
    char project[STORE_PROJECT_SIZE] = "";
    struct query q = query_open(c, "DELETE FROM grooms WHERE id = ?1 RETURNING project", diag);
    query_text(&q, 1, id);
    if (query_row(&q))
        query_copy(&q, 0, project, sizeof project);
    groom_status status = query_run(&q, NULL);
    if (status == GROOM_OK && !project[0])
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no groom %.40s", id);
    return status == GROOM_OK ? audit_append(c, project, "groom.remove", id, NULL, store_now_ms(), diag) : status;
}

static groom_status delete_groom(struct connection *c, const char *id, struct groom_diag *diag)
{
    /* arrays are asked for by the rows that refer to them, so the reference is checked at the end */
    groom_status status = database_execute(c->db, "PRAGMA defer_foreign_keys = ON", diag);
    if (status == GROOM_OK)
        status = delete_arrays(c, id, diag);
    if (status == GROOM_OK)
        status = run_for(c, "DELETE FROM revision_arrays WHERE groom_id = ?1", id, diag);
    if (status == GROOM_OK)
        status = run_for(c, "DELETE FROM revisions WHERE groom_id = ?1", id, diag);
    if (status == GROOM_OK)
        status = delete_qualities(c, id, diag);
    if (status == GROOM_OK)
        status = delete_preparations(c, id, diag);
    return status == GROOM_OK ? delete_groom_row(c, id, diag) : status;
}

groom_status store_groom_remove(struct store *store, const char *id, struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    return transaction_end(c, delete_groom(c, id, diag), diag);
}
