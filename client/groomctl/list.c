/* list, get and delete. */
#include <stdio.h>
#include <string.h>

#include "client/groomctl/api.h"
#include "client/groomctl/output_file.h"
#include "client/groomctl/transfer.h"
#include "proto/url.h"

/* The collections: what an id starts with, and the columns of its list. */
static const struct collection {
    const char *name, *prefix, *path;
    const char *columns[6];
} collections[] = {
    {"strands", "str_", "/v1/strands", {"id", "strands", "vertices", "format", "name", NULL}},
    {"heads", "head_", "/v1/heads", {"id", "triangles", "vertices", "format", "name", NULL}},
    {"jobs", "job_", "/v1/jobs", {"id", "state", "progress", "kind", "created_at", NULL}},
    {"grooms", "grm_", "/v1/grooms", {"id", "revision", "changed_at", "name", NULL}},
    {"uploads", "upl_", "/v1/uploads", {NULL}}, /* under way: nobody lists them */
};
enum { N_COLLECTIONS = sizeof collections / sizeof collections[0] };

/* --- list -------------------------------------------------------------------------------- */

static void print_cell(const cJSON *row, const char *column)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(row, column);
    if (cJSON_IsString(item))
        printf("%-12s  ", item->valuestring);
    else if (!cJSON_IsNumber(item))
        printf("%-12s  ", "-");
    else if (!strcmp(column, "progress"))
        printf("%3.0f %%  ", 100 * item->valuedouble);
    else
        printf("%12.0f  ", item->valuedouble);
}

static void print_row(const struct groomctl *ctl, const struct collection *collection, const cJSON *row)
{
    if (ctl->json) {
        api_print(ctl, row);
        return;
    }
    for (int i = 0; collection->columns[i]; i++)
        print_cell(row, collection->columns[i]);
    printf("\n");
}

/* The member that holds the rows. */
static const cJSON *rows_of(const struct collection *collection, const cJSON *page)
{
    const cJSON *rows = cJSON_GetObjectItemCaseSensitive(page, collection->name);
    return rows ? rows : cJSON_IsArray(page) ? page : NULL;
}

static int list(struct groomctl *ctl, const struct collection *collection, const struct arguments *arguments)
{
    struct url url;
    cJSON *page = NULL;
    const cJSON *row;
    url_init(&url, collection->path);
    url_query(&url, "limit", argument(arguments, "limit"));
    url_query(&url, "before", argument(arguments, "before"));
    url_query(&url, "state", argument(arguments, "state"));
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &page);
    if (status != DONE)
        return status;
    cJSON_ArrayForEach(row, rows_of(collection, page)) { print_row(ctl, collection, row); }
    if (!ctl->json && api_number(page, "next", 0) > 0)
        fprintf(stderr, "there is more: groomctl list %s --before %.0f\n", collection->name,
                api_number(page, "next", 0));
    cJSON_Delete(page);
    return DONE;
}

int command_list(struct groomctl *ctl, const struct arguments *arguments)
{
    for (int i = 0; i < N_COLLECTIONS; i++)
        if (!strcmp(arguments->operands[0], collections[i].name) && collections[i].columns[0])
            return list(ctl, &collections[i], arguments);
    return groomctl_usage_error("list", "there is no list of \"%s\": strands, heads, jobs or grooms",
                                arguments->operands[0]);
}

/* --- get ----------------------------------------------------------------------------------- */

static const struct collection *collection_of(const char *id)
{
    for (int i = 0; i < N_COLLECTIONS; i++)
        if (!strncmp(id, collections[i].prefix, strlen(collections[i].prefix)))
            return &collections[i];
    return NULL;
}

int command_get(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *id = arguments->operands[0], *path = argument(arguments, "output");
    const struct collection *collection = collection_of(id);
    struct url url;
    cJSON *answer = NULL;
    if (!collection)
        return groomctl_usage_error("get", "\"%s\" is no id: they start with str_, head_, job_, grm_ or upl_", id);
    url_init(&url, collection->path);
    url_segment(&url, id);
    url_query(&url, "revision", argument(arguments, "revision"));
    if (path)
        return download_file(ctl, url.text, path);
    if (!strcmp(collection->name, "grooms") && !argument(arguments, "arrays"))
        url_query(&url, "arrays", "false");
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &answer);
    if (status == DONE)
        api_print(ctl, answer);
    cJSON_Delete(answer);
    return status;
}

/* --- delete -------------------------------------------------------------------------------- */

static int delete_one(struct groomctl *ctl, const char *id)
{
    const struct collection *collection = collection_of(id);
    struct url url;
    if (!collection || !strcmp(collection->name, "jobs"))
        return groomctl_usage_error("delete", "\"%s\" is no id of strands, a head, a groom or an upload (jobs: groomctl cancel)",
                                    id);
    url_init(&url, collection->path);
    url_segment(&url, id);
    if (!strcmp(collection->name, "uploads"))
        return api_json(ctl, "DELETE", url.text, NULL, "Tus-Resumable: 1.0.0", NULL);
    return api_json(ctl, "DELETE", url.text, NULL, NULL, NULL);
}

static void print_removed(const struct groomctl *ctl, const char *id)
{
    cJSON *object = ctl->json ? cJSON_CreateObject() : NULL;
    if (!object)
        return;
    cJSON_AddStringToObject(object, "removed", id);
    api_print(ctl, object);
    cJSON_Delete(object);
}

int command_delete(struct groomctl *ctl, const struct arguments *arguments)
{
    int worst = DONE;
    for (size_t i = 0; i < arguments->n_operands; i++) {
        int status = delete_one(ctl, arguments->operands[i]);
        if (status == DONE)
            print_removed(ctl, arguments->operands[i]);
        worst = status != DONE ? status : worst;
    }
    return worst;
}
