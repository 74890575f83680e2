/* Decoded models, least recently used out first. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"

struct models {
    pthread_mutex_t lock;
    struct model *first;
    size_t n_bytes, max_bytes;
    uint64_t clock;
};

groom_status models_create(size_t max_bytes, struct models **out)
{
    struct models *models = calloc(1, sizeof *models);
    if (!models)
        return GROOM_ENOMEM;
    models->max_bytes = max_bytes;
    pthread_mutex_init(&models->lock, NULL);
    *out = models;
    return GROOM_OK;
}

static void free_model(struct model *model)
{
    if (model) {
        groom_destroy(model->groom);
        free(model->keys);
    }
    free(model);
}

void models_destroy(struct models *models)
{
    if (!models)
        return;
    for (struct model *model = models->first, *next; model; model = next) {
        next = model->next;
        free_model(model);
    }
    pthread_mutex_destroy(&models->lock);
    free(models);
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

/* --- with the lock held ------------------------------------------------------------------ */

static struct model *find(struct models *models, const char *groom_id, uint32_t revision)
{
    for (struct model *model = models->first; model; model = model->next)
        if (model->revision == revision && strcmp(model->groom_id, groom_id) == 0)
            return model;
    return NULL;
}

static void use(struct models *models, struct model *model)
{
    model->n_users++;
    model->last_used = ++models->clock;
}

/* The link to the model that has not been used for longest and is not in use, or NULL. */
static struct model **oldest(struct models *models)
{
    struct model **found = NULL;
    for (struct model **link = &models->first; *link; link = &(*link)->next)
        if ((*link)->n_users == 0 && (!found || (*link)->last_used < (*found)->last_used))
            found = link;
    return found;
}

static void make_room(struct models *models)
{
    struct model **link;
    while (models->n_bytes > models->max_bytes && (link = oldest(models)) != NULL) {
        struct model *model = *link;
        *link = model->next;
        models->n_bytes -= model->n_bytes;
        free_model(model);
    }
}

static void insert(struct models *models, struct model *model)
{
    model->next = models->first;
    models->first = model;
    models->n_bytes += model->n_bytes;
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
    model->n_bytes = size_of(model->groom);
    note_head(model, document);
    *out = model;
    model = NULL;
out:
    cJSON_Delete(document);
    store_revision_finish(&revision);
    free_model(model);
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
    struct models *models = grooms->models;
    struct model *loaded = NULL;
    groom_status status = resolve(grooms, groom_id, &number, diag);
    if (status != GROOM_OK)
        return status;

    pthread_mutex_lock(&models->lock);
    struct model *model = find(models, groom_id, number);
    if (model)
        use(models, model);
    pthread_mutex_unlock(&models->lock);
    if (model) {
        *out = model;
        return GROOM_OK;
    }

    /* Decoded without the lock; should another thread have been faster, its model is taken. */
    if ((status = load(grooms, groom_id, number, &loaded, diag)) != GROOM_OK)
        return status;
    pthread_mutex_lock(&models->lock);
    model = find(models, groom_id, number);
    if (!model) {
        insert(models, model = loaded);
        loaded = NULL;
    }
    use(models, model);
    make_room(models);
    pthread_mutex_unlock(&models->lock);
    free_model(loaded);
    *out = model;
    return GROOM_OK;
}

void models_release(struct grooms *grooms, struct model *model)
{
    if (!model)
        return;
    pthread_mutex_lock(&grooms->models->lock);
    model->n_users--;
    make_room(grooms->models);
    pthread_mutex_unlock(&grooms->models->lock);
}
