/* Uploads: strands and heads. Their bytes are a blob, what groom-worker found in them a row. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/mesh.h"
#include "proto/json_text.h"
#include "server/blobs/blobs.h"
#include "server/http/digest.h"
#include "server/http/access.h"
#include "server/http/handlers.h"
#include "server/http/tool.h"
#include "server/store/store.h"
#include "server/uploads/uploads.h"

/* What differs between the two. */
struct kind {
    enum store_asset_kind store;
    const char *name;   /* of groom-worker inspect --kind */
    const char *path;   /* of the collection */
    const char *plural; /* the list's key */
};
static const struct kind strands = {STORE_STRANDS, "strands", "/v1/strands", "strands"};
static const struct kind heads = {STORE_HEAD, "head", "/v1/heads", "heads"};

/* --- as JSON ------------------------------------------------------------------------------- */

/* Our own members first, then those of the inspection. */
static cJSON *describe(const struct store_asset *asset)
{
    char created[32], up[2] = {asset->up, 0};
    cJSON *object = cJSON_CreateObject(),
          *found = json_text_parse(asset->metadata, strlen(asset->metadata), NULL);
    store_time_text(asset->created_ms, created);
    bool fine = object && cJSON_AddStringToObject(object, "id", asset->id) &&
                cJSON_AddStringToObject(object, "sha256", asset->sha256) &&
                cJSON_AddNumberToObject(object, "bytes", (double)asset->n_bytes) &&
                cJSON_AddStringToObject(object, "name", asset->name ? asset->name : "") &&
                cJSON_AddStringToObject(object, "format", asset->format ? asset->format : "") &&
                cJSON_AddNumberToObject(object, "unit_m", asset->unit_m) &&
                cJSON_AddStringToObject(object, "up", up) &&
                cJSON_AddStringToObject(object, "created_at", created);
    for (cJSON *member = found ? found->child : NULL, *next; fine && member; member = next) {
        next = member->next;
        if (!cJSON_HasObjectItem(object, member->string))
            cJSON_AddItemToObject(object, member->string, cJSON_DetachItemViaPointer(found, member));
    }
    cJSON_Delete(found);
    if (fine)
        return object;
    cJSON_Delete(object);
    return NULL;
}

static void respond_asset(struct request *request, const struct kind *kind, int status,
                          const struct store_asset *asset)
{
    respond_json(request, status, describe(asset));
    respond_header(request, "Location", "%s/%s", kind->path, asset->id);
    respond_etag(request, "%s", asset->id);
}

/* --- upload -------------------------------------------------------------------------------- */

/* How the bytes are to be read. */
struct reading {
    const char *format; /* "" where they are to say */
    struct groom_frame frame;
};

static bool parse_reading(struct request *request, const struct kind *kind, struct reading *reading)
{
    groom_format format = GROOM_FORMAT_AUTO;
    groom_mesh_format mesh = GROOM_MESH_AUTO;
    struct groom_diag diag = {0};
    const char *text = request_query(request, "format"), *name = request_query(request, "name");
    *reading = (struct reading){"", {.unit_m = 1}};
    if (name && strlen(name) >= 128) {
        respond_bad_query(request, "name", "a name has at most 127 bytes");
        return false;
    }
    if (kind->store == STORE_STRANDS && !tool_query_format(request, false, &format))
        return false;
    if (kind->store == STORE_HEAD && text && strcmp(text, "auto") &&
        groom_mesh_format_parse(text, &mesh, &diag) != GROOM_OK) {
        respond_bad_query(request, "format", "%s", diag.detail);
        return false;
    }
    if (text && strcmp(text, "auto"))
        reading->format =
            kind->store == STORE_HEAD ? groom_mesh_format_name(mesh) : groom_format_name(format);
    return tool_query_frame(request, &reading->frame);
}

static void refuse_quota(struct request *request, const struct groom_diag *diag)
{
    request->retry_after_s = 3600; /* until something is removed, or the limit raised */
    respond_failure(request, GROOM_ELIMIT, diag);
}

bool assets_check_quota(struct request *request, uint64_t n_bytes)
{
    struct store_usage usage;
    struct groom_diag diag = {0};
    if (!request->limits.bytes)
        return true;
    groom_status status = store_usage_of(request->service->store, request_owner(request), &usage, &diag);
    if (status == GROOM_OK && usage.n_bytes + n_bytes > request->limits.bytes) {
        status = groom_fail(&diag, GROOM_ELIMIT,
                            "the token's uploads have %llu bytes and this one has %llu; its limit is %llu",
                            (unsigned long long)usage.n_bytes, (unsigned long long)n_bytes,
                            (unsigned long long)request->limits.bytes);
        refuse_quota(request, &diag);
    } else if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
    }
    return status == GROOM_OK;
}

int assets_check_upload(struct request *request)
{
    struct reading reading;
    const char *upload = request_query(request, "upload");
    if (upload && request->n_expected > 0) {
        respond_bad_query(request, "upload", "with upload=%.40s the bytes are there already: send no body", upload);
        return 0;
    }
    if (!upload && request->n_expected == 0) {
        respond_refusal(request, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL),
                        "the body is empty; send the bytes of the file");
        return 0;
    }
    return parse_reading(request, strstr(request->route->pattern, "heads") ? &heads : &strands, &reading);
}

static groom_status is_referenced(void *store, const char *sha256, bool *referenced)
{
    return store_blob_referenced(store, sha256, referenced, NULL);
}

static void collect_blob(struct request *request, const char *sha256)
{
    bool removed;
    /* where this fails the blob is garbage, which a later collection takes */
    if (blobs_collect(request->service->blobs, sha256, is_referenced, request->service->store, &removed,
                      NULL) != GROOM_OK)
        return;
}

static void forget_blob(struct request *request, const char *sha256)
{
    blobs_unpin(request->service->blobs, sha256);
    collect_blob(request, sha256);
}

/* groom-worker's answer about the blob; NULL where it was refused (and answered). */
static char *inspect(struct request *request, const struct kind *kind, const struct reading *reading,
                     const char *sha256)
{
    int fd;
    uint64_t n_bytes;
    size_t n_output = 0;
    char unit[40], *output = NULL;
    struct groom_diag diag = {0};
    snprintf(unit, sizeof unit, "%.17g", reading->frame.unit_m);
    const char *const arguments[] = {"inspect",
                                     "--kind",
                                     kind->name,
                                     "--format",
                                     reading->format[0] ? reading->format : "auto",
                                     "--unit",
                                     unit,
                                     "--up",
                                     reading->frame.up == GROOM_UP_Z ? "z" : "y",
                                     NULL};
    groom_status status = blobs_read(request->service->blobs, sha256, &fd, &n_bytes, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return NULL;
    }
    bool done = tool_run(request, arguments, fd, -1, &output, &n_output);
    close(fd);
    return done ? output : NULL;
}

static bool store_upload(struct request *request, const struct kind *kind, const struct reading *reading,
                         struct store_asset *asset, char *metadata)
{
    bool created;
    struct groom_diag diag = {0};
    cJSON *found = json_text_parse(metadata, strlen(metadata), NULL);
    const char *format = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(found, "format"));
    const char *name = request_query(request, "name");
    asset->format = strdup(format ? format : reading->format);
    asset->name = strdup(name ? name : "");
    asset->metadata = metadata;
    cJSON_Delete(found);
    asset->created_ms = store_now_ms();
    groom_status status = asset->format && asset->name
                              ? store_asset_put(request->service->store, asset, request->limits.bytes, &created, &diag)
                              : GROOM_ENOMEM;
    if (status == GROOM_ELIMIT)
        refuse_quota(request, &diag);
    else if (status == GROOM_OK)
        respond_asset(request, kind, created ? 201 : 200, asset);
    else
        respond_failure(request, status, &diag);
    return status == GROOM_OK;
}

/* The blob is there: find its row, or make it. */
static void take_upload(struct request *request, const struct kind *kind, const struct reading *reading,
                        const char *sha256, uint64_t n_bytes)
{
    struct store_asset asset = {.kind = kind->store,
                                .n_bytes = n_bytes,
                                .unit_m = reading->frame.unit_m,
                                .up = reading->frame.up == GROOM_UP_Z ? 'z' : 'y'},
                       known = {0};
    char *metadata;
    bool kept = false;
    memcpy(asset.sha256, sha256, sizeof asset.sha256);
    snprintf(asset.project, sizeof asset.project, "%s", request->actor.project);
    snprintf(asset.owner, sizeof asset.owner, "%s", request_owner(request));
    store_asset_id(request->actor.project, kind->store, sha256, reading->format, asset.unit_m, asset.up, asset.id);
    if (store_asset_get(request->service->store, NULL, kind->store, asset.id, &known, NULL) == GROOM_OK) {
        respond_asset(request, kind, 200, &known);
        store_asset_finish(&known);
        kept = true;
    } else if ((metadata = inspect(request, kind, reading, sha256))) {
        kept = store_upload(request, kind, reading, &asset, metadata);
        store_asset_finish(&asset);
    }
    if (kept)
        blobs_unpin(request->service->blobs, sha256);
    else
        forget_blob(request, sha256);
}

/* From an upload in pieces, which stays until it expires: whoever did not hear the answer asks again. */
static void post_upload(struct request *request, const struct kind *kind, const struct reading *reading)
{
    char sha256[BLOBS_HASH_SIZE];
    uint64_t n_bytes = 0;
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    struct groom_diag diag = {0};
    if (!access_check_id(request, request_query(request, "upload")))
        return;
    groom_status status = uploads_take(request->service->uploads, request_query(request, "upload"), sha256, &n_bytes,
                                       &refusal, &diag);
    if (status == GROOM_OK)
        take_upload(request, kind, reading, sha256, n_bytes);
    else if (refusal == UPLOAD_BUSY)
        respond_refusal(request, 423, "locked", "somebody is at it", "%s; try again in a moment", diag.detail);
    else
        respond_failure(request, status, &diag);
}

static void post(struct request *request, const struct kind *kind)
{
    struct reading reading;
    struct groom_diag diag = {0};
    char sha256[BLOBS_HASH_SIZE];
    if (!parse_reading(request, kind, &reading))
        return;
    if (request_query(request, "upload")) {
        post_upload(request, kind, &reading);
        return;
    }
    if (request->n_received == 0) {
        respond_refusal(request, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL),
                        "the body is empty; send the bytes of the file");
        return;
    }
    struct blobs_writer *writer = request->blob;
    request->blob = NULL;
    groom_status status = blobs_commit(writer, NULL, sha256, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        take_upload(request, kind, &reading, sha256, request->n_received);
}

/* --- reading ---------------------------------------------------------------------------------- */

static bool find(struct request *request, const struct kind *kind, struct store_asset *asset)
{
    struct groom_diag diag = {0};
    groom_status status =
        store_asset_get(request->service->store, request->actor.project, kind->store, request->parameter[0], asset, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    return status == GROOM_OK;
}

static void get(struct request *request, const struct kind *kind)
{
    struct store_asset asset = {0};
    if (!find(request, kind, &asset))
        return;
    if (!request_not_modified(request, asset.id))
        respond_asset(request, kind, 200, &asset);
    store_asset_finish(&asset);
}

static void list(struct request *request, const struct kind *kind)
{
    struct store_page page;
    struct store_asset_list found = {0};
    struct groom_diag diag = {0};
    if (!request_page(request, &page))
        return;
    groom_status status = store_assets_list(request->service->store, request->actor.project, kind->store, page, &found, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    cJSON *object = cJSON_CreateObject(), *array = cJSON_AddArrayToObject(object, kind->plural);
    for (size_t i = 0; i < found.n; i++)
        cJSON_AddItemToArray(array, describe(&found.items[i]));
    if (found.next)
        cJSON_AddNumberToObject(object, "next", (double)found.next);
    else
        cJSON_AddNullToObject(object, "next");
    store_asset_list_finish(&found);
    respond_json(request, 200, object);
}

/* --- removing ---------------------------------------------------------------------------------- */

static void remove_asset(struct request *request, const struct kind *kind)
{
    char garbage[STORE_HASH_SIZE];
    struct groom_diag diag = {0};
    groom_status status =
        store_asset_remove(request->service->store, kind->store, request->parameter[0], garbage, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    collect_blob(request, garbage);
    respond_empty(request, 204);
}

void assets_delete_strands(struct request *request) { remove_asset(request, &strands); }
void assets_delete_head(struct request *request) { remove_asset(request, &heads); }

/* --- the bytes again ---------------------------------------------------------------------------- */

static void respond_blob(struct request *request, const struct store_asset *asset, groom_format format)
{
    char digest[DIGEST_TEXT_SIZE];
    int fd;
    uint64_t n_bytes;
    struct groom_diag diag = {0};
    groom_status status = blobs_read(request->service->blobs, asset->sha256, &fd, &n_bytes, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    if (format != GROOM_FORMAT_AUTO) {
        tool_respond_file(request, format, asset->id, asset->sha256, fd, n_bytes);
        digest_text(asset->sha256, digest);
        respond_header(request, "Repr-Digest", "%s", digest);
        return;
    }
    respond_file(request, "application/octet-stream", fd, n_bytes);
    digest_text(asset->sha256, digest);
    respond_header(request, "Repr-Digest", "%s", digest);
    respond_header(request, "Content-Disposition", "attachment; filename=\"%s.%s\"", asset->id,
                   asset->format);
    respond_etag(request, "%s", asset->sha256);
}

/* What an export of an upload shall be. */
struct wanted {
    groom_format format;
    struct groom_frame frame;
    uint64_t count, vertices; /* 0: as uploaded */
};

static void convert(struct request *request, const struct store_asset *asset, const struct wanted *wanted,
                    const char *etag)
{
    int from, to = -1;
    uint64_t n_bytes;
    char from_unit[40], unit[40], from_up[2] = {asset->up, 0}, count[24], vertices[24];
    struct groom_diag diag = {0};
    snprintf(from_unit, sizeof from_unit, "%.17g", asset->unit_m);
    snprintf(unit, sizeof unit, "%.17g", wanted->frame.unit_m);
    snprintf(count, sizeof count, "%llu", (unsigned long long)wanted->count);
    snprintf(vertices, sizeof vertices, "%llu", (unsigned long long)wanted->vertices);
    const char *arguments[20] = {"convert",
                                     "--from-format",
                                     asset->format,
                                     "--from-unit",
                                     from_unit,
                                     "--from-up",
                                     from_up,
                                     "--to-format",
                                     groom_format_name(wanted->format),
                                     "--unit",
                                     unit,
                                     "--up",
                                     wanted->frame.up == GROOM_UP_Z ? "z" : "y"};
    size_t n = 13;
    if (wanted->count) {
        arguments[n++] = "--count";
        arguments[n++] = count;
    }
    if (wanted->vertices) {
        arguments[n++] = "--vertices";
        arguments[n++] = vertices;
    }
    groom_status status = blobs_read(request->service->blobs, asset->sha256, &from, &n_bytes, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    if ((to = tool_temporary(request)) >= 0 && tool_run(request, arguments, from, to, NULL, NULL)) {
        tool_respond_file(request, wanted->format, asset->id, etag, to, (uint64_t)lseek(to, 0, SEEK_END));
        to = -1;
    }
    close(from);
    if (to >= 0)
        close(to);
}

/* Metres and y up where nothing else is asked for; the very bytes where that is what they are. */
static void strands_data(struct request *request, const struct store_asset *asset)
{
    struct wanted wanted = {.frame = {.unit_m = 1}};
    groom_format own = GROOM_FORMAT_AUTO;
    char etag[120];
    if (groom_format_parse(asset->format, &own, NULL) != GROOM_OK)
        own = GROOM_FORMAT_AUTO;
    wanted.format = groom_format_writable(own) ? own : GROOM_FORMAT_HAIR;
    if (!tool_query_format(request, true, &wanted.format) || !tool_query_frame(request, &wanted.frame) ||
        !request_query_number(request, "count", 1, UINT32_MAX, &wanted.count) ||
        !request_query_number(request, "vertices", 2, 65536, &wanted.vertices))
        return;
    bool same_up = (asset->up == 'z') == (wanted.frame.up == GROOM_UP_Z);
    bool same_unit = !(wanted.frame.unit_m < asset->unit_m) && !(wanted.frame.unit_m > asset->unit_m);
    if (wanted.format == own && same_up && same_unit && !wanted.count && !wanted.vertices) {
        if (!request_not_modified(request, asset->sha256))
            respond_blob(request, asset, wanted.format);
        return;
    }
    snprintf(etag, sizeof etag, "%s-%s-%.9g-%s-%llu-%llu", asset->id, groom_format_name(wanted.format),
             wanted.frame.unit_m, wanted.frame.up == GROOM_UP_Z ? "z" : "y", (unsigned long long)wanted.count,
             (unsigned long long)wanted.vertices);
    if (!request_not_modified(request, etag))
        convert(request, asset, &wanted, etag);
}

void assets_get_strands_data(struct request *request)
{
    struct store_asset asset = {0};
    if (!find(request, &strands, &asset))
        return;
    strands_data(request, &asset);
    store_asset_finish(&asset);
}

/* A head as it was uploaded. */
void assets_get_head_data(struct request *request)
{
    struct store_asset asset = {0};
    if (!find(request, &heads, &asset))
        return;
    if (!request_not_modified(request, asset.sha256))
        respond_blob(request, &asset, GROOM_FORMAT_AUTO);
    store_asset_finish(&asset);
}

void assets_post_strands(struct request *request) { post(request, &strands); }
void assets_post_head(struct request *request) { post(request, &heads); }
void assets_list_strands(struct request *request) { list(request, &strands); }
void assets_list_heads(struct request *request) { list(request, &heads); }
void assets_get_strands(struct request *request) { get(request, &strands); }
void assets_get_head(struct request *request) { get(request, &heads); }
