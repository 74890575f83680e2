#include "server/grooms/hairline.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include "server/grooms/room.h"
#include "server/grooms/tool.h"

static const cJSON *member(const cJSON *object, const char *name) { return cJSON_GetObjectItemCaseSensitive(object, name); }

/* --head's three arguments under these names. */
static groom_status add_head(struct grooms *grooms, const struct grooms_hairline_wish *wish, const char *id,
                             const char *const names[3], struct tool_arguments *arguments, struct groom_diag *diag)
{
    struct store_asset head = {0};
    char path[4096];
    groom_status status = store_asset_get(grooms->options.store, wish->project, STORE_HEAD, id, &head, diag);
    if (status == GROOM_OK)
        status = blobs_path(grooms->options.blobs, head.sha256, path, sizeof path);
    if (status == GROOM_OK) {
        tool_add(arguments, names[0], "%s", path);
        tool_add(arguments, names[1], "%.17g", head.unit_m);
        tool_add(arguments, names[2], "%c", head.up);
    }
    store_asset_finish(&head);
    return status;
}

static groom_status open_upload(struct grooms *grooms, const char *id, const char *project, struct tool_arguments *arguments,
                                int *fd, struct groom_diag *diag)
{
    struct store_asset asset = {0};
    uint64_t n_bytes;
    groom_status status = store_asset_get(grooms->options.store, project, STORE_STRANDS, id, &asset, diag);
    if (status == GROOM_OK)
        status = blobs_read(grooms->options.blobs, asset.sha256, fd, &n_bytes, diag);
    if (status == GROOM_OK) {
        tool_add(arguments, "--format", "%s", asset.format);
        tool_add(arguments, "--unit", "%.17g", asset.unit_m);
        tool_add(arguments, "--up", "%c", asset.up);
    }
    store_asset_finish(&asset);
    return status;
}

static groom_status open_strands(struct grooms *grooms, const struct grooms_hairline_wish *wish,
                                 struct tool_arguments *arguments, int *fd, struct groom_diag *diag)
{
    const char *strands = cJSON_GetStringValue(member(wish->inputs, "strands"));
    const char *groom = cJSON_GetStringValue(member(wish->inputs, "groom"));
    const cJSON *revision = member(wish->inputs, "revision");
    if (strands)
        return open_upload(grooms, strands, wish->project, arguments, fd, diag);
    return tool_strands_file(grooms, groom, cJSON_IsNumber(revision) ? (uint32_t)revision->valuedouble : 0, false, fd, diag);
}

/* Skeletons and landmarks, as they were asked for. */
static groom_status add_asked(const struct grooms_hairline_wish *wish, struct tool_arguments *arguments)
{
    cJSON *asked = cJSON_CreateObject();
    cJSON_AddItemReferenceToObject(asked, "source", (cJSON *)member(wish->inputs, "source"));
    cJSON_AddItemReferenceToObject(asked, "target", cJSON_GetArrayItem(member(wish->inputs, "targets"), 0));
    char *text = cJSON_PrintUnformatted(asked);
    cJSON_Delete(asked);
    if (!text)
        return GROOM_ENOMEM;
    tool_add(arguments, "--asked", "%s", text);
    cJSON_free(text);
    return GROOM_OK;
}

groom_status grooms_hairline(struct grooms *grooms, const struct grooms_hairline_wish *wish, char **json, size_t *n_bytes,
                             struct groom_diag *diag)
{
    static const char *const of_source[3] = {"--source", "--source-unit", "--source-up"};
    static const char *const of_target[3] = {"--target", "--target-unit", "--target-up"};
    const char *source = cJSON_GetStringValue(member(member(wish->inputs, "source"), "head"));
    struct tool_arguments arguments;
    int fd = -1;
    tool_arguments_init(&arguments, grooms, "hairline");
    tool_add(&arguments, "--points", "%u", wish->points);
    groom_status status = add_head(grooms, wish, source, of_source, &arguments, diag);
    if (status == GROOM_OK)
        status = add_head(grooms, wish, wish->target, of_target, &arguments, diag);
    if (status == GROOM_OK)
        status = add_asked(wish, &arguments);
    if (status == GROOM_OK)
        status = open_strands(grooms, wish, &arguments, &fd, diag);
    if (status == GROOM_OK)
        status = tool_output(&arguments, fd, "the hairline could not be found", json, n_bytes, diag);
    if (fd >= 0)
        close(fd);
    return status;
}
