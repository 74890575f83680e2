/* Grooms: documents, edits, history, and what is evaluated from them. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/mman.h>
#include <unistd.h>

#include "groom/strands.h"
#include "server/grooms/grooms.h"
#include "server/http/handlers.h"
#include "server/http/server.h"
#include "server/http/tool.h"

/* --- documents ------------------------------------------------------------------------- */

/* All of it at once; an If-Match is honoured, so that nobody removes what he has not seen. */
void grooms_call_delete(struct request *request)
{
    uint32_t expected = 0;
    struct store_revision latest = {0};
    struct groom_diag diag = {0};
    groom_status status = GROOM_OK;
    if (request_header(request, "If-Match")) {
        if (!request_if_match(request, &expected))
            return;
        status = store_revision_get(request->service->store, request->parameter[0], 0, &latest, &diag);
        if (status == GROOM_OK && latest.number != expected)
            respond_refusal(request, 412, "precondition-failed", "it was changed meanwhile",
                            "the groom is at revision %u, not %u", latest.number, expected);
        store_revision_finish(&latest);
    }
    if (request->response.kind != RESPONSE_NONE)
        return;
    if (status == GROOM_OK)
        status = store_groom_remove(request->service->store, request->parameter[0], &diag);
    if (status == GROOM_OK)
        respond_empty(request, 204);
    else
        respond_failure(request, status, &diag);
}


void grooms_call_list(struct request *request)
{
    char *json;
    struct store_page page;
    struct groom_diag diag = {0};
    if (!request_page(request, &page))
        return;
    groom_status status = grooms_list_json(request->service->grooms, request->actor.project, page, &json, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", json, strlen(json));
}

void grooms_respond_revision(struct request *request, const char *groom_id, uint32_t revision)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "groom", groom_id);
    cJSON_AddNumberToObject(object, "revision", revision);
    respond_json(request, 201, object);
    respond_header(request, "Location", "/v1/grooms/%s", groom_id);
    respond_etag(request, "%u", revision);
}

/* An edit that came too late is a failed precondition; the rest is as it is everywhere. */
static void respond_edit(struct request *request, groom_status status, uint32_t revision,
                         const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        grooms_respond_revision(request, request->parameter[0], revision);
    else if (status == GROOM_ECONFLICT && !diag->pointer[0]) /* with one, it is a "test" that did not hold: 409 */
        respond_refusal(request, 412, "precondition-failed", "it was changed meanwhile", "%s", diag->detail);
    else
        respond_failure(request, status, diag);
}

bool grooms_query_revision(struct request *request, uint32_t *revision)
{
    uint64_t number = 0;
    bool fine = request_query_number(request, "revision", 1, UINT32_MAX, &number);
    *revision = (uint32_t)number;
    return fine;
}

void grooms_call_get(struct request *request)
{
    char *json, etag[32];
    size_t n_bytes;
    uint32_t revision, number;
    bool arrays = true;
    struct groom_diag diag = {0};
    if (!grooms_query_revision(request, &revision) || !request_query_bool(request, "arrays", &arrays))
        return;
    groom_status status = grooms_document(request->service->grooms, request->parameter[0], revision, arrays,
                                          &json, &n_bytes, &number, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    snprintf(etag, sizeof etag, "%u", number);
    if (request_not_modified(request, etag)) {
        free(json);
        return;
    }
    respond_bytes(request, 200, "application/json", json, n_bytes);
    respond_etag(request, "%s", etag);
}

/* Map a whole file; NULL where it is empty or cannot be mapped (answered). */
static char *map_file(struct request *request, int fd, size_t n_bytes)
{
    char *bytes = n_bytes ? mmap(NULL, n_bytes, PROT_READ, MAP_PRIVATE, fd, 0) : MAP_FAILED;
    if (bytes != MAP_FAILED)
        return bytes;
    if (n_bytes)
        respond_failure(request, GROOM_EIO, NULL);
    else
        respond_refusal(request, 400, groom_status_name(GROOM_EINVAL), groom_status_message(GROOM_EINVAL),
                        "the body is empty");
    return NULL;
}

static void import(struct request *request, int checked)
{
    char id[STORE_ID_SIZE];
    struct groom_diag diag = {0};
    size_t n_bytes = (size_t)lseek(checked, 0, SEEK_END);
    char *document = map_file(request, checked, n_bytes);
    if (!document)
        return;
    groom_status status = grooms_import(request->service->grooms, request->actor.project, document, n_bytes, id, &diag);
    munmap(document, n_bytes);
    if (status == GROOM_OK)
        grooms_respond_revision(request, id, 1);
    else
        respond_failure(request, status, &diag);
}

/* Someone else's document: groom-worker reads it, and writes what it has understood. */
void grooms_call_import(struct request *request)
{
    const char *const arguments[] = {"check-groom", NULL};
    if (request->n_received == 0) {
        map_file(request, -1, 0);
        return;
    }
    int checked = tool_temporary(request);
    if (checked < 0)
        return;
    if (tool_run(request, arguments, request->body_fd, checked, NULL, NULL))
        import(request, checked);
    close(checked);
}

/* --- edits --------------------------------------------------------------------------------- */

static bool is_type(const char *header, const char *type)
{
    size_t n = strcspn(header, "; ");
    return n == strlen(type) && !strncasecmp(header, type, n);
}

static bool patch_kind(struct request *request, enum grooms_patch_kind *kind)
{
    const char *type = request_header(request, "Content-Type");
    if (type && is_type(type, "application/json-patch+json"))
        *kind = GROOMS_JSON_PATCH;
    else if (type && is_type(type, "application/merge-patch+json"))
        *kind = GROOMS_MERGE_PATCH;
    else {
        respond_refusal(
            request, 415, "unsupported-media-type", "the body is of a kind that this call does not take",
            "Content-Type is %.60s; PATCH takes application/json-patch+json or application/merge-patch+json",
            type ? type : "missing");
        respond_header(request, "Accept-Patch", "application/json-patch+json, application/merge-patch+json");
        return false;
    }
    return true;
}

int grooms_check_edit(struct request *request)
{
    uint32_t revision;
    return request_if_match(request, &revision);
}

int grooms_check_patch(struct request *request)
{
    enum grooms_patch_kind kind;
    return patch_kind(request, &kind) && grooms_check_edit(request);
}

void grooms_call_patch(struct request *request)
{
    enum grooms_patch_kind kind;
    uint32_t expected, number = 0;
    struct groom_diag diag = {0};
    if (!patch_kind(request, &kind) || !request_if_match(request, &expected))
        return;
    groom_status status = grooms_patch(request->service->grooms, request->parameter[0], expected, kind,
                                       request->body ? request->body : "", request->n_body, &number, &diag);
    respond_edit(request, status, number, &diag);
}

void grooms_call_revert(struct request *request)
{
    uint32_t expected, number = 0;
    struct groom_diag diag = {0};
    cJSON *body;
    if (!request_if_match(request, &expected) || !(body = request_json(request)))
        return;
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(body, "revision");
    double wanted = cJSON_IsNumber(item) ? item->valuedouble : 0;
    bool whole = wanted >= 1 && wanted <= UINT32_MAX && !(wanted > (double)(uint32_t)wanted);
    bool alone = item && body->child == item && !item->next;
    cJSON_Delete(body);
    if (!whole || !alone) {
        respond_bad_field(request, 400, "/revision",
                          "the body must be {\"revision\":N}, N a revision to go back to");
        return;
    }
    groom_status status = grooms_revert(request->service->grooms, request->parameter[0], expected,
                                        (uint32_t)wanted, &number, &diag);
    respond_edit(request, status, number, &diag);
}

void grooms_call_revisions(struct request *request)
{
    char *json;
    struct store_page page;
    struct groom_diag diag = {0};
    if (!request_page(request, &page))
        return;
    groom_status status =
        grooms_revisions_json(request->service->grooms, request->parameter[0], page, &json, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", json, strlen(json));
}

/* --- what is evaluated ------------------------------------------------------------------------ */

typedef groom_status (*write_strands)(struct grooms *, const char *, const struct grooms_export *,
                                      struct groom_sink, struct groom_diag *);

/* The number of the revision that is meant: the latest where none is named. */
bool grooms_settle_revision(struct request *request, uint32_t *revision)
{
    struct store_revision found = {0};
    struct groom_diag diag = {0};
    groom_status status =
        store_revision_get(request->service->store, request->parameter[0], *revision, &found, &diag);
    if (status == GROOM_OK)
        *revision = found.number;
    else
        respond_failure(request, status, &diag);
    store_revision_finish(&found);
    return status == GROOM_OK;
}

static groom_status write_file(struct request *request, write_strands write, const struct grooms_export *what,
                               int fd, uint64_t *n_bytes, struct groom_diag *diag)
{
    struct tool_sink *sink = malloc(sizeof *sink);
    if (!sink)
        return GROOM_ENOMEM;
    groom_status status =
        write(request->service->grooms, request->parameter[0], what, tool_sink(sink, fd), diag);
    if (status == GROOM_OK)
        status = tool_flush(sink);
    *n_bytes = sink->n_written;
    free(sink);
    return status;
}

/* The file of an export, made before or made now; -1 where that failed (and was answered). The ETag
 * says all that it depends on but the groom. */
static int make_export(struct request *request, write_strands write, const struct grooms_export *what,
                       const char *etag, uint64_t *n_bytes)
{
    char key[160];
    int fd;
    struct groom_diag diag = {0};
    struct export_cache *cache = server_exports(request->server);
    snprintf(key, sizeof key, "%.63s/%s", request->parameter[0], etag);
    if (export_cache_find(cache, key, &fd, n_bytes) || (fd = tool_temporary(request)) < 0)
        return fd;
    groom_status status = write_file(request, write, what, fd, n_bytes, &diag);
    if (status == GROOM_OK) {
        export_cache_keep(cache, key, fd, *n_bytes);
        return fd;
    }
    close(fd);
    respond_failure(request, status, &diag);
    return -1;
}

/* Into a file first: a slow client then holds no thread, ranges work, and a failure is a problem and
 * not half an answer. */
static void export(struct request *request, write_strands write, const char *suffix)
{
    struct grooms_export what = {.write = {.format = GROOM_FORMAT_HAIR, .frame = {.unit_m = 1}}};
    uint64_t count = 0, n_bytes = 0;
    char etag[80], name[80];
    if (!grooms_query_revision(request, &what.revision) ||
        !request_query_number(request, "count", 1, UINT32_MAX, &count) ||
        !tool_query_format(request, true, &what.write.format) ||
        !tool_query_frame(request, &what.write.frame) || !grooms_settle_revision(request, &what.revision))
        return;
    what.count = (uint32_t)count;
    snprintf(etag, sizeof etag, "%u%s-%s-%u-%.9g-%s", what.revision, suffix,
             groom_format_name(what.write.format), what.count, what.write.frame.unit_m,
             what.write.frame.up == GROOM_UP_Z ? "z" : "y");
    snprintf(name, sizeof name, "%.31s-%u%s", request->parameter[0], what.revision, suffix);
    if (request_not_modified(request, etag))
        return;
    int fd = make_export(request, write, &what, etag, &n_bytes);
    if (fd >= 0)
        tool_respond_file(request, what.write.format, name, etag, fd, n_bytes);
}

void grooms_call_strands(struct request *request) { export(request, grooms_write_strands, ""); }
void grooms_call_guides(struct request *request) { export(request, grooms_write_guides, "-guides"); }

int grooms_check_guides(struct request *request)
{
    groom_format format = GROOM_FORMAT_AUTO;
    struct groom_frame frame = {.unit_m = 1};
    return tool_query_format(request, false, &format) && tool_query_frame(request, &frame) &&
           grooms_check_edit(request);
}

/* Guides from any format, by way of groom-worker: what the daemon reads is HAIR in metres. */
static bool convert_guides(struct request *request, int converted)
{
    groom_format format = GROOM_FORMAT_AUTO;
    struct groom_frame frame = {.unit_m = 1};
    char unit[40];
    if (!tool_query_format(request, false, &format) || !tool_query_frame(request, &frame))
        return false;
    snprintf(unit, sizeof unit, "%.17g", frame.unit_m);
    const char *const arguments[] = {"convert",
                                     "--from-format",
                                     groom_format_name(format),
                                     "--from-unit",
                                     unit,
                                     "--from-up",
                                     frame.up == GROOM_UP_Z ? "z" : "y",
                                     "--to-format",
                                     "hair",
                                     NULL};
    return tool_run(request, arguments, request->body_fd, converted, NULL, NULL);
}

static void set_guides(struct request *request, int converted, uint32_t expected)
{
    uint32_t number = 0;
    struct groom_strands *guides = NULL;
    struct groom_diag diag = {0};
    const struct groom_read_options options = {.format = GROOM_FORMAT_HAIR};
    if (lseek(converted, 0, SEEK_SET) < 0) {
        respond_failure(request, GROOM_EIO, NULL);
        return;
    }
    struct groom_source source = groom_source_from_fd(converted); /* from where it stands */
    groom_status status = groom_strands_read(&source, &options, NULL, &guides, NULL, &diag);
    if (status == GROOM_OK)
        status = grooms_set_guides(request->service->grooms, request->parameter[0], expected, guides, &number,
                                   &diag);
    groom_strands_destroy(guides);
    respond_edit(request, status, number, &diag);
}

void grooms_call_put_guides(struct request *request)
{
    uint32_t expected;
    if (!request_if_match(request, &expected))
        return;
    if (request->n_received == 0) {
        map_file(request, -1, 0);
        return;
    }
    int converted = tool_temporary(request);
    if (converted < 0)
        return;
    if (convert_guides(request, converted))
        set_guides(request, converted, expected);
    close(converted);
}
