#include "server/grooms/retargeted.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/format.h"
#include "proto/json_text.h"
#include "server/grooms/room.h"
#include "server/grooms/tool.h"

groom_status grooms_head_of(struct grooms *grooms, const char *groom_id, uint32_t *revision, char head[STORE_ID_SIZE],
                            struct groom_diag *diag)
{
    struct store_revision row = {0};
    cJSON *document = NULL;
    groom_status status = documents_load(grooms, groom_id, *revision, &row, &document, diag);
    if (status != GROOM_OK)
        return status;
    const cJSON *source = cJSON_GetObjectItemCaseSensitive(document, "source");
    const char *id = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(source, "head"));
    snprintf(head, STORE_ID_SIZE, "%s", id ? id : "");
    *revision = row.number;
    cJSON_Delete(document);
    store_revision_finish(&row);
    return GROOM_OK;
}

/* --- one target ------------------------------------------------------------------------------ */

/* One part of what the worker hands in: a line, and the bytes that it announces. */
struct part {
    cJSON *line;
    const char *bytes;
    size_t n_bytes;
    bool strands; /* HAIR; else a groom document */
    const char *head;
    char name[128];
};

static const cJSON *member(const cJSON *object, const char *name) { return cJSON_GetObjectItemCaseSensitive(object, name); }

static groom_status read_part(const char **at, const char *end, struct part *part, struct groom_diag *diag)
{
    const char *newline = memchr(*at, '\n', (size_t)(end - *at));
    part->line = newline ? json_text_parse(*at, (size_t)(newline - *at), NULL) : NULL;
    const cJSON *n = member(part->line, "bytes"), *kind = member(part->line, "kind");
    if (!cJSON_IsNumber(n) || n->valuedouble < 1 || n->valuedouble > (double)(end - newline - 1) || !cJSON_IsString(kind))
        return groom_fail(diag, GROOM_EINVAL, "a retargeting hands in lines of JSON, each with the bytes that it announces");
    part->bytes = newline + 1;
    part->n_bytes = (size_t)n->valuedouble;
    part->strands = strcmp(kind->valuestring, "strands") == 0;
    *at = part->bytes + part->n_bytes;
    return GROOM_OK;
}

/* Of what is carried: the upload's, or the groom's at that revision. malloc'ed. */
static char *name_of_subject(struct store *store, const cJSON *request)
{
    struct store_asset asset = {0};
    struct store_revision row = {0};
    const char *strands = cJSON_GetStringValue(member(request, "strands")), *groom = cJSON_GetStringValue(member(request, "groom"));
    const cJSON *revision = member(request, "revision");
    char *name = NULL;
    if (strands && store_asset_get(store, NULL, STORE_STRANDS, strands, &asset, NULL) == GROOM_OK)
        name = strdup(asset.name);
    else if (groom && store_revision_get(store, groom, cJSON_IsNumber(revision) ? (uint32_t)revision->valuedouble : 0, &row, NULL) ==
                          GROOM_OK)
        name = strdup(row.name);
    store_asset_finish(&asset);
    store_revision_finish(&row);
    return name;
}

/* Cut between two characters of UTF-8. */
static void cut(char *name, size_t size, int length)
{
    size_t n = (size_t)length < size ? (size_t)length : size - 1;
    if ((size_t)length < size)
        return;
    while (n > 0 && ((unsigned char)name[n - 1] & 0xc0) == 0x80)
        n--;
    if (n > 0 && ((unsigned char)name[n - 1] & 0xc0) == 0xc0)
        n--;
    name[n] = 0;
}

/* "bob on mara" */
static void find_name(struct store *store, const cJSON *request, struct part *part)
{
    struct store_asset head = {0};
    char *subject = name_of_subject(store, request);
    if (!part->head || store_asset_get(store, NULL, STORE_HEAD, part->head, &head, NULL) != GROOM_OK)
        head = (struct store_asset){0};
    const char *on = head.name && *head.name ? head.name : NULL;
    cut(part->name, sizeof part->name,
        snprintf(part->name, sizeof part->name, on ? "%s on %s" : "%s", subject ? subject : "", on ? on : ""));
    free(subject);
    store_asset_finish(&head);
}

/* The document's member "retarget": what was carried, from where to where, and what became of it. */
static cJSON *tell(const cJSON *request, size_t target, const struct part *part)
{
    static const char *const of_line[] = {"report", "skeleton", "hairline", "strands"};
    static const char *const of_request[] = {"strands", "groom", "revision", "dense"};
    cJSON *told = cJSON_CreateObject(), *from = cJSON_AddObjectToObject(told, "from");
    const cJSON *asked = cJSON_GetArrayItem(member(request, "targets"), (int)target), *item;
    for (size_t i = 0; i < sizeof of_request / sizeof of_request[0]; i++)
        if ((item = member(request, of_request[i])))
            cJSON_AddItemToObject(from, of_request[i], cJSON_Duplicate(item, true));
    cJSON_AddItemToObject(from, "head", cJSON_Duplicate(member(member(request, "source"), "head"), true));
    cJSON_AddItemToObject(from, "skeleton", cJSON_Duplicate(member(part->line, "source_skeleton"), true));
    if ((item = member(asked, "hairline")))
        cJSON_AddItemToObject(told, "edit", cJSON_Duplicate(item, true));
    for (size_t i = 0; i < sizeof of_line / sizeof of_line[0]; i++)
        if ((item = member(part->line, of_line[i])))
            cJSON_AddItemToObject(told, of_line[i], cJSON_Duplicate(item, true));
    /* how long it took is the job's: the same work makes the same document */
    cJSON_DeleteItemFromObjectCaseSensitive(cJSON_GetObjectItemCaseSensitive(told, "report"), "seconds");
    return told;
}

static groom_status print_around(const cJSON *request, size_t target, const struct part *part, char **text)
{
    cJSON *around = cJSON_CreateObject();
    cJSON_AddItemToObject(around, "retarget", tell(request, target, part));
    *text = cJSON_PrintUnformatted(around);
    cJSON_Delete(around);
    return *text ? GROOM_OK : GROOM_ENOMEM;
}

/* --- strands: an upload, and a groom that stands on it ------------------------------------------ */

static groom_status keep_bytes(struct blobs *blobs, const struct part *part, char sha256[BLOBS_HASH_SIZE],
                               struct groom_diag *diag)
{
    struct blobs_writer *writer;
    groom_status status = blobs_begin(blobs, part->n_bytes, &writer, diag);
    if (status != GROOM_OK)
        return status;
    if ((status = blobs_write(writer, part->bytes, part->n_bytes, diag)) != GROOM_OK) {
        blobs_abort(writer);
        return status;
    }
    return blobs_commit(writer, NULL, sha256, diag);
}

/* As an upload is looked at. */
static groom_status inspect(struct grooms *grooms, const char *sha256, char **metadata, struct groom_diag *diag)
{
    struct tool_arguments arguments;
    int fd;
    uint64_t n;
    size_t n_output;
    groom_status status = blobs_read(grooms->options.blobs, sha256, &fd, &n, diag);
    if (status != GROOM_OK)
        return status;
    tool_arguments_init(&arguments, grooms, "inspect");
    tool_add(&arguments, "--kind", "strands");
    tool_add(&arguments, "--format", "hair");
    status = tool_output(&arguments, fd, "the strands could not be looked at", metadata, &n_output, diag);
    close(fd);
    return status;
}

static groom_status add_asset(struct grooms *grooms, const struct store_job *job, const struct part *part,
                              struct grooms_retargeted *made, struct groom_diag *diag)
{
    struct store_asset asset = {.kind = STORE_STRANDS, .n_bytes = part->n_bytes, .unit_m = 1, .up = 'y'};
    groom_status status = keep_bytes(grooms->options.blobs, part, asset.sha256, diag);
    if (status != GROOM_OK)
        return status;
    memcpy(asset.project, job->project, sizeof asset.project);
    memcpy(asset.owner, job->owner, sizeof asset.owner);
    store_asset_id(job->project, STORE_STRANDS, asset.sha256, "hair", 1, 'y', asset.id);
    asset.format = strdup("hair");
    asset.name = strdup(part->name);
    status = asset.format && asset.name ? inspect(grooms, asset.sha256, &asset.metadata, diag) : GROOM_ENOMEM;
    made->assets[made->n_assets++] = asset; /* from here on it is unpinned by the end */
    return status;
}

static groom_status read_strands(struct grooms *grooms, const struct part *part, struct groom_strands **strands,
                                 struct groom_diag *diag)
{
    struct groom_memory_source memory;
    struct groom_source source = groom_source_from_memory(&memory, part->bytes, part->n_bytes);
    const struct groom_read_options options = {.format = GROOM_FORMAT_HAIR};
    return groom_strands_read(&source, &options, &grooms->context, strands, NULL, diag);
}

static groom_status prepare_strands(struct grooms *grooms, const struct store_job *job, const struct part *part,
                                    const char *around, struct grooms_retargeted *made, struct groom_diag *diag)
{
    struct groom_strands *strands = NULL;
    struct groom *groom = NULL;
    groom_status status = add_asset(grooms, job, part, made, diag);
    if (status == GROOM_OK)
        status = read_strands(grooms, part, &strands, diag);
    if (status == GROOM_OK)
        status = groom_create_of_strands(strands, &grooms->context, &groom, diag);
    if (status == GROOM_OK) {
        const char *id = made->assets[made->n_assets - 1].id;
        const struct grooms_source source = {.strands = id, .head = part->head, .job = job->id, .note = job->kind};
        snprintf(groom->name, sizeof groom->name, "%s", part->name);
        snprintf(groom->base_strands, sizeof groom->base_strands, "%s", id);
        status = prepare_groom(grooms, groom, around, strlen(around), &source, &made->prepared[made->n], diag);
    }
    groom_destroy(groom);
    groom_strands_destroy(strands);
    return status;
}

/* --- a procedural groom ---------------------------------------------------------------------------- */

static groom_status prepare_document(struct grooms *grooms, const struct store_job *job, const struct part *part,
                                     const char *around, struct grooms_retargeted *made, struct groom_diag *diag)
{
    const struct grooms_source source = {.head = part->head, .job = job->id, .note = job->kind};
    struct groom *groom = NULL;
    groom_status status = groom_document_read(part->bytes, part->n_bytes, NULL, &grooms->context, &groom, diag);
    if (status == GROOM_OK) {
        snprintf(groom->name, sizeof groom->name, "%s", part->name);
        groom->base_strands[0] = 0; /* a base that was carried is nobody's upload any more */
        status = prepare_groom(grooms, groom, around, strlen(around), &source, &made->prepared[made->n], diag);
    }
    groom_destroy(groom);
    return status;
}

/* --- all of them ------------------------------------------------------------------------------------ */

static groom_status take_part(struct grooms *grooms, const struct store_job *job, const cJSON *request, struct part *part,
                              struct grooms_retargeted *made, struct groom_diag *diag)
{
    char *around = NULL;
    part->head = cJSON_GetStringValue(member(cJSON_GetArrayItem(member(request, "targets"), (int)made->n), "head"));
    find_name(grooms->options.store, request, part);
    groom_status status = print_around(request, made->n, part, &around);
    if (status == GROOM_OK)
        status = (part->strands ? prepare_strands : prepare_document)(grooms, job, part, around, made, diag);
    if (status == GROOM_OK) {
        made->grooms[made->n] = made->prepared[made->n].revision;
        made->grooms[made->n].groom_id = made->prepared[made->n].groom_id;
        made->n++;
    }
    cJSON_free(around);
    return status;
}

static void add_result(cJSON *list, const struct part *part, const struct grooms_retargeted *made)
{
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "groom", made->prepared[made->n - 1].groom_id);
    cJSON_AddNumberToObject(item, "revision", 1);
    cJSON_AddStringToObject(item, "head", part->head ? part->head : "");
    if (part->strands)
        cJSON_AddStringToObject(item, "strands", made->assets[made->n_assets - 1].id);
    cJSON_AddItemToObject(item, "report", cJSON_Duplicate(member(part->line, "report"), true));
    cJSON_AddItemToArray(list, item);
}

/* {"groom":the first's,"revision":1,"grooms":[{"groom","revision","head","strands"?,"report"},…]} */
static groom_status print_result(cJSON *list, struct grooms_retargeted *made, struct groom_diag *diag)
{
    cJSON *result = cJSON_CreateObject();
    cJSON_AddStringToObject(result, "groom", made->prepared[0].groom_id);
    cJSON_AddNumberToObject(result, "revision", 1);
    cJSON_AddItemReferenceToObject(result, "grooms", list);
    made->result = cJSON_PrintUnformatted(result);
    cJSON_Delete(result);
    return made->result ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for a result");
}

groom_status grooms_retargeted_take(struct grooms *grooms, const struct store_job *job, const char *bytes, size_t n_bytes,
                                    struct grooms_retargeted *made, struct groom_diag *diag)
{
    cJSON *request = json_text_parse(job->request, strlen(job->request), NULL), *list = cJSON_CreateArray();
    size_t n_targets = (size_t)cJSON_GetArraySize(member(request, "targets"));
    const char *at = bytes, *end = bytes + n_bytes;
    groom_status status = GROOM_OK;
    *made = (struct grooms_retargeted){.blobs = grooms->options.blobs};
    while (status == GROOM_OK && at < end && made->n < n_targets && made->n < GROOMS_MOST_TARGETS) {
        struct part part = {0};
        if ((status = read_part(&at, end, &part, diag)) == GROOM_OK &&
            (status = take_part(grooms, job, request, &part, made, diag)) == GROOM_OK)
            add_result(list, &part, made);
        cJSON_Delete(part.line);
    }
    if (status == GROOM_OK && (made->n != n_targets || at != end))
        status = groom_fail(diag, GROOM_EINVAL, "the worker handed in %zu of %zu targets", made->n, n_targets);
    if (status == GROOM_OK)
        status = print_result(list, made, diag);
    cJSON_Delete(list);
    cJSON_Delete(request);
    if (status != GROOM_OK)
        grooms_retargeted_finish(made);
    return status;
}

void grooms_retargeted_finish(struct grooms_retargeted *made)
{
    for (size_t i = 0; i < GROOMS_MOST_TARGETS; i++)
        grooms_prepared_finish(&made->prepared[i]);
    for (size_t i = 0; i < made->n_assets; i++) {
        blobs_unpin(made->blobs, made->assets[i].sha256);
        store_asset_finish(&made->assets[i]);
    }
    cJSON_free(made->result);
    *made = (struct grooms_retargeted){0};
}
