/* Uploads: strands and heads. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <openssl/evp.h>

#include "server/store/database.h"

#define COLUMNS "seq, id, kind, sha256, n_bytes, format, unit_m, up, name, metadata, created, project, owner"

/* The default project's ids are those of the time before there were projects. */
void store_asset_id(const char *project, enum store_asset_kind kind, const char *sha256, const char *format,
                    double unit_m, char up, char id[STORE_ID_SIZE])
{
    char key[320];
    unsigned char hash[EVP_MAX_MD_SIZE] = {0};
    int n = snprintf(key, sizeof key, "%d|%.64s|%.32s|%.17g|%c", (int)kind, sha256, format ? format : "",
                     unit_m, up);
    if (strcmp(project_or_default(project), STORE_DEFAULT_PROJECT) != 0)
        n += snprintf(key + n, sizeof key - (size_t)n, "|%.64s", project);
    EVP_Digest(key, (size_t)n, hash, NULL, EVP_sha256(), NULL);
    n = snprintf(id, STORE_ID_SIZE, "%s", kind == STORE_STRANDS ? "str_" : "head_");
    for (int i = 0; i < 20; i++)
        id[n++] = "abcdefghijklmnopqrstuvwxyz234567"[hash[i] & 31];
    id[n] = 0;
}

/* returns the row's place in lists */
static int64_t read_asset(struct query *q, struct store_asset *asset)
{
    query_copy(q, 1, asset->id, sizeof asset->id);
    asset->kind = (enum store_asset_kind)query_int64(q, 2);
    query_copy(q, 3, asset->sha256, sizeof asset->sha256);
    asset->n_bytes = (uint64_t)query_int64(q, 4);
    asset->format = query_string(q, 5);
    asset->unit_m = query_double(q, 6);
    char up[2];
    query_copy(q, 7, up, sizeof up);
    asset->up = up[0];
    asset->name = query_string(q, 8);
    asset->metadata = query_string(q, 9);
    asset->created_ms = query_int64(q, 10);
    query_copy(q, 11, asset->project, sizeof asset->project);
    query_copy(q, 12, asset->owner, sizeof asset->owner);
    return query_int64(q, 0);
}

/* With this upload, which is inserted already. */
static groom_status check_room(struct connection *c, const char *owner, uint64_t n_bytes, uint64_t max_bytes,
                               struct groom_diag *diag)
{
    struct store_usage usage = {0};
    groom_status status = max_bytes ? usage_read(c, owner, &usage, diag) : GROOM_OK;
    if (status == GROOM_OK && usage.n_bytes > max_bytes && max_bytes)
        status = groom_fail(diag, GROOM_ELIMIT,
                            "the token's uploads have %llu bytes and this one has %llu; its limit is %llu",
                            (unsigned long long)(usage.n_bytes - n_bytes), (unsigned long long)n_bytes,
                            (unsigned long long)max_bytes);
    return status;
}

static groom_status insert_row(struct connection *c, const struct store_asset *asset, const char *owner, int64_t now,
                               bool *created, struct groom_diag *diag)
{
    char up[2] = {asset->up, 0};
    int64_t n_changed = 0;
    struct query q = query_open(c,
                                "INSERT INTO assets (id, kind, sha256, n_bytes, format, unit_m, up, name,"
                                " metadata, created, project, owner)"
                                " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)"
                                " ON CONFLICT (id) DO NOTHING", diag);
    query_text(&q, 1, asset->id);
    query_integer(&q, 2, asset->kind);
    query_text(&q, 3, asset->sha256);
    query_integer(&q, 4, (int64_t)asset->n_bytes);
    query_text(&q, 5, asset->format ? asset->format : "");
    query_real(&q, 6, asset->unit_m);
    query_text(&q, 7, up);
    query_text(&q, 8, asset->name ? asset->name : "");
    query_text(&q, 9, asset->metadata ? asset->metadata : "{}");
    query_integer(&q, 10, asset->created_ms ? asset->created_ms : now);
    query_text(&q, 11, project_or_default(asset->project));
    query_text(&q, 12, owner);
    groom_status status = query_run(&q, &n_changed);
    *created = n_changed == 1;
    return status;
}

groom_status asset_insert(struct connection *c, const struct store_asset *asset, uint64_t max_bytes, int64_t now,
                          bool *created, struct groom_diag *diag)
{
    const char *project = project_or_default(asset->project), *owner = asset->owner[0] ? asset->owner : project;
    const char *action = asset->kind == STORE_STRANDS ? "strands.upload" : "head.upload";
    groom_status status = insert_row(c, asset, owner, now, created, diag);
    if (status == GROOM_OK && *created)
        status = check_room(c, owner, asset->n_bytes, max_bytes, diag);
    if (status == GROOM_OK && *created)
        status = audit_append(c, project, action, asset->id, asset->name, now, diag);
    return status;
}

groom_status store_asset_put(struct store *store, const struct store_asset *asset, uint64_t max_bytes, bool *created,
                             struct groom_diag *diag)
{
    bool inserted = false;
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    status = transaction_end(c, asset_insert(c, asset, max_bytes, store_now_ms(), &inserted, diag), diag);
    if (status == GROOM_OK && created)
        *created = inserted;
    return status;
}

groom_status store_asset_get(struct store *store, const char *project, enum store_asset_kind kind,
                             const char *id, struct store_asset *asset, struct groom_diag *diag)
{
    struct store_asset row = {0};
    bool found = false;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT " COLUMNS " FROM assets WHERE id = ?1 AND kind = ?2"
                                   " AND (?3 IS NULL OR project = ?3)", diag);
    query_text(&q, 1, id);
    query_integer(&q, 2, kind);
    query_text(&q, 3, project);
    if ((found = query_row(&q)))
        read_asset(&q, &row);
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no %s %.40s",
                            kind == STORE_STRANDS ? "upload of strands" : "head", id);
    if (status == GROOM_OK)
        *asset = row;
    else
        store_asset_finish(&row);
    return status;
}

groom_status store_assets_list(struct store *store, const char *project, enum store_asset_kind kind,
                               struct store_page page, struct store_asset_list *list, struct groom_diag *diag)
{
    struct store_asset_list found = {0};
    int64_t last = 0;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT " COLUMNS " FROM assets WHERE kind = ?1 AND seq < ?2 AND project = ?4"
                                       " ORDER BY seq DESC LIMIT ?3", diag);
    query_integer(&q, 1, kind);
    query_integer(&q, 2, page_before(page));
    query_integer(&q, 3, page_limit(page));
    query_text(&q, 4, project_or_default(project));
    while (query_row(&q)) {
        if ((int64_t)found.n == page_limit(page) - 1) {
            found.next = last;
            break;
        }
        struct store_asset *asset = query_append(&q, &found.items, &found.n, sizeof *asset);
        if (asset)
            last = read_asset(&q, asset);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_asset_list_finish(&found);
    return status;
}

void store_asset_finish(struct store_asset *asset)
{
    if (!asset)
        return;
    free(asset->format);
    free(asset->name);
    free(asset->metadata);
    *asset = (struct store_asset){0};
}

void store_asset_list_finish(struct store_asset_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++)
        store_asset_finish(&list->items[i]);
    free(list->items);
    *list = (struct store_asset_list){0};
}
