/* Grooms and their revisions. A revision's large arrays are stored once by their hash. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/store/database.h"

/* --- writing: parts of a transaction ------------------------------------------------- */

static groom_status insert_array(struct connection *c, const struct store_array *array, struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT INTO arrays (sha256, bytes) VALUES (?1, ?2)"
                                       " ON CONFLICT (sha256) DO NOTHING", diag);
    query_text(&q, 1, array->sha256);
    query_bytes(&q, 2, array->bytes, array->n_bytes);
    return query_run(&q, NULL);
}

static groom_status array_is_stored(struct connection *c, const char *sha256, struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT 1 FROM arrays WHERE sha256 = ?1", diag);
    query_text(&q, 1, sha256);
    bool found = query_row(&q);
    groom_status status = query_end(&q);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_EINVAL, "the array %.64s is not in the store: send its bytes", sha256);
    return status;
}

static groom_status refer_to_array(struct connection *c, const struct store_revision_new *revision,
                                   uint32_t number, const char *sha256, struct groom_diag *diag)
{
    struct query q = query_open(c, "INSERT INTO revision_arrays (groom_id, number, sha256)"
                                       " VALUES (?1, ?2, ?3) ON CONFLICT DO NOTHING", diag);
    query_text(&q, 1, revision->groom_id);
    query_integer(&q, 2, number);
    query_text(&q, 3, sha256);
    return query_run(&q, NULL);
}

static groom_status insert_revision(struct connection *c, const struct store_revision_new *revision,
                                    uint32_t number, int64_t now, struct groom_diag *diag)
{
    struct query q = query_open(c,
                                "INSERT INTO revisions (groom_id, number, parent, name, document, note, created)"
                                " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)", diag);
    query_text(&q, 1, revision->groom_id);
    query_integer(&q, 2, number);
    query_integer(&q, 3, number - 1);
    query_text(&q, 4, revision->name ? revision->name : "");
    query_text(&q, 5, revision->document);
    query_text(&q, 6, revision->note ? revision->note : "");
    query_integer(&q, 7, now);
    groom_status status = query_run(&q, NULL);
    for (size_t i = 0; status == GROOM_OK && i < revision->n_arrays; i++) {
        const struct store_array *array = &revision->arrays[i];
        status = array->bytes ? insert_array(c, array, diag) : array_is_stored(c, array->sha256, diag);
        if (status == GROOM_OK)
            status = refer_to_array(c, revision, number, array->sha256, diag);
    }
    return status;
}

/* Who changed it, and what a repeated request is to be told. */
static groom_status note_change(struct connection *c, const struct store_revision_new *revision,
                                const char *project, const char *action, uint32_t number, int64_t now,
                                struct groom_diag *diag)
{
    char detail[96];
    snprintf(detail, sizeof detail, "revision %u: %.60s", number, revision->note ? revision->note : "");
    groom_status status = key_insert(c, project, revision->groom_id, number, now, diag);
    return status == GROOM_OK ? audit_append(c, project, action, revision->groom_id, detail, now, diag) : status;
}

groom_status groom_insert(struct connection *c, const struct store_revision_new *revision, const char *project,
                          int64_t now, struct groom_diag *diag)
{
    int64_t n_changed = 0;
    struct query q = query_open(c, "INSERT INTO grooms (id, name, latest, created, changed, project)"
                                   " VALUES (?1, ?2, 1, ?3, ?3, ?4) ON CONFLICT (id) DO NOTHING", diag);
    query_text(&q, 1, revision->groom_id);
    query_text(&q, 2, revision->name ? revision->name : "");
    query_integer(&q, 3, now);
    query_text(&q, 4, project);
    groom_status status = query_run(&q, &n_changed);
    if (status == GROOM_OK && n_changed == 0)
        status = groom_fail(diag, GROOM_ECONFLICT, "there is a groom %.40s already", revision->groom_id);
    if (status == GROOM_OK)
        status = insert_revision(c, revision, 1, now, diag);
    if (status == GROOM_OK && revision->quality) {
        struct store_quality key = {revision->groom_id, 1, revision->compared_with};
        status = quality_insert(c, &key, revision->quality, now, diag);
    }
    return status == GROOM_OK ? note_change(c, revision, project, "groom.create", 1, now, diag) : status;
}

groom_status store_groom_create(struct store *store, const struct store_revision_new *revision,
                                struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    return transaction_end(c, groom_insert(c, revision, project_or_default(revision->project), store_now_ms(), diag),
                           diag);
}

/* project: NULL, or filled in */
static groom_status read_latest(struct connection *c, const char *groom_id, uint32_t *latest,
                                char project[STORE_PROJECT_SIZE], struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT latest, project FROM grooms WHERE id = ?1", diag);
    query_text(&q, 1, groom_id);
    bool found = query_row(&q);
    if (found)
        *latest = (uint32_t)query_int64(&q, 0);
    if (found && project)
        query_copy(&q, 1, project, STORE_PROJECT_SIZE);
    groom_status status = query_end(&q);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no groom %.40s", groom_id);
    return status;
}

static groom_status advance_groom(struct connection *c, const struct store_revision_new *revision,
                                  uint32_t number, int64_t now, struct groom_diag *diag)
{
    struct query q = query_open(c, "UPDATE grooms SET latest = ?2, name = ?3, changed = ?4 WHERE id = ?1",
                                diag);
    query_text(&q, 1, revision->groom_id);
    query_integer(&q, 2, number);
    query_text(&q, 3, revision->name ? revision->name : "");
    query_integer(&q, 4, now);
    return query_run(&q, NULL);
}

groom_status groom_add_revision(struct connection *c, const struct store_revision_new *revision,
                                uint32_t expected_latest, struct groom_diag *diag)
{
    uint32_t latest = 0;
    char project[STORE_PROJECT_SIZE] = "";
    int64_t now = store_now_ms();
    groom_status status = read_latest(c, revision->groom_id, &latest, project, diag);
    if (status != GROOM_OK)
        return status;
    if (latest != expected_latest)
        return groom_fail(diag, GROOM_ECONFLICT,
                          "the groom is at revision %u by now, not %u: get it and edit that", latest,
                          expected_latest);
    status = advance_groom(c, revision, latest + 1, now, diag);
    if (status == GROOM_OK)
        status = insert_revision(c, revision, latest + 1, now, diag);
    return status == GROOM_OK ? note_change(c, revision, project, "groom.revise", latest + 1, now, diag) : status;
}

groom_status store_revision_add(struct store *store, const struct store_revision_new *revision,
                                uint32_t expected_latest, struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    return transaction_end(c, groom_add_revision(c, revision, expected_latest, diag), diag);
}

/* --- reading --------------------------------------------------------------------------- */

static void read_revision(struct query *q, struct store_revision *revision)
{
    query_copy(q, 0, revision->groom_id, sizeof revision->groom_id);
    revision->number = (uint32_t)query_int64(q, 1);
    revision->parent = (uint32_t)query_int64(q, 2);
    revision->latest = (uint32_t)query_int64(q, 3);
    revision->name = query_string(q, 4);
    revision->note = query_string(q, 5);
    revision->created_ms = query_int64(q, 6);
    revision->document = query_string(q, 7);
}

groom_status store_revision_get(struct store *store, const char *groom_id, uint32_t number,
                                struct store_revision *revision, struct groom_diag *diag)
{
    struct store_revision row = {0};
    uint32_t latest = 0;
    bool found = false;
    struct connection *c = read_begin(store);
    groom_status status = read_latest(c, groom_id, &latest, NULL, diag);
    if (status == GROOM_OK) {
        struct query q = query_open(c,
                                    "SELECT groom_id, number, parent, ?3, name, note, created, document"
                                    " FROM revisions WHERE groom_id = ?1 AND number = ?2", diag);
        query_text(&q, 1, groom_id);
        query_integer(&q, 2, number ? number : latest);
        query_integer(&q, 3, latest);
        if ((found = query_row(&q)))
            read_revision(&q, &row);
        status = query_end(&q);
        if (status == GROOM_OK && !found)
            status = groom_fail(diag, GROOM_ENOTFOUND, "the groom %.40s has revisions 1 to %u, not %u", groom_id,
                                latest, number);
    }
    read_end(c);
    if (status == GROOM_OK)
        *revision = row;
    else
        store_revision_finish(&row);
    return status;
}

groom_status store_array_get(struct store *store, const char *sha256, void **bytes, size_t *n_bytes,
                             struct groom_diag *diag)
{
    void *copy = NULL;
    size_t n = 0;
    bool found;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT bytes FROM arrays WHERE sha256 = ?1", diag);
    query_text(&q, 1, sha256);
    if ((found = query_row(&q))) {
        const void *stored = sqlite3_column_blob(q.statement, 0);
        n = (size_t)sqlite3_column_bytes(q.statement, 0);
        if ((copy = malloc(n ? n : 1)) && n > 0 && stored)
            memcpy(copy, stored, n);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no array %.64s", sha256);
    else if (status == GROOM_OK && !copy)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for an array of %zu bytes", n);
    if (status == GROOM_OK) {
        *bytes = copy;
        *n_bytes = n;
    } else {
        free(copy);
    }
    return status;
}

groom_status store_revisions_list(struct store *store, const char *groom_id, struct store_page page,
                                  struct store_revision_list *list, struct groom_diag *diag)
{
    struct store_revision_list found = {0};
    uint32_t latest = 0;
    struct connection *c = read_begin(store);
    groom_status status = read_latest(c, groom_id, &latest, NULL, diag);
    if (status == GROOM_OK) {
        struct query q = query_open(c,
                                    "SELECT groom_id, number, parent, ?4, name, note, created, NULL"
                                    " FROM revisions WHERE groom_id = ?1 AND number < ?2"
                                    " ORDER BY number DESC LIMIT ?3", diag);
        query_text(&q, 1, groom_id);
        query_integer(&q, 2, page_before(page));
        query_integer(&q, 3, page_limit(page));
        query_integer(&q, 4, latest);
        while (query_row(&q)) {
            if ((int64_t)found.n == page_limit(page) - 1) {
                found.next = found.items[found.n - 1].number;
                break;
            }
            struct store_revision *row = query_append(&q, &found.items, &found.n, sizeof *row);
            if (row)
                read_revision(&q, row);
        }
        status = query_end(&q);
    }
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_revision_list_finish(&found);
    return status;
}

groom_status store_grooms_list(struct store *store, const char *project, struct store_page page,
                               struct store_groom_list *list, struct groom_diag *diag)
{
    struct store_groom_list found = {0};
    int64_t last = 0;
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT seq, id, name, latest, created, changed FROM grooms"
                                       " WHERE seq < ?1 AND project = ?3 ORDER BY seq DESC LIMIT ?2", diag);
    query_integer(&q, 1, page_before(page));
    query_integer(&q, 2, page_limit(page));
    query_text(&q, 3, project_or_default(project));
    while (query_row(&q)) {
        if ((int64_t)found.n == page_limit(page) - 1) {
            found.next = last;
            break;
        }
        struct store_groom *groom = query_append(&q, &found.items, &found.n, sizeof *groom);
        if (!groom)
            break;
        last = query_int64(&q, 0);
        query_copy(&q, 1, groom->id, sizeof groom->id);
        groom->name = query_string(&q, 2);
        groom->latest = (uint32_t)query_int64(&q, 3);
        groom->created_ms = query_int64(&q, 4);
        groom->changed_ms = query_int64(&q, 5);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_groom_list_finish(&found);
    return status;
}

/* --- finishing ------------------------------------------------------------------------- */

void store_revision_finish(struct store_revision *revision)
{
    if (!revision)
        return;
    free(revision->name);
    free(revision->document);
    free(revision->note);
    *revision = (struct store_revision){0};
}

void store_revision_list_finish(struct store_revision_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++)
        store_revision_finish(&list->items[i]);
    free(list->items);
    *list = (struct store_revision_list){0};
}

void store_groom_list_finish(struct store_groom_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++)
        free(list->items[i].name);
    free(list->items);
    *list = (struct store_groom_list){0};
}
