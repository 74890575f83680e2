/* Decoded models. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"

/* Edits and exports come back to the grooms of this hour; more would be searched in vain. */
#define MOST_MODELS 64

static struct model *model_of(struct cache_entry *entry) { return (struct model *)entry; }

static void free_model(struct cache_entry *entry)
{
    if (entry) {
        groom_destroy(model_of(entry)->groom);
        free(model_of(entry)->keys);
    }
    free(entry);
}

groom_status models_create(size_t max_bytes, struct cache **models)
{
    return cache_create(max_bytes, MOST_MODELS, free_model, models);
}

static size_t size_of(const struct groom *groom)
{
    size_t n = groom->n_strands, points = (size_t)groom->n_guides * groom->n_vertices;
    size_t bytes = n * (20 + 8 * (size_t)groom->n_instancing + 4 * (size_t)groom->n_operators) + points * 12;
    for (uint32_t i = 0; i < groom->n_operators; i++) {
        const struct groom_layer *layer = groom->operators[i].layer;
        if (layer)
            bytes += 20 * ((size_t)layer->anchors.n + layer->contact.n) + (layer->target ? layer->target->n_vertices * 12 : 0);
    }
    return bytes + (size_t)groom->n_base * 12;
}

/* --- reading one from the store ------------------------------------------------------------ */

static void note_head(struct model *model, const cJSON *document)
{
    const cJSON *source = cJSON_GetObjectItemCaseSensitive(document, "source");
    const char *head = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(source, "head"));
    if (head && strlen(head) < sizeof model->head)
        memcpy(model->head, head, strlen(head) + 1);
}

static groom_status decode(struct grooms *grooms, const struct store_revision *revision, const cJSON *document,
                           struct groom **groom, struct groom_diag *diag)
{
    struct arrays arrays;
    arrays_init(&arrays, grooms->options.store);
    struct groom_array_finder finder = arrays_finder(&arrays);
    groom_status status = arrays_allow(&arrays, document);
    if (status == GROOM_OK)
        status = groom_document_read(revision->document, strlen(revision->document), &finder, &grooms->context,
                                     groom, diag);
    arrays_finish(&arrays);
    return status;
}

static groom_status load(struct grooms *grooms, const char *groom_id, uint32_t number, struct model **out,
                         struct groom_diag *diag)
{
    struct store_revision revision = {0};
    cJSON *document = NULL;
    struct model *model = calloc(1, sizeof *model);
    if (!model)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom");
    groom_status status = documents_load(grooms, groom_id, number, &revision, &document, diag);
    if (status == GROOM_OK)
        status = decode(grooms, &revision, document, &model->groom, diag);
    if (status == GROOM_OK && evaluate_keys(document, &model->keys) != GROOM_OK)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a groom");
    if (status != GROOM_OK)
        goto out;
    memcpy(model->groom_id, revision.groom_id, sizeof model->groom_id);
    model->revision = revision.number;
    model->entry.n_bytes = sizeof *model + size_of(model->groom);
    note_head(model, document);
    *out = model;
    model = NULL;
out:
    cJSON_Delete(document);
    store_revision_finish(&revision);
    free_model((struct cache_entry *)model);
    return status;
}

/* --- what others call ---------------------------------------------------------------------- */

/* The number behind "the latest" is the store's to say. */
static groom_status resolve(struct grooms *grooms, const char *groom_id, uint32_t *number, struct groom_diag *diag)
{
    struct store_revision_list list = {0};
    if (*number)
        return GROOM_OK;
    groom_status status =
        store_revisions_list(grooms->options.store, groom_id, (struct store_page){.limit = 1}, &list, diag);
    if (status == GROOM_OK && list.n > 0)
        *number = list.items[0].number;
    store_revision_list_finish(&list);
    return status;
}

groom_status models_acquire(struct grooms *grooms, const char *groom_id, uint32_t number, struct model **out,
                            struct groom_diag *diag)
{
    char key[CACHE_KEY_SIZE];
    struct model *loaded = NULL;
    groom_status status = resolve(grooms, groom_id, &number, diag);
    if (status != GROOM_OK)
        return status;
    snprintf(key, sizeof key, "%s/%u", groom_id, number);
    if ((*out = model_of(cache_get(grooms->models, key))) != NULL)
        return GROOM_OK;
    if ((status = load(grooms, groom_id, number, &loaded, diag)) != GROOM_OK)
        return status;
    memcpy(loaded->entry.key, key, sizeof key);
    *out = model_of(cache_keep(grooms->models, &loaded->entry));
    return GROOM_OK;
}

void models_release(struct grooms *grooms, struct model *model) { cache_put_back(grooms->models, (struct cache_entry *)model); }
