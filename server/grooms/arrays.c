/* The arrays that one document may refer to. A document has a few dozen, so a list will do. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"
#include "server/jobs/work.h"

void arrays_init(struct arrays *arrays, struct store *store) { *arrays = (struct arrays){.store = store}; }

void arrays_finish(struct arrays *arrays)
{
    for (size_t i = 0; i < arrays->n; i++)
        free(arrays->items[i].bytes);
    free(arrays->items);
    *arrays = (struct arrays){0};
}

static struct arrays_item *find_item(const struct arrays *arrays, const char *sha256)
{
    for (size_t i = 0; i < arrays->n; i++)
        if (strcmp(arrays->items[i].sha256, sha256) == 0)
            return &arrays->items[i];
    return NULL;
}

static struct arrays_item *add_item(struct arrays *arrays, const char *sha256)
{
    struct arrays_item *items = realloc(arrays->items, (arrays->n + 1) * sizeof *items);
    if (!items)
        return NULL;
    arrays->items = items;
    struct arrays_item *item = &items[arrays->n++];
    *item = (struct arrays_item){0};
    memcpy(item->sha256, sha256, STORE_HASH_SIZE);
    return item;
}

static groom_status allow(struct arrays *arrays, const char *reference)
{
    char sha256[STORE_HASH_SIZE] = {0};
    if (strlen(reference) != STORE_HASH_SIZE - 1 || find_item(arrays, reference))
        return GROOM_OK;
    memcpy(sha256, reference, STORE_HASH_SIZE - 1);
    struct arrays_item *item = add_item(arrays, sha256);
    if (!item)
        return GROOM_ENOMEM;
    item->stored = true;
    return GROOM_OK;
}

groom_status arrays_allow(struct arrays *arrays, const cJSON *document)
{
    const cJSON *child;
    if (cJSON_IsString(document) && document->string && strcmp(document->string, "$array") == 0)
        return allow(arrays, document->valuestring);
    cJSON_ArrayForEach(child, document)
    {
        groom_status status = arrays_allow(arrays, child);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

void arrays_use(struct arrays *arrays, const cJSON *document)
{
    const cJSON *child;
    struct arrays_item *item;
    if (cJSON_IsString(document) && document->string && strcmp(document->string, "$array") == 0 &&
        (item = find_item(arrays, document->valuestring)) != NULL)
        item->used = true;
    cJSON_ArrayForEach(child, document)
    {
        arrays_use(arrays, child);
    }
}

static groom_status find(void *user, const char *reference, const void **bytes, size_t *n_bytes)
{
    struct arrays *arrays = user;
    struct arrays_item *item = find_item(arrays, reference);
    if (!item)
        return GROOM_ENOTFOUND;
    if (!item->bytes) {
        groom_status status = store_array_get(arrays->store, item->sha256, &item->bytes, &item->n_bytes, NULL);
        if (status != GROOM_OK) /* a document never names what is missing: the database is damaged */
            return status == GROOM_ENOTFOUND ? GROOM_EINTERNAL : status;
    }
    *bytes = item->bytes;
    *n_bytes = item->n_bytes;
    return GROOM_OK;
}

static groom_status keep(void *user, const void *bytes, size_t n_bytes, char reference[GROOM_ARRAY_REFERENCE_SIZE])
{
    struct arrays *arrays = user;
    char sha256[STORE_HASH_SIZE];
    work_hash(bytes, n_bytes, sha256);
    struct arrays_item *item = find_item(arrays, sha256);
    if (!item) {
        item = add_item(arrays, sha256);
        if (!item || !(item->bytes = malloc(n_bytes ? n_bytes : 1)))
            return GROOM_ENOMEM;
        memcpy(item->bytes, bytes, n_bytes);
        item->n_bytes = n_bytes;
    }
    item->used = true;
    memcpy(reference, sha256, sizeof sha256);
    return GROOM_OK;
}

struct groom_array_finder arrays_finder(struct arrays *arrays)
{
    return (struct groom_array_finder){find, arrays};
}

struct groom_array_keeper arrays_keeper(struct arrays *arrays)
{
    return (struct groom_array_keeper){keep, arrays};
}

groom_status arrays_list(const struct arrays *arrays, struct store_array **list, size_t *n)
{
    struct store_array *out = calloc(arrays->n ? arrays->n : 1, sizeof *out);
    size_t n_out = 0;
    if (!out)
        return GROOM_ENOMEM;
    for (size_t i = 0; i < arrays->n; i++) {
        const struct arrays_item *item = &arrays->items[i];
        if (!item->used)
            continue;
        memcpy(out[n_out].sha256, item->sha256, STORE_HASH_SIZE);
        if (!item->stored) {
            out[n_out].bytes = item->bytes;
            out[n_out].n_bytes = item->n_bytes;
        }
        n_out++;
    }
    *list = out;
    *n = n_out;
    return GROOM_OK;
}
