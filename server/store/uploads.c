/* Uploads that come in pieces. */
#include <stdlib.h>

#include "server/store/database.h"

#define COLUMNS "id, n_bytes, n_durable, sha256, metadata, created, expires, project, owner"

static void read_upload(struct query *q, struct store_upload *upload)
{
    query_copy(q, 0, upload->id, sizeof upload->id);
    upload->n_bytes = (uint64_t)query_int64(q, 1);
    upload->n_durable = (uint64_t)query_int64(q, 2);
    query_copy(q, 3, upload->sha256, sizeof upload->sha256);
    upload->metadata = query_string(q, 4);
    upload->created_ms = query_int64(q, 5);
    upload->expires_ms = query_int64(q, 6);
    query_copy(q, 7, upload->project, sizeof upload->project);
    query_copy(q, 8, upload->owner, sizeof upload->owner);
}

static groom_status no_such_upload(const char *id, struct groom_diag *diag)
{
    return groom_fail(diag, GROOM_ENOTFOUND, "there is no upload %.40s, or it has expired", id);
}

groom_status store_upload_create(struct store *store, const struct store_upload *upload, struct groom_diag *diag)
{
    const char *project = project_or_default(upload->project);
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "INSERT INTO uploads (id, n_bytes, metadata, created, expires, project, owner)"
                                   " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)", diag);
    query_text(&q, 1, upload->id);
    query_integer(&q, 2, (int64_t)upload->n_bytes);
    query_text(&q, 3, upload->metadata ? upload->metadata : "");
    query_integer(&q, 4, upload->created_ms);
    query_integer(&q, 5, upload->expires_ms);
    query_text(&q, 6, project);
    query_text(&q, 7, upload->owner[0] ? upload->owner : project);
    return transaction_end(c, query_run(&q, NULL), diag);
}

groom_status store_upload_get(struct store *store, const char *id, struct store_upload *upload,
                              struct groom_diag *diag)
{
    struct store_upload row = {0};
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT " COLUMNS " FROM uploads WHERE id = ?1 AND expires > ?2", diag);
    query_text(&q, 1, id);
    query_integer(&q, 2, store_now_ms());
    bool found = query_row(&q);
    if (found)
        read_upload(&q, &row);
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK && !found)
        status = no_such_upload(id, diag);
    if (status == GROOM_OK)
        *upload = row;
    else
        store_upload_finish(&row);
    return status;
}

/* Run a statement that is to touch the one row of that id, in a transaction that has begun. */
static groom_status end_change(struct connection *c, struct query *q, const char *id, struct groom_diag *diag)
{
    int64_t n_changed = 0;
    groom_status status = query_run(q, &n_changed);
    if (status == GROOM_OK && n_changed == 0)
        status = no_such_upload(id, diag);
    return transaction_end(c, status, diag);
}

groom_status store_upload_advance(struct store *store, const char *id, uint64_t n_durable, int64_t expires_ms,
                                  struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c,
                                "UPDATE uploads SET n_durable = max(n_durable, min(?2, n_bytes)),"
                                " expires = max(expires, ?3) WHERE id = ?1", diag);
    query_text(&q, 1, id);
    query_integer(&q, 2, (int64_t)n_durable);
    query_integer(&q, 3, expires_ms);
    return end_change(c, &q, id, diag);
}

groom_status store_upload_set_blob(struct store *store, const char *id, const char *sha256, int64_t expires_ms,
                                   struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "UPDATE uploads SET sha256 = ?2, expires = max(expires, ?3) WHERE id = ?1",
                                diag);
    query_text(&q, 1, id);
    query_text(&q, 2, sha256);
    query_integer(&q, 3, expires_ms);
    return end_change(c, &q, id, diag);
}

groom_status store_upload_remove(struct store *store, const char *id, char garbage[STORE_HASH_SIZE],
                                 struct groom_diag *diag)
{
    char sha256[STORE_HASH_SIZE] = "";
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "DELETE FROM uploads WHERE id = ?1 RETURNING sha256", diag);
    query_text(&q, 1, id);
    bool found = query_row(&q);
    if (found)
        query_copy(&q, 0, sha256, sizeof sha256);
    status = query_run(&q, NULL);
    if (status == GROOM_OK && !found)
        status = no_such_upload(id, diag);
    if ((status = transaction_end(c, status, diag)) == GROOM_OK)
        for (size_t i = 0; i < STORE_HASH_SIZE; i++)
            garbage[i] = sha256[i];
    return status;
}

groom_status store_uploads_list(struct store *store, int64_t before_ms, struct store_upload_list *list,
                                struct groom_diag *diag)
{
    struct store_upload_list found = {0};
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT " COLUMNS " FROM uploads WHERE expires <= ?1 ORDER BY expires", diag);
    query_integer(&q, 1, before_ms);
    while (query_row(&q)) {
        struct store_upload *upload = query_append(&q, &found.items, &found.n, sizeof *upload);
        if (!upload)
            break;
        read_upload(&q, upload);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_upload_list_finish(&found);
    return status;
}

void store_upload_finish(struct store_upload *upload)
{
    if (!upload)
        return;
    free(upload->metadata);
    *upload = (struct store_upload){0};
}

void store_upload_list_finish(struct store_upload_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++)
        store_upload_finish(&list->items[i]);
    free(list->items);
    *list = (struct store_upload_list){0};
}
