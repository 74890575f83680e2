/* The service itself, and first revisions. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"

#define DEFAULT_CACHE_BYTES ((size_t)512 << 20)

groom_status grooms_create(const struct grooms_options *options, struct grooms **out, struct groom_diag *diag)
{
    struct grooms *grooms = calloc(1, sizeof *grooms);
    if (!grooms)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the groom service");
    grooms->options = *options;
    grooms->context.pool = options->pool;
    pthread_mutex_init(&grooms->comparing, NULL);
    size_t max_bytes = options->max_cache_bytes ? options->max_cache_bytes : DEFAULT_CACHE_BYTES;
    if (models_create(max_bytes, &grooms->models) != GROOM_OK || states_create(2 * max_bytes, &grooms->states) != GROOM_OK ||
        heads_create(&grooms->heads) != GROOM_OK) {
        grooms_destroy(grooms);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the groom service");
    }
    *out = grooms;
    return GROOM_OK;
}

void grooms_destroy(struct grooms *grooms)
{
    if (!grooms)
        return;
    cache_destroy(grooms->models);
    states_destroy(grooms->states);
    cache_destroy(grooms->heads);
    pthread_mutex_destroy(&grooms->comparing);
    free(grooms);
}

/* --- first revisions ---------------------------------------------------------------------- */

struct grooms_kept {
    char *document, *name, *target, *quality;
    struct store_array *list;
    struct arrays arrays;
};

static groom_status set_source(cJSON *around, const struct grooms_source *source)
{
    cJSON *node = cJSON_CreateObject();
    groom_status status = GROOM_ENOMEM;
    if (node && documents_set_string(node, "strands", source->strands) == GROOM_OK &&
        documents_set_string(node, "head", source->head) == GROOM_OK &&
        documents_set_string(node, "job", source->job) == GROOM_OK) {
        cJSON_DeleteItemFromObjectCaseSensitive(around, "source");
        if (cJSON_AddItemToObject(around, "source", node))
            return GROOM_OK;
    }
    cJSON_Delete(node);
    return status;
}

/* A fit's document brings its quality report along; nobody else's word on it counts. */
static groom_status take_quality(cJSON *tree, const struct grooms_source *source, struct grooms_kept *kept)
{
    cJSON *quality = cJSON_DetachItemFromObjectCaseSensitive(tree, "quality");
    groom_status status = GROOM_OK;
    if (source && source->strands && cJSON_IsObject(quality) &&
        (!(kept->quality = cJSON_PrintUnformatted(quality)) || !(kept->target = strdup(source->strands))))
        status = GROOM_ENOMEM;
    cJSON_Delete(quality);
    return status;
}

/* The members around the model: what the document had, with its new identity. */
static groom_status make_around(const char *document, size_t n_bytes, const char *groom_id,
                                const struct grooms_source *source, struct grooms_kept *kept, char **around,
                                struct groom_diag *diag)
{
    cJSON *tree;
    groom_status status = documents_parse(document, n_bytes, &tree, diag);
    if (status != GROOM_OK)
        return status;
    documents_strip_model(tree);
    if ((status = take_quality(tree, source, kept)) == GROOM_OK &&
        (status = documents_set_string(tree, "id", groom_id)) == GROOM_OK &&
        (status = documents_set_number(tree, "revision", 1)) == GROOM_OK)
        status = documents_set_string(tree, "parent", NULL);
    if (status == GROOM_OK && source)
        status = set_source(tree, source);
    if (status == GROOM_OK && !(*around = cJSON_PrintUnformatted(tree)))
        status = GROOM_ENOMEM;
    cJSON_Delete(tree);
    return status == GROOM_OK ? GROOM_OK : groom_fail(diag, status, "no memory for the groom document");
}

static groom_status write_kept(const struct groom *groom, const char *around, struct grooms_kept *kept,
                               struct groom_diag *diag)
{
    struct groom_array_keeper keeper = arrays_keeper(&kept->arrays);
    size_t n_bytes;
    groom_status status = groom_document_write(groom, around, &keeper, &kept->document, &n_bytes, diag);
    if (status == GROOM_OK && !(kept->name = strdup(groom->name)))
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for the groom's name");
    return status;
}

groom_status prepare_groom(struct grooms *grooms, const struct groom *groom, const char *document, size_t n_bytes,
                           const struct grooms_source *source, struct grooms_prepared *out, struct groom_diag *diag)
{
    struct grooms_prepared prepared = {0};
    char *around = NULL;
    groom_status status;
    prepared.kept = calloc(1, sizeof *prepared.kept);
    if (!prepared.kept)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom");
    arrays_init(&prepared.kept->arrays, grooms->options.store);

    if ((status = store_make_id("grm_", prepared.groom_id)) != GROOM_OK ||
        (status = make_around(document, n_bytes, prepared.groom_id, source, prepared.kept, &around, diag)) != GROOM_OK ||
        (status = write_kept(groom, around, prepared.kept, diag)) != GROOM_OK ||
        (status = arrays_list(&prepared.kept->arrays, &prepared.kept->list, &prepared.revision.n_arrays)) != GROOM_OK)
        goto out;
    prepared.revision.note = source && source->note ? source->note : "import";
    *out = prepared;
    out->revision.groom_id = out->groom_id;
    out->revision.name = out->kept->name;
    out->revision.document = out->kept->document;
    out->revision.arrays = out->kept->list;
    out->revision.compared_with = out->kept->target;
    out->revision.quality = out->kept->quality;
    prepared.kept = NULL;
out:
    grooms_prepared_finish(&prepared);
    free(around);
    return status;
}

groom_status grooms_prepare(struct grooms *grooms, const char *document, size_t n_bytes,
                            const struct grooms_source *source, struct grooms_prepared *prepared,
                            struct groom_diag *diag)
{
    struct groom *groom = NULL;
    groom_status status = groom_document_read(document, n_bytes, NULL, &grooms->context, &groom, diag);
    if (status == GROOM_OK)
        status = prepare_groom(grooms, groom, document, n_bytes, source, prepared, diag);
    groom_destroy(groom);
    return status;
}

void grooms_prepared_finish(struct grooms_prepared *prepared)
{
    if (prepared->kept) {
        arrays_finish(&prepared->kept->arrays);
        free(prepared->kept->list);
        free(prepared->kept->document);
        free(prepared->kept->name);
        free(prepared->kept->target);
        free(prepared->kept->quality);
        free(prepared->kept);
    }
    *prepared = (struct grooms_prepared){0};
}

groom_status grooms_import(struct grooms *grooms, const char *project, const char *document, size_t n_bytes,
                           char groom_id[STORE_ID_SIZE], struct groom_diag *diag)
{
    struct grooms_prepared prepared;
    groom_status status = grooms_prepare(grooms, document, n_bytes, NULL, &prepared, diag);
    if (status != GROOM_OK)
        return status;
    prepared.revision.project = project;
    status = store_groom_create(grooms->options.store, &prepared.revision, diag);
    if (status == GROOM_OK)
        memcpy(groom_id, prepared.groom_id, STORE_ID_SIZE);
    grooms_prepared_finish(&prepared);
    return status;
}
