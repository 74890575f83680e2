/* Stored documents: read, listed, taken apart. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"

groom_status documents_parse(const char *json, size_t n_bytes, cJSON **document, struct groom_diag *diag)
{
    *document = cJSON_ParseWithLength(json, n_bytes);
    return *document ? GROOM_OK : groom_fail(diag, GROOM_EFORMAT, "the groom document is not JSON");
}

groom_status documents_load(struct grooms *grooms, const char *groom_id, uint32_t number,
                            struct store_revision *revision, cJSON **document, struct groom_diag *diag)
{
    groom_status status = store_revision_get(grooms->options.store, groom_id, number, revision, diag);
    if (status != GROOM_OK)
        return status;
    status = documents_parse(revision->document, strlen(revision->document), document, diag);
    if (status != GROOM_OK) {
        store_revision_finish(revision);
        return groom_fail(diag, GROOM_EINTERNAL, "the stored document of revision %u is damaged", number);
    }
    return GROOM_OK;
}

void documents_strip_model(cJSON *document)
{
    static const char *const members[] = {"strands", "guides", "instancing", "operator_guides", "operators", "base", "axes"};
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++)
        cJSON_DeleteItemFromObjectCaseSensitive(document, members[i]);
}

static groom_status set_member(cJSON *document, const char *name, cJSON *value)
{
    if (!value)
        return GROOM_ENOMEM;
    cJSON_DeleteItemFromObjectCaseSensitive(document, name);
    if (cJSON_AddItemToObject(document, name, value))
        return GROOM_OK;
    cJSON_Delete(value);
    return GROOM_ENOMEM;
}

groom_status documents_set_string(cJSON *document, const char *name, const char *string)
{
    return set_member(document, name, string ? cJSON_CreateString(string) : cJSON_CreateNull());
}

groom_status documents_set_number(cJSON *document, const char *name, double number)
{
    return set_member(document, name, cJSON_CreateNumber(number));
}

/* --- one document ------------------------------------------------------------------- */

static groom_status inline_arrays(struct grooms *grooms, const struct store_revision *revision,
                                  const cJSON *document, char **json, size_t *n_bytes, struct groom_diag *diag)
{
    struct arrays arrays;
    arrays_init(&arrays, grooms->options.store);
    struct groom_array_finder finder = arrays_finder(&arrays);
    groom_status status = arrays_allow(&arrays, document);
    if (status == GROOM_OK)
        status = groom_document_inline(revision->document, strlen(revision->document), &finder, json, n_bytes, diag);
    arrays_finish(&arrays);
    return status;
}

groom_status grooms_document(struct grooms *grooms, const char *groom_id, uint32_t revision, bool arrays,
                             char **json, size_t *n_bytes, uint32_t *number, struct groom_diag *diag)
{
    struct store_revision row = {0};
    cJSON *document = NULL;
    groom_status status = documents_load(grooms, groom_id, revision, &row, &document, diag);
    if (status != GROOM_OK)
        return status;
    if (arrays)
        status = inline_arrays(grooms, &row, document, json, n_bytes, diag);
    else
        status = groom_document_outline(row.document, strlen(row.document), json, n_bytes, diag);
    if (status == GROOM_OK)
        *number = row.number;
    cJSON_Delete(document);
    store_revision_finish(&row);
    return status;
}

/* --- lists ------------------------------------------------------------------------------ */

static void add_time(cJSON *node, const char *name, int64_t time_ms)
{
    char text[32];
    store_time_text(time_ms, text);
    cJSON_AddStringToObject(node, name, text);
}

/* {"<name>":[…],"next":…} as text; takes the items over. */
static groom_status print_page(const char *name, cJSON *items, int64_t next, char **json, struct groom_diag *diag)
{
    cJSON *root = cJSON_CreateObject();
    if (!cJSON_AddItemToObject(root, name, items))
        cJSON_Delete(items);
    if (next)
        cJSON_AddNumberToObject(root, "next", (double)next);
    else
        cJSON_AddNullToObject(root, "next");
    *json = cJSON_PrintUnformatted(root);
    cJSON_Delete(root);
    return *json ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to list %s", name);
}

groom_status grooms_list_json(struct grooms *grooms, const char *project, struct store_page page, char **json,
                              struct groom_diag *diag)
{
    struct store_groom_list list = {0};
    groom_status status = store_grooms_list(grooms->options.store, project, page, &list, diag);
    if (status != GROOM_OK)
        return status;
    cJSON *items = cJSON_CreateArray();
    for (size_t i = 0; i < list.n; i++) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(items, item);
        cJSON_AddStringToObject(item, "id", list.items[i].id);
        cJSON_AddStringToObject(item, "name", list.items[i].name);
        cJSON_AddNumberToObject(item, "revision", list.items[i].latest);
        add_time(item, "created_at", list.items[i].created_ms);
        add_time(item, "changed_at", list.items[i].changed_ms);
    }
    status = print_page("grooms", items, list.next, json, diag);
    store_groom_list_finish(&list);
    return status;
}

groom_status grooms_revisions_json(struct grooms *grooms, const char *groom_id, struct store_page page,
                                   char **json, struct groom_diag *diag)
{
    struct store_revision_list list = {0};
    groom_status status = store_revisions_list(grooms->options.store, groom_id, page, &list, diag);
    if (status != GROOM_OK)
        return status;
    cJSON *items = cJSON_CreateArray();
    for (size_t i = 0; i < list.n; i++) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(items, item);
        cJSON_AddNumberToObject(item, "revision", list.items[i].number);
        if (list.items[i].parent)
            cJSON_AddNumberToObject(item, "parent", list.items[i].parent);
        else
            cJSON_AddNullToObject(item, "parent");
        cJSON_AddStringToObject(item, "name", list.items[i].name);
        cJSON_AddStringToObject(item, "note", list.items[i].note);
        add_time(item, "created_at", list.items[i].created_ms);
    }
    status = print_page("revisions", items, list.next, json, diag);
    store_revision_list_finish(&list);
    return status;
}

groom_status project_has(struct grooms *grooms, const char *project, const char *id, struct groom_diag *diag)
{
    char found[STORE_PROJECT_SIZE];
    groom_status status = store_project_of(grooms->options.store, id, found, diag);
    if (status == GROOM_OK && project && strcmp(found, project) != 0)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no %.40s", id);
    return status;
}
