/* How alike a groom and its target are. The daemon evaluates grooms; `groom-worker compare` and `render`
 * read what was uploaded. */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/grooms/tool.h"

/* --- who is meant ------------------------------------------------------------------------------ */

/* Strands that are compared: of a revision, or uploaded. */
struct side {
    char id[STORE_ID_SIZE];
    bool is_groom;
    uint32_t revision;          /* 0 for uploaded strands */
    char source[STORE_ID_SIZE]; /* of a groom: the strands and the head that it was fitted to, or "" */
    char head[STORE_ID_SIZE];
    struct store_asset asset;   /* of uploaded strands */
    int fd;                     /* its file, once it is open; -1 */
};

static void side_finish(struct side *side)
{
    store_asset_finish(&side->asset);
    if (side->fd >= 0)
        close(side->fd);
}

static void copy_id(const cJSON *object, const char *name, char id[STORE_ID_SIZE])
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    if (text && strlen(text) < STORE_ID_SIZE)
        memcpy(id, text, strlen(text) + 1);
}

static groom_status settle_groom(struct grooms *grooms, struct side *side, struct groom_diag *diag)
{
    struct store_revision revision = {0};
    cJSON *document = NULL;
    groom_status status = documents_load(grooms, side->id, side->revision, &revision, &document, diag);
    if (status != GROOM_OK)
        return status;
    const cJSON *source = cJSON_GetObjectItemCaseSensitive(document, "source");
    side->revision = revision.number;
    copy_id(source, "strands", side->source);
    copy_id(source, "head", side->head);
    if (!side->source[0]) /* strands that were edited without a fit */
        copy_id(cJSON_GetObjectItemCaseSensitive(document, "base"), "strands", side->source);
    cJSON_Delete(document);
    store_revision_finish(&revision);
    return GROOM_OK;
}

static groom_status settle(struct grooms *grooms, const char *id, uint32_t revision, struct side *side,
                           struct groom_diag *diag)
{
    if (strlen(id) >= STORE_ID_SIZE)
        return groom_fail(diag, GROOM_ENOTFOUND, "there is nothing with the id %.60s", id);
    memcpy(side->id, id, strlen(id) + 1);
    side->is_groom = strncmp(id, "str_", 4) != 0;
    side->revision = side->is_groom ? revision : 0;
    return side->is_groom ? settle_groom(grooms, side, diag)
                          : store_asset_get(grooms->options.store, NULL, STORE_STRANDS, id, &side->asset, diag);
}

struct pair { struct side subject, target; };

static void pair_finish(struct pair *pair)
{
    side_finish(&pair->subject);
    side_finish(&pair->target);
}

/* Both are there, and not in one project. */
static bool is_foreign(struct grooms *grooms, const char *id, const char *other)
{
    char project[STORE_PROJECT_SIZE], others[STORE_PROJECT_SIZE];
    struct store *store = grooms->options.store;
    return store_project_of(store, id, project, NULL) == GROOM_OK &&
           store_project_of(store, other, others, NULL) == GROOM_OK && strcmp(project, others) != 0;
}

/* Finish it in any case. */
static groom_status pair_settle(struct grooms *grooms, const struct grooms_comparison *what, struct pair *pair,
                                struct groom_diag *diag)
{
    *pair = (struct pair){.subject = {.fd = -1}, .target = {.fd = -1}};
    groom_status status = settle(grooms, what->id, what->revision, &pair->subject, diag);
    if (status != GROOM_OK)
        return status;
    const char *with = what->with ? what->with : pair->subject.source;
    if (!*with)
        return groom_fail(diag, GROOM_ENOTFOUND,
                          "%.40s was not fitted to strands of this server: name some to compare it with (?with=str_…)",
                          what->id);
    status = is_foreign(grooms, pair->subject.id, with)
                 ? groom_fail(diag, GROOM_ENOTFOUND, "there is no %.40s", with)
                 : settle(grooms, with, 0, &pair->target, diag);
    if (status == GROOM_ENOTFOUND && !what->with)
        return groom_fail(diag, GROOM_ENOTFOUND,
                          "the strands that %.40s was fitted to, %.40s, are not on this server: upload them, or name "
                          "others (?with=str_…)", what->id, with);
    return status;
}

/* --- files ---------------------------------------------------------------------------------------- */

static groom_status open_side(struct grooms *grooms, struct side *side, bool drawn, struct groom_diag *diag)
{
    char path[4096];
    if (side->is_groom)
        return tool_strands_file(grooms, side->id, side->revision, drawn, &side->fd, diag);
    groom_status status = blobs_path(grooms->options.blobs, side->asset.sha256, path, sizeof path);
    if (status == GROOM_OK && (side->fd = open(path, O_RDONLY | O_CLOEXEC)) < 0)
        status = GROOM_EIO;
    return status == GROOM_OK ? GROOM_OK : groom_fail(diag, status, "the bytes of %s cannot be opened", side->id);
}

/* A file without a name as the child can open it; it does so before it gives up its rights. */
static void add_file(struct tool_arguments *arguments, const char *name, int fd)
{
    tool_add(arguments, name, "/proc/%d/fd/%d", (int)getpid(), fd);
}

/* How a file is to be read; a groom's is in metres, y up. */
static void add_frame(struct tool_arguments *arguments, const struct side *side, const char *const names[3])
{
    if (side->is_groom)
        return;
    tool_add(arguments, names[0], "%s", side->asset.format);
    tool_add(arguments, names[1], "%.17g", side->asset.unit_m);
    tool_add(arguments, names[2], "%c", side->asset.up);
}

static const char *const own_frame[3] = {"--format", "--unit", "--up"};

/* --- reports ---------------------------------------------------------------------------------------- */

static groom_status compare(struct grooms *grooms, struct pair *pair, char **report, struct groom_diag *diag)
{
    static const char *const target_frame[3] = {"--target-format", "--target-unit", "--target-up"};
    struct tool_arguments arguments;
    struct side drawn = {.fd = -1};
    size_t n_bytes;
    groom_status status;
    memcpy(drawn.id, pair->subject.id, sizeof drawn.id);
    drawn.is_groom = true;
    drawn.revision = pair->subject.revision;
    tool_arguments_init(&arguments, grooms, "compare");
    if ((status = open_side(grooms, &pair->subject, false, diag)) != GROOM_OK ||
        (status = open_side(grooms, &pair->target, false, diag)) != GROOM_OK)
        goto out;
    /* a groom with layers has been edited since it was fitted: it has no such strands */
    if (pair->subject.is_groom && (status = open_side(grooms, &drawn, true, diag)) != GROOM_OK && status != GROOM_EINVAL)
        goto out;
    add_file(&arguments, "--target", pair->target.fd);
    add_frame(&arguments, &pair->target, target_frame);
    add_frame(&arguments, &pair->subject, own_frame);
    if (drawn.fd >= 0)
        add_file(&arguments, "--drawn", drawn.fd);
    tool_add_head(&arguments, grooms, pair->subject.id, pair->subject.head[0] ? pair->subject.head : pair->target.head);
    status = tool_output(&arguments, pair->subject.fd, "the strands could not be compared", report, &n_bytes, diag);
out:
    side_finish(&drawn);
    return status;
}

/* From the store, or made and kept. Who waits for another's comparison finds it there. */
static groom_status find_report(struct grooms *grooms, struct pair *pair, char **report, struct groom_diag *diag)
{
    char target[2 * STORE_ID_SIZE];
    struct store_quality key = {pair->subject.id, pair->subject.revision, target};
    if (pair->target.is_groom)
        snprintf(target, sizeof target, "%s/%u", pair->target.id, pair->target.revision);
    else
        snprintf(target, sizeof target, "%s", pair->target.id);
    groom_status status = store_quality_get(grooms->options.store, &key, report, diag);
    if (status != GROOM_ENOTFOUND)
        return status;
    pthread_mutex_lock(&grooms->comparing);
    status = store_quality_get(grooms->options.store, &key, report, diag);
    if (status == GROOM_ENOTFOUND && (status = compare(grooms, pair, report, diag)) == GROOM_OK &&
        (status = store_quality_put(grooms->options.store, &key, *report, diag)) != GROOM_OK) {
        free(*report);
        *report = NULL;
    }
    pthread_mutex_unlock(&grooms->comparing);
    return status;
}

static void add_side(cJSON *json, const char *id_name, const char *revision_name, const struct side *side)
{
    cJSON_AddStringToObject(json, id_name, side->id);
    if (side->is_groom)
        cJSON_AddNumberToObject(json, revision_name, side->revision);
    else
        cJSON_AddNullToObject(json, revision_name);
}

/* Who was compared, before what came out. */
static groom_status print_answer(const struct pair *pair, const char *report, char **json, size_t *n_bytes,
                                 struct groom_diag *diag)
{
    cJSON *names = cJSON_CreateObject();
    add_side(names, "id", "revision", &pair->subject);
    add_side(names, "target", "target_revision", &pair->target);
    char *head = cJSON_PrintUnformatted(names), *text = NULL;
    int n = -1;
    if (head && report[0] == '{')
        n = asprintf(&text, "%.*s,%s", (int)strlen(head) - 1, head, report + 1);
    free(head);
    cJSON_Delete(names);
    if (n < 0)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a quality report");
    *json = text;
    *n_bytes = (size_t)n;
    return GROOM_OK;
}

/* A report outlives the strands that it is about: they may have been removed since. */
static groom_status find_old_report(struct grooms *grooms, const struct pair *pair, char **report)
{
    const struct store_quality key = {pair->subject.id, pair->subject.revision, pair->target.id};
    return store_quality_get(grooms->options.store, &key, report, NULL);
}

groom_status grooms_quality(struct grooms *grooms, const struct grooms_comparison *what, char **json, size_t *n_bytes,
                            struct groom_diag *diag)
{
    struct pair pair;
    char *report = NULL;
    groom_status status = pair_settle(grooms, what, &pair, diag);
    if (status == GROOM_OK)
        status = find_report(grooms, &pair, &report, diag);
    else if (status == GROOM_ENOTFOUND && !what->with && pair.target.id[0] &&
             find_old_report(grooms, &pair, &report) == GROOM_OK)
        status = GROOM_OK;
    if (status == GROOM_OK)
        status = print_answer(&pair, report, json, n_bytes, diag);
    free(report);
    pair_finish(&pair);
    return status;
}

/* --- pictures ------------------------------------------------------------------------------------------ */

groom_status grooms_quality_picture(struct grooms *grooms, const struct grooms_comparison *what, enum grooms_picture of,
                                    groom_view view, uint32_t size, char **png, size_t *n_bytes, struct groom_diag *diag)
{
    static const char *const target_frame[3] = {"--framed-format", "--framed-unit", "--framed-up"};
    struct tool_arguments arguments;
    struct pair pair = {.subject = {.fd = -1}, .target = {.fd = -1}};
    struct side *drawn = of == GROOMS_PICTURE_TARGET ? &pair.target : &pair.subject;
    groom_status status;
    tool_arguments_init(&arguments, grooms, "render");
    if ((status = pair_settle(grooms, what, &pair, diag)) != GROOM_OK ||
        (status = open_side(grooms, &pair.target, false, diag)) != GROOM_OK ||
        (drawn == &pair.subject && (status = open_side(grooms, drawn, of == GROOMS_PICTURE_DRAWN, diag)) != GROOM_OK))
        goto out;
    tool_add(&arguments, "--view", "%s", groom_view_name(view));
    tool_add(&arguments, "--size", "%u", size);
    add_frame(&arguments, drawn, own_frame);
    if (drawn == &pair.subject) {
        add_file(&arguments, "--framed-as", pair.target.fd);
        add_frame(&arguments, &pair.target, target_frame);
    }
    tool_add_head(&arguments, grooms, pair.subject.id, pair.subject.head[0] ? pair.subject.head : pair.target.head);
    status = tool_output(&arguments, drawn->fd, "the picture could not be drawn", png, n_bytes, diag);
out:
    pair_finish(&pair);
    return status;
}
