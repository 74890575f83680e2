#include "server/jobs/inputs.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "server/jobs/queue.h"

void inputs_add_path(struct jobs *jobs, cJSON *object, const char *sha256)
{
    char path[1024];
    if (!jobs->shared_blobs[0])
        return;
    snprintf(path, sizeof path, "%.900s/%.2s/%s", jobs->shared_blobs, sha256, sha256);
    cJSON_AddStringToObject(object, "path", path);
}

static cJSON *describe(struct jobs *jobs, const struct store_asset *asset)
{
    char up[2] = {asset->up, 0};
    cJSON *input = cJSON_CreateObject();
    cJSON_AddStringToObject(input, "id", asset->id);
    cJSON_AddStringToObject(input, "sha256", asset->sha256);
    cJSON_AddNumberToObject(input, "bytes", (double)asset->n_bytes);
    cJSON_AddStringToObject(input, "format", asset->format);
    cJSON_AddNumberToObject(input, "unit_m", asset->unit_m);
    cJSON_AddStringToObject(input, "up", up);
    cJSON_AddStringToObject(input, "name", asset->name);
    inputs_add_path(jobs, input, asset->sha256);
    return input;
}

/* Called with each upload; `name` is where it stands in the order, "targets" for each of them in turn. */
typedef void (*visitor)(struct jobs *jobs, const char *name, const struct store_asset *asset, void *user);

static groom_status visit(struct jobs *jobs, const cJSON *object, const char *member, const char *name,
                          enum store_asset_kind kind, visitor each, void *user, struct groom_diag *diag)
{
    struct store_asset asset = {0};
    const char *id = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, member));
    if (!id)
        return GROOM_OK;
    groom_status status = store_asset_get(jobs->store, NULL, kind, id, &asset, diag);
    if (status == GROOM_OK)
        each(jobs, name, &asset, user);
    store_asset_finish(&asset);
    return status;
}

static groom_status visit_all(struct jobs *jobs, const cJSON *request, visitor each, void *user, struct groom_diag *diag)
{
    const cJSON *target, *targets = cJSON_GetObjectItemCaseSensitive(request, "targets");
    const cJSON *source = cJSON_GetObjectItemCaseSensitive(request, "source");
    groom_status status = visit(jobs, request, "strands", "strands", STORE_STRANDS, each, user, diag);
    if (status == GROOM_OK)
        status = visit(jobs, request, "head", "head", STORE_HEAD, each, user, diag);
    if (status == GROOM_OK)
        status = visit(jobs, source, "head", "source", STORE_HEAD, each, user, diag);
    cJSON_ArrayForEach(target, targets)
    {
        if (status == GROOM_OK)
            status = visit(jobs, target, "head", "targets", STORE_HEAD, each, user, diag);
    }
    return status;
}

static void add(struct jobs *jobs, const char *name, const struct store_asset *asset, void *user)
{
    cJSON *object = user, *list;
    if (strcmp(name, "targets") != 0) {
        cJSON_AddItemToObject(object, name, describe(jobs, asset));
        return;
    }
    if (!(list = cJSON_GetObjectItemCaseSensitive(object, name)))
        list = cJSON_AddArrayToObject(object, name);
    cJSON_AddItemToArray(list, describe(jobs, asset));
}

groom_status inputs_describe(struct jobs *jobs, const cJSON *request, cJSON *object, struct groom_diag *diag)
{
    return visit_all(jobs, request, add, object, diag);
}

struct search {
    const char *sha256;
    bool *have;
};

static void compare(struct jobs *jobs, const char *name, const struct store_asset *asset, void *user)
{
    const struct search *search = user;
    *search->have |= strcmp(asset->sha256, search->sha256) == 0;
}

groom_status inputs_have(struct jobs *jobs, const cJSON *request, const char *sha256, bool *have, struct groom_diag *diag)
{
    struct search search = {sha256, have};
    return visit_all(jobs, request, compare, &search, diag);
}
