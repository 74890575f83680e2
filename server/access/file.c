/* tokens.json: read as a whole, replaced as a whole.
 *
 *     {"format":"groomd-tokens/1","tokens":[{"id":"tok_…","sha256":"…","name":"ann","project":"film",
 *      "scopes":["read","submit"],"limits":{"requests_per_s":0,"bytes":0,"queued":0},
 *      "created_at":ms,"expires_at":ms,"revoked_at":ms},…]} */
#include "server/access/access.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <openssl/evp.h>


#define FORMAT    "groomd-tokens/1"
#define MAX_BYTES ((size_t)16 << 20)
#define PATH_SIZE 1200

static const char *const scope_names[] = {"read", "submit", "work", "admin"};
#define N_SCOPES (sizeof scope_names / sizeof scope_names[0])

/* --- scopes and names ------------------------------------------------------------------ */

const char *access_scope_name(enum access_scope scope)
{
    for (size_t i = 0; i < N_SCOPES; i++)
        if ((unsigned)scope == 1u << i)
            return scope_names[i];
    return "none";
}

static unsigned scope_of(const char *name, size_t n)
{
    for (size_t i = 0; i < N_SCOPES; i++)
        if (strlen(scope_names[i]) == n && !strncmp(scope_names[i], name, n))
            return 1u << i;
    return 0;
}

groom_status access_scopes_parse(const char *text, unsigned *scopes, struct groom_diag *diag)
{
    unsigned found = 0;
    for (const char *at = text;; at++) {
        size_t n = strcspn(at, ",");
        unsigned scope = scope_of(at, n);
        if (!scope)
            return groom_fail(diag, GROOM_EINVAL, "\"%.*s\" is no scope; scopes are read, submit, work and admin",
                              (int)(n < 40 ? n : 40), at);
        found |= scope;
        at += n;
        if (!*at)
            break;
    }
    *scopes = found;
    return GROOM_OK;
}

void access_scopes_print(unsigned scopes, char text[ACCESS_TEXT_SIZE])
{
    size_t n = 0;
    text[0] = 0;
    for (size_t i = 0; i < N_SCOPES; i++)
        if (scopes & 1u << i)
            n += (size_t)snprintf(text + n, ACCESS_TEXT_SIZE - n, "%s%s", n ? "," : "", scope_names[i]);
}

groom_status access_check_project(const char *name, struct groom_diag *diag)
{
    size_t n = strlen(name);
    if (n > 0 && n < ACCESS_TEXT_SIZE && name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789-_.")] == 0)
        return GROOM_OK;
    return groom_fail(diag, GROOM_EINVAL, "\"%.70s\" is no project: 1 to %d of a-z, 0-9, -, _ and .", name,
                      ACCESS_TEXT_SIZE - 1);
}

/* --- reading ----------------------------------------------------------------------------- */

static bool read_hex(const char *hex, unsigned char *bytes, size_t n)
{
    if (!hex || strlen(hex) != 2 * n || hex[strspn(hex, "0123456789abcdef")])
        return false;
    for (size_t i = 0; i < n; i++) {
        unsigned value = 0;
        sscanf(hex + 2 * i, "%2x", &value);
        bytes[i] = (unsigned char)value;
    }
    return true;
}

static bool take_text(const cJSON *object, const char *name, char text[ACCESS_TEXT_SIZE])
{
    const char *value = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    if (!value || strlen(value) >= ACCESS_TEXT_SIZE)
        return false;
    memcpy(text, value, strlen(value) + 1);
    return true;
}

static uint64_t take_number(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) && item->valuedouble > 0 && item->valuedouble < 9e15 ? (uint64_t)item->valuedouble
                                                                                      : 0;
}

static bool take_token(const cJSON *object, struct access_token *token)
{
    const cJSON *scope, *limits = cJSON_GetObjectItemCaseSensitive(object, "limits");
    const char *hex = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, "sha256"));
    cJSON_ArrayForEach(scope, cJSON_GetObjectItemCaseSensitive(object, "scopes"))
    {
        if (cJSON_IsString(scope))
            token->scopes |= scope_of(scope->valuestring, strlen(scope->valuestring));
    }
    token->limits = (struct access_limits){take_number(limits, "requests_per_s"), take_number(limits, "bytes"),
                                           take_number(limits, "queued")};
    token->created_ms = (int64_t)take_number(object, "created_at");
    token->expires_ms = (int64_t)take_number(object, "expires_at");
    token->revoked_ms = (int64_t)take_number(object, "revoked_at");
    return take_text(object, "id", token->id) && take_text(object, "name", token->name) &&
           take_text(object, "project", token->project) && read_hex(hex, token->hash, sizeof token->hash);
}

static groom_status read_bytes(const char *path, char **bytes, size_t *n_bytes, struct groom_diag *diag)
{
    struct stat info;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    *bytes = NULL;
    *n_bytes = 0;
    if (fd < 0 && errno == ENOENT)
        return GROOM_OK;
    if (fd < 0 || fstat(fd, &info) || (size_t)info.st_size > MAX_BYTES) {
        if (fd >= 0)
            close(fd);
        return groom_fail(diag, GROOM_EIO, "%.200s cannot be read: %s", path, strerror(errno));
    }
    char *text = malloc((size_t)info.st_size + 1);
    ssize_t n = text ? read(fd, text, (size_t)info.st_size) : -1;
    close(fd);
    if (n != info.st_size) {
        free(text);
        return groom_fail(diag, text ? GROOM_EIO : GROOM_ENOMEM, "%.200s cannot be read", path);
    }
    text[n] = 0;
    *bytes = text;
    *n_bytes = (size_t)n;
    return GROOM_OK;
}

static groom_status take_list(const char *path, const cJSON *root, struct access_list *list, struct groom_diag *diag)
{
    const cJSON *object, *tokens = cJSON_GetObjectItemCaseSensitive(root, "tokens");
    const char *format = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(root, "format"));
    int n = cJSON_IsArray(tokens) ? cJSON_GetArraySize(tokens) : 0;
    if (!format || strcmp(format, FORMAT) != 0 || !cJSON_IsArray(tokens))
        return groom_fail(diag, GROOM_EFORMAT, "%.200s is not a list of tokens (%s): restore it from a backup", path,
                          FORMAT);
    if (n && !(list->items = calloc((size_t)n, sizeof *list->items)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for tokens");
    cJSON_ArrayForEach(object, tokens)
    {
        if (!take_token(object, &list->items[list->n++]))
            return groom_fail(diag, GROOM_EFORMAT, "%.200s: token %zu is damaged: restore the file from a backup",
                              path, list->n);
    }
    return GROOM_OK;
}

static groom_status read_list(const char *path, struct access_list *list, struct groom_diag *diag)
{
    char *text;
    size_t n;
    struct access_list found = {0};
    groom_status status = read_bytes(path, &text, &n, diag);
    if (status == GROOM_OK && text) {
        cJSON *root = cJSON_ParseWithLengthOpts(text, n + 1, NULL, 1);
        status = take_list(path, root, &found, diag);
        cJSON_Delete(root);
    }
    free(text);
    if (status == GROOM_OK)
        *list = found;
    else
        access_list_finish(&found);
    return status;
}

groom_status access_list_read(const char *folder, struct access_list *list, struct groom_diag *diag)
{
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "%s/tokens.json", folder);
    return read_list(path, list, diag);
}

void access_list_finish(struct access_list *list)
{
    free(list->items);
    *list = (struct access_list){0};
}

/* --- writing ------------------------------------------------------------------------------- */

static cJSON *print_token(const struct access_token *token)
{
    char hex[2 * ACCESS_HASH_SIZE + 1];
    cJSON *object = cJSON_CreateObject(), *scopes = cJSON_CreateArray(), *limits = cJSON_CreateObject();
    for (size_t i = 0; i < ACCESS_HASH_SIZE; i++)
        snprintf(hex + 2 * i, 3, "%02x", token->hash[i]);
    for (size_t i = 0; i < N_SCOPES; i++)
        if (token->scopes & 1u << i)
            cJSON_AddItemToArray(scopes, cJSON_CreateString(scope_names[i]));
    cJSON_AddNumberToObject(limits, "requests_per_s", (double)token->limits.requests_per_s);
    cJSON_AddNumberToObject(limits, "bytes", (double)token->limits.bytes);
    cJSON_AddNumberToObject(limits, "queued", (double)token->limits.queued);
    cJSON_AddStringToObject(object, "id", token->id);
    cJSON_AddStringToObject(object, "sha256", hex);
    cJSON_AddStringToObject(object, "name", token->name);
    cJSON_AddStringToObject(object, "project", token->project);
    cJSON_AddItemToObject(object, "scopes", scopes);
    cJSON_AddItemToObject(object, "limits", limits);
    cJSON_AddNumberToObject(object, "created_at", (double)token->created_ms);
    cJSON_AddNumberToObject(object, "expires_at", (double)token->expires_ms);
    cJSON_AddNumberToObject(object, "revoked_at", (double)token->revoked_ms);
    return object;
}

static char *print_list(const struct access_list *list)
{
    cJSON *root = cJSON_CreateObject(), *tokens = cJSON_CreateArray();
    cJSON_AddStringToObject(root, "format", FORMAT);
    cJSON_AddItemToObject(root, "tokens", tokens);
    for (size_t i = 0; i < list->n; i++)
        cJSON_AddItemToArray(tokens, print_token(&list->items[i]));
    char *text = cJSON_Print(root);
    cJSON_Delete(root);
    return text;
}

/* Made by root for a daemon that runs as another: the file is the folder's owner's. */
static bool give_to_owner(int folder_fd, int fd)
{
    struct stat folder;
    return geteuid() != 0 || (!fstat(folder_fd, &folder) && !fchown(fd, folder.st_uid, folder.st_gid));
}

static bool write_file(int folder_fd, const char *text)
{
    size_t n = strlen(text);
    int fd = openat(folder_fd, "tokens.json.new", O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (fd < 0)
        return false;
    bool fine = give_to_owner(folder_fd, fd) && write(fd, text, n) == (ssize_t)n && !fsync(fd);
    fine &= !close(fd);
    return fine && !renameat(folder_fd, "tokens.json.new", folder_fd, "tokens.json") && !fsync(folder_fd);
}

/* The folder with its lock held: two commands at once take turns. */
struct place {
    int folder_fd, lock_fd;
};

static groom_status enter(const char *folder, struct place *place, struct groom_diag *diag)
{
    if (mkdir(folder, 0700) && errno != EEXIST)
        return groom_fail(diag, GROOM_EIO, "the folder %.200s cannot be made: %s", folder, strerror(errno));
    place->folder_fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    place->lock_fd = place->folder_fd < 0 ? -1
                                          : openat(place->folder_fd, "tokens.lock", O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (place->lock_fd >= 0 && give_to_owner(place->folder_fd, place->lock_fd) && !flock(place->lock_fd, LOCK_EX))
        return GROOM_OK;
    groom_status status = groom_fail(diag, GROOM_EIO, "%.200s: %s", folder, strerror(errno));
    if (place->lock_fd >= 0)
        close(place->lock_fd);
    if (place->folder_fd >= 0)
        close(place->folder_fd);
    return status;
}

static void leave(struct place *place)
{
    close(place->lock_fd);
    close(place->folder_fd);
}

static groom_status replace(const struct place *place, const struct access_list *list, struct groom_diag *diag)
{
    char *text = print_list(list);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for tokens");
    bool written = write_file(place->folder_fd, text);
    int error = errno;
    cJSON_free(text);
    if (written)
        return GROOM_OK;
    return groom_fail(diag, error == ENOSPC ? GROOM_ENOSPC : GROOM_EIO, "tokens.json cannot be written: %s",
                      strerror(error));
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static bool make_random(const char *prefix, size_t n, char *text)
{
    unsigned char random[64];
    if (n > sizeof random || getrandom(random, n, 0) != (ssize_t)n)
        return false;
    size_t at = (size_t)sprintf(text, "%s", prefix);
    for (size_t i = 0; i < n; i++)
        text[at++] = "abcdefghijklmnopqrstuvwxyz234567"[random[i] & 31];
    text[at] = 0;
    return true;
}

static groom_status add(struct access_list *list, const struct access_token *token, struct groom_diag *diag)
{
    struct access_token *larger = realloc(list->items, (list->n + 1) * sizeof *larger);
    if (!larger)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for tokens");
    list->items = larger;
    list->items[list->n++] = *token;
    return GROOM_OK;
}

groom_status access_create(const char *folder, struct access_token *wanted, char token[ACCESS_TOKEN_SIZE],
                           struct groom_diag *diag)
{
    struct access_list list = {0};
    struct place place;
    groom_status status;
    if ((status = access_check_project(wanted->project, diag)) != GROOM_OK)
        return status;
    if (!wanted->name[0] || !wanted->scopes)
        return groom_fail(diag, GROOM_EINVAL, "a token has a name and at least one scope");
    if (!make_random("tok_", 20, wanted->id) || !make_random("grt_", 48, token))
        return groom_fail(diag, GROOM_EIO, "no random numbers");
    EVP_Digest(token, strlen(token), wanted->hash, NULL, EVP_sha256(), NULL);
    wanted->created_ms = now_ms();
    if ((status = enter(folder, &place, diag)) != GROOM_OK)
        return status;
    if ((status = access_list_read(folder, &list, diag)) == GROOM_OK && (status = add(&list, wanted, diag)) == GROOM_OK)
        status = replace(&place, &list, diag);
    leave(&place);
    access_list_finish(&list);
    return status;
}

static groom_status mark_revoked(struct access_list *list, const char *id, struct groom_diag *diag)
{
    for (size_t i = 0; i < list->n; i++) {
        if (strcmp(list->items[i].id, id) != 0)
            continue;
        if (list->items[i].revoked_ms)
            return groom_fail(diag, GROOM_ECONFLICT, "%.63s is revoked already", id);
        list->items[i].revoked_ms = now_ms();
        return GROOM_OK;
    }
    return groom_fail(diag, GROOM_ENOTFOUND, "there is no token %.63s; groomd token list shows those there are", id);
}

groom_status access_revoke(const char *folder, const char *id, struct groom_diag *diag)
{
    struct access_list list = {0};
    struct place place;
    groom_status status = enter(folder, &place, diag);
    if (status != GROOM_OK)
        return status;
    if ((status = access_list_read(folder, &list, diag)) == GROOM_OK &&
        (status = mark_revoked(&list, id, diag)) == GROOM_OK)
        status = replace(&place, &list, diag);
    leave(&place);
    access_list_finish(&list);
    return status;
}
