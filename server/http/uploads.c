/* Uploads that survive a bad line: the tus protocol 1.0 with creation, creation-with-upload, checksum,
 * expiration and termination. What it calls an upload is received here; POST /v1/strands?upload=… and
 * POST /v1/heads?upload=… use it. */
#include <cjson/cJSON.h>
#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/statvfs.h>
#include <time.h>

#include <openssl/evp.h>

#include "server/http/digest.h"
#include "server/http/handlers.h"
#include "server/uploads/uploads.h"

#define VERSION       "1.0.0"
#define EXTENSIONS    "creation,creation-with-upload,checksum,expiration,termination"
#define PIECE_TYPE    "application/offset+octet-stream"
#define METADATA_MAX  4096

static const char bad_request[] = "the request cannot be understood";

/* --- headers ---------------------------------------------------------------------------------- */

/* returns  false where it is missing or no number (and answered) */
static bool read_number(struct request *request, const char *name, uint64_t *value)
{
    const char *text = request_header(request, name);
    char *end;
    errno = 0;
    if (text && isdigit((unsigned char)text[0]) && (*value = strtoull(text, &end, 10), !errno && !*end) &&
        *value <= INT64_MAX)
        return true;
    respond_refusal(request, 400, "bad-request", bad_request, "%s must be a number of bytes", name);
    return false;
}

/* Needed with everything that changes an upload; another version than ours is refused in any case. */
static bool check_version(struct request *request, bool needed)
{
    const char *version = request_header(request, "Tus-Resumable");
    if (version ? !strcmp(version, VERSION) : !needed)
        return true;
    respond_refusal(request, 412, "tus-version", "another version of the protocol is spoken here",
                    "send Tus-Resumable: " VERSION " (https://tus.io/protocols/resumable-upload)");
    respond_header(request, "Tus-Version", VERSION);
    return false;
}

static bool check_type(struct request *request)
{
    const char *type = request_header(request, "Content-Type");
    if (type && !strcasecmp(type, PIECE_TYPE))
        return true;
    respond_refusal(request, 415, "unsupported-media-type", "the body is of a kind that this call does not take",
                    "send Content-Type: " PIECE_TYPE);
    return false;
}

/* "key base64,key base64": kept as it came, so it has to be what it is to be. */
static bool check_metadata(struct request *request, const char *metadata)
{
    static const char base64[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=";
    bool good = strlen(metadata) < METADATA_MAX;
    for (const char *at = metadata; good && *at;) {
        size_t n_key = strcspn(at, " ,");
        good = n_key > 0;
        for (size_t i = 0; i < n_key; i++)
            good = good && at[i] > 32 && at[i] < 127 && at[i] != '"' && at[i] != '\\';
        at += n_key;
        if (*at == ' ')
            at += 1 + strspn(at + 1, base64);
        good = good && (!*at || *at == ',');
        if (good && *at == ',') {
            at++;
            at += strspn(at, " ");
            good = *at != 0;
        }
    }
    if (!good)
        respond_refusal(request, 400, "bad-request", bad_request,
                        "Upload-Metadata must be pairs of a key and base64, commas between, below %d bytes", METADATA_MAX);
    return good;
}

static bool parse_checksum(const char *text, struct upload_checksum *checksum)
{
    unsigned char decoded[64];
    size_t n = strlen(text), n_padding = n >= 2 ? (size_t)(text[n - 1] == '=') + (text[n - 2] == '=') : 0;
    int n_decoded = n > 4 && n < 80 && n % 4 == 0 ? EVP_DecodeBlock(decoded, (const unsigned char *)text, (int)n) : -1;
    checksum->n_digest = !strcmp(checksum->algorithm, "sha1") ? 20 : 32;
    if (n_decoded < 0 || (size_t)n_decoded - n_padding != checksum->n_digest)
        return false;
    memcpy(checksum->digest, decoded, checksum->n_digest);
    return true;
}

/* Upload-Checksum, or else Content-Digest, which says the same. */
static bool read_checksum(struct request *request, struct upload_checksum *checksum)
{
    const char *header = request_header(request, "Upload-Checksum");
    *checksum = (struct upload_checksum){0};
    if (!header) {
        if (request->has_digest) {
            *checksum = (struct upload_checksum){.algorithm = "sha256", .n_digest = 32};
            memcpy(checksum->digest, request->digest, 32);
        }
        return true;
    }
    size_t n = strcspn(header, " ");
    if (n == 4 && !strncmp(header, "sha1", 4))
        checksum->algorithm = "sha1";
    else if (n == 6 && !strncmp(header, "sha256", 6))
        checksum->algorithm = "sha256";
    if (checksum->algorithm && header[n] == ' ' && parse_checksum(header + n + 1, checksum))
        return true;
    respond_refusal(request, 400, "bad-request", bad_request,
                    "Upload-Checksum must be an algorithm of " UPLOADS_CHECKSUMS " and the checksum in base64");
    return false;
}

/* RFC 9110, 5.6.7; not strftime, which has a locale. */
static void respond_expiry(struct request *request, int64_t expires_ms)
{
    static const char days[] = "SunMonTueWedThuFriSat", months[] = "JanFebMarAprMayJunJulAugSepOctNovDec";
    time_t seconds = (time_t)(expires_ms / 1000);
    struct tm tm;
    gmtime_r(&seconds, &tm);
    respond_header(request, "Upload-Expires", "%.3s, %02d %.3s %d %02d:%02d:%02d GMT", days + 3 * tm.tm_wday,
                   tm.tm_mday, months + 3 * tm.tm_mon, tm.tm_year + 1900, tm.tm_hour, tm.tm_min, tm.tm_sec);
}

/* --- refusals ------------------------------------------------------------------------------------ */

static void refuse(struct request *request, groom_status status, enum upload_refusal refusal,
                   const struct groom_diag *diag)
{
    const char *detail = diag->detail;
    if (status != GROOM_ECONFLICT) {
        respond_failure(request, status, diag);
        return;
    }
    switch (refusal) {
    case UPLOAD_BUSY:
        respond_refusal(request, 423, "locked", "somebody is at it", "%s; try again in a moment", detail);
        respond_header(request, "Retry-After", "2");
        break;
    case UPLOAD_CHECKSUM:
        if (request_header(request, "Upload-Checksum"))
            respond_refusal(request, 460, "checksum-mismatch", "the bytes are not those that their checksum names",
                            "%s", detail);
        else
            respond_refusal(request, 400, "digest-mismatch", "the bytes are not those that their digest names", "%s",
                            detail);
        break;
    case UPLOAD_TAKEN:
        respond_refusal(request, 409, "conflict", "it was changed meanwhile",
                        "the upload is complete and was used; nothing can be added");
        break;
    default:
        respond_failure(request, status, diag);
    }
}

/* --- what there is ----------------------------------------------------------------------------------- */

void uploads_call_options(struct request *request)
{
    respond_empty(request, 204);
    respond_header(request, "Tus-Version", VERSION);
    respond_header(request, "Tus-Extension", EXTENSIONS);
    respond_header(request, "Tus-Max-Size", "%llu", (unsigned long long)request->service->config->max_upload);
    respond_header(request, "Tus-Checksum-Algorithm", UPLOADS_CHECKSUMS);
    respond_header(request, "Allow", "OPTIONS, POST");
}

static cJSON *describe(const struct store_upload *upload)
{
    char created[32], expires[32];
    cJSON *object = cJSON_CreateObject();
    store_time_text(upload->created_ms, created);
    store_time_text(upload->expires_ms, expires);
    cJSON_AddStringToObject(object, "id", upload->id);
    cJSON_AddNumberToObject(object, "bytes", (double)upload->n_bytes);
    cJSON_AddNumberToObject(object, "offset", (double)upload->n_durable);
    cJSON_AddBoolToObject(object, "complete", upload->n_durable == upload->n_bytes);
    cJSON_AddStringToObject(object, "metadata", upload->metadata ? upload->metadata : "");
    cJSON_AddStringToObject(object, "created_at", created);
    cJSON_AddStringToObject(object, "expires_at", expires);
    return object;
}

/* HEAD is the protocol's; GET says the same for people. */
void uploads_call_get(struct request *request)
{
    struct store_upload upload = {0};
    struct groom_diag diag = {0};
    if (!check_version(request, false))
        return;
    groom_status status = uploads_look(request->service->uploads, request->parameter[0], &upload, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    respond_json(request, 200, describe(&upload));
    respond_header(request, "Upload-Offset", "%llu", (unsigned long long)upload.n_durable);
    respond_header(request, "Upload-Length", "%llu", (unsigned long long)upload.n_bytes);
    respond_expiry(request, upload.expires_ms);
    /* longer ones do not fit a header of ours; they are in the body of GET */
    if (upload.metadata[0] && strlen(upload.metadata) < sizeof request->response.headers[0].value)
        respond_header(request, "Upload-Metadata", "%s", upload.metadata);
    store_upload_finish(&upload);
}

void uploads_call_delete(struct request *request)
{
    struct groom_diag diag = {0};
    if (!check_version(request, false))
        return;
    groom_status status = uploads_remove(request->service->uploads, request->parameter[0], &diag);
    if (status == GROOM_OK)
        respond_empty(request, 204);
    else
        respond_failure(request, status, &diag);
}

/* --- a new one ------------------------------------------------------------------------------------------ */

static bool check_room(struct request *request, uint64_t n_bytes)
{
    const struct config *config = request->service->config;
    struct statvfs disk;
    if (n_bytes > config->max_upload) {
        respond_refusal(request, 413, groom_status_name(GROOM_ETOOBIG), groom_status_message(GROOM_ETOOBIG),
                        "the upload is larger than the limit of %llu bytes (--max-upload)",
                        (unsigned long long)config->max_upload);
        return false;
    }
    if (!statvfs(request->service->temporary_folder, &disk) &&
        (uint64_t)disk.f_bavail * disk.f_frsize < config->min_free + n_bytes) {
        respond_failure(request, GROOM_ENOSPC, NULL);
        return false;
    }
    return assets_check_quota(request, n_bytes);
}

/* With a body (creation-with-upload) its first piece follows at once. */
static bool open_first(struct request *request)
{
    struct upload_checksum checksum;
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    struct groom_diag diag = {0};
    if (request->n_expected == 0)
        return true;
    if (!read_checksum(request, &checksum))
        return false;
    groom_status status = upload_open(request->service->uploads, request->upload_id, 0, &checksum, &request->upload,
                                      &refusal, &diag);
    if (status != GROOM_OK)
        refuse(request, status, refusal, &diag);
    return status == GROOM_OK;
}

int uploads_check_post(struct request *request)
{
    uint64_t n_bytes;
    struct store_upload upload = {0};
    struct groom_diag diag = {0};
    const char *metadata = request_header(request, "Upload-Metadata");
    if (!check_version(request, true) || !read_number(request, "Upload-Length", &n_bytes) ||
        (metadata && !check_metadata(request, metadata)) || (request->n_expected > 0 && !check_type(request)) ||
        !check_room(request, n_bytes))
        return 0;
    groom_status status = uploads_begin(request->service->uploads, request->actor.project, request_owner(request),
                                       n_bytes, metadata, &upload, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return 0;
    }
    memcpy(request->upload_id, upload.id, sizeof request->upload_id);
    request->upload_expires_ms = upload.expires_ms;
    store_upload_finish(&upload);
    return open_first(request);
}

/* The writer has what the body brought. returns  false where it was refused (and answered) */
static bool finish_piece(struct request *request, uint64_t *offset, int64_t *expires_ms)
{
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    struct groom_diag diag = {0};
    struct upload_writer *writer = request->upload;
    request->upload = NULL;
    groom_status status = upload_finish(writer, offset, expires_ms, &refusal, &diag);
    if (status != GROOM_OK)
        refuse(request, status, refusal, &diag);
    return status == GROOM_OK;
}

void uploads_call_post(struct request *request)
{
    uint64_t offset = 0;
    int64_t expires_ms = request->upload_expires_ms;
    bool with_piece = request->upload != NULL;
    if (with_piece && !finish_piece(request, &offset, &expires_ms))
        return;
    respond_empty(request, 201);
    respond_header(request, "Location", "/v1/uploads/%s", request->upload_id);
    respond_expiry(request, expires_ms);
    if (with_piece)
        respond_header(request, "Upload-Offset", "%llu", (unsigned long long)offset);
}

/* --- a piece ---------------------------------------------------------------------------------------------- */

int uploads_check_patch(struct request *request)
{
    uint64_t offset;
    struct upload_checksum checksum;
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    struct groom_diag diag = {0};
    if (!check_version(request, true) || !check_type(request) || !read_number(request, "Upload-Offset", &offset) ||
        !read_checksum(request, &checksum))
        return 0;
    groom_status status = upload_open(request->service->uploads, request->parameter[0], offset, &checksum,
                                      &request->upload, &refusal, &diag);
    if (status != GROOM_OK)
        refuse(request, status, refusal, &diag);
    else if (request->n_expected != UINT64_MAX && request->n_expected > upload_room(request->upload))
        respond_refusal(request, 413, groom_status_name(GROOM_ETOOBIG), groom_status_message(GROOM_ETOOBIG),
                        "the upload lacks %llu bytes, and the piece has %llu",
                        (unsigned long long)upload_room(request->upload), (unsigned long long)request->n_expected);
    else
        return 1;
    return 0;
}

void uploads_call_patch(struct request *request)
{
    uint64_t offset = 0;
    int64_t expires_ms = 0;
    if (!finish_piece(request, &offset, &expires_ms))
        return;
    respond_empty(request, 204);
    respond_header(request, "Upload-Offset", "%llu", (unsigned long long)offset);
    respond_expiry(request, expires_ms);
}
