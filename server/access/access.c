/* The daemon's view of the tokens: looked up in memory, read again where the file has changed. */
#include "server/access/access.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <time.h>

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#define PATH_SIZE 1200
#define BURST_S   10 /* seconds' worth of requests that may come at once */

/* What may be taken of a token, refilled as time goes by. */
struct bucket {
    double level;
    int64_t at_ms; /* 0: never asked */
};

/* What tells one file from the next. */
struct version {
    ino_t inode;
    off_t size;
    struct timespec changed;
};

struct access {
    struct access_options options;
    char path[PATH_SIZE];
    unsigned char session_key[32];
    pthread_mutex_t lock; /* of what follows */
    struct version version;
    struct access_list list;
    struct bucket *buckets; /* one for each of the list */
};

static int64_t clock_ms(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* --- following the file; the lock is held ------------------------------------------------ */

static bool look(const struct access *access, struct version *version)
{
    struct stat info;
    if (stat(access->path, &info))
        return false;
    *version = (struct version){info.st_ino, info.st_size, info.st_mtim};
    return true;
}

static bool is_same(const struct version *a, const struct version *b)
{
    return a->inode == b->inode && a->size == b->size && a->changed.tv_sec == b->changed.tv_sec &&
           a->changed.tv_nsec == b->changed.tv_nsec;
}

static size_t find_id(const struct access_list *list, const char *id)
{
    size_t i = 0;
    while (i < list->n && strcmp(list->items[i].id, id) != 0)
        i++;
    return i;
}

static void tell(const struct access *access, const struct access_list *before, const struct access_list *after)
{
    for (size_t i = 0; access->options.changed && i < after->n; i++) {
        const struct access_token *token = &after->items[i];
        size_t old = find_id(before, token->id);
        if (old == before->n)
            access->options.changed(access->options.user, "token.create", token);
        if (token->revoked_ms && (old == before->n || !before->items[old].revoked_ms))
            access->options.changed(access->options.user, "token.revoke", token);
    }
}

static groom_status load(struct access *access, bool first, struct groom_diag *diag)
{
    struct version version = {0};
    struct access_list list = {0};
    if (!look(access, &version) || is_same(&version, &access->version))
        return GROOM_OK;
    groom_status status = access_list_read(access->options.folder, &list, diag);
    struct bucket *buckets = status == GROOM_OK ? calloc(list.n + 1, sizeof *buckets) : NULL;
    if (status == GROOM_OK && !buckets)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for tokens");
    if (status != GROOM_OK) {
        access_list_finish(&list);
        return status;
    }
    for (size_t i = 0; i < list.n; i++) {
        size_t old = find_id(&access->list, list.items[i].id);
        if (old < access->list.n)
            buckets[i] = access->buckets[old];
    }
    if (!first)
        tell(access, &access->list, &list);
    access_list_finish(&access->list);
    free(access->buckets);
    access->list = list;
    access->buckets = buckets;
    access->version = version;
    return GROOM_OK;
}

/* A file that cannot be read, or is gone, changes nothing: what was known goes on. */
static void refresh(struct access *access)
{
    groom_status status = load(access, false, NULL);
    (void)status;
}

/* --- opening ------------------------------------------------------------------------------- */

groom_status access_open(const struct access_options *options, struct access **out, struct groom_diag *diag)
{
    struct access *access = calloc(1, sizeof *access);
    groom_status status;
    if (!access)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for tokens");
    access->options = *options;
    pthread_mutex_init(&access->lock, NULL);
    snprintf(access->path, sizeof access->path, "%s/tokens.json", options->folder);
    if (getrandom(access->session_key, sizeof access->session_key, 0) != (ssize_t)sizeof access->session_key)
        status = groom_fail(diag, GROOM_EIO, "no random numbers");
    else
        status = load(access, true, diag);
    if (status != GROOM_OK) {
        access_close(access);
        return status;
    }
    *out = access;
    return GROOM_OK;
}

void access_close(struct access *access)
{
    if (!access)
        return;
    OPENSSL_cleanse(access->session_key, sizeof access->session_key);
    access_list_finish(&access->list);
    free(access->buckets);
    pthread_mutex_destroy(&access->lock);
    free(access);
}

/* --- asking ---------------------------------------------------------------------------------- */

static bool is_usable(const struct access_token *token, int64_t now)
{
    return !token->revoked_ms && (!token->expires_ms || token->expires_ms > now);
}

bool access_is_open(struct access *access)
{
    pthread_mutex_lock(&access->lock);
    refresh(access);
    bool open = access->list.n == 0;
    pthread_mutex_unlock(&access->lock);
    return open;
}

bool access_has_usable(struct access *access)
{
    int64_t now = clock_ms(CLOCK_REALTIME);
    bool found = false;
    pthread_mutex_lock(&access->lock);
    refresh(access);
    for (size_t i = 0; i < access->list.n; i++)
        found |= is_usable(&access->list.items[i], now);
    pthread_mutex_unlock(&access->lock);
    return found;
}

static void fill_in(const struct access_limits *defaults, struct access_limits *limits)
{
    if (!limits->requests_per_s)
        limits->requests_per_s = defaults->requests_per_s;
    if (!limits->bytes)
        limits->bytes = defaults->bytes;
    if (!limits->queued)
        limits->queued = defaults->queued;
}

/* The lock is held; i = n: there is none. */
static groom_status hand_out(struct access *access, size_t i, struct access_token *found, struct groom_diag *diag)
{
    if (i == access->list.n)
        return groom_fail(diag, GROOM_ENOTFOUND, "this token is not known here");
    const struct access_token *token = &access->list.items[i];
    if (!is_usable(token, clock_ms(CLOCK_REALTIME)))
        return groom_fail(diag, GROOM_ENOTFOUND, "this token %s; ask for a new one",
                          token->revoked_ms ? "is revoked" : "has expired");
    *found = *token;
    fill_in(&access->options.defaults, &found->limits);
    return GROOM_OK;
}

/* Every entry is compared, whichever it is. */
groom_status access_find(struct access *access, const char *token, struct access_token *found,
                         struct groom_diag *diag)
{
    unsigned char hash[EVP_MAX_MD_SIZE];
    EVP_Digest(token, strlen(token), hash, NULL, EVP_sha256(), NULL);
    pthread_mutex_lock(&access->lock);
    refresh(access);
    size_t at = access->list.n;
    for (size_t i = 0; i < access->list.n; i++)
        if (CRYPTO_memcmp(access->list.items[i].hash, hash, ACCESS_HASH_SIZE) == 0)
            at = i;
    groom_status status = hand_out(access, at, found, diag);
    pthread_mutex_unlock(&access->lock);
    return status;
}

groom_status access_find_id(struct access *access, const char *id, struct access_token *found,
                            struct groom_diag *diag)
{
    pthread_mutex_lock(&access->lock);
    refresh(access);
    groom_status status = hand_out(access, find_id(&access->list, id), found, diag);
    pthread_mutex_unlock(&access->lock);
    return status;
}

/* A token bucket. */
static int64_t take(struct bucket *bucket, double per_s, int64_t now)
{
    double most = per_s * BURST_S;
    double level = bucket->at_ms ? bucket->level + (double)(now - bucket->at_ms) * 1e-3 * per_s : most;
    bucket->at_ms = now;
    bucket->level = level < most ? level : most;
    if (bucket->level >= 1) {
        bucket->level -= 1;
        return 0;
    }
    return 1 + (int64_t)((1 - bucket->level) / per_s * 1e3);
}

int64_t access_take_turn(struct access *access, const struct access_token *token)
{
    int64_t wait_ms = 0;
    if (!token->limits.requests_per_s)
        return 0;
    pthread_mutex_lock(&access->lock);
    size_t i = find_id(&access->list, token->id);
    if (i < access->list.n)
        wait_ms = take(&access->buckets[i], (double)token->limits.requests_per_s, clock_ms(CLOCK_MONOTONIC));
    pthread_mutex_unlock(&access->lock);
    return wait_ms;
}

/* --- sessions: "<token id>.<until, seconds>.<HMAC-SHA256 of both>" -------------------------------- */

static void sign(const struct access *access, const char *text, char hex[65])
{
    unsigned char mac[EVP_MAX_MD_SIZE] = {0};
    HMAC(EVP_sha256(), access->session_key, sizeof access->session_key, (const unsigned char *)text, strlen(text), mac,
         NULL);
    for (int i = 0; i < 32; i++)
        snprintf(hex + 2 * i, 3, "%02x", mac[i]);
}

void access_session_make(struct access *access, const char *token_id, int64_t until_ms,
                         char session[ACCESS_SESSION_SIZE])
{
    char hex[65];
    int n = snprintf(session, ACCESS_SESSION_SIZE, "%.63s.%lld", token_id, (long long)(until_ms / 1000));
    sign(access, session, hex);
    snprintf(session + n, ACCESS_SESSION_SIZE - (size_t)n, ".%s", hex);
}

groom_status access_session_find(struct access *access, const char *session, struct access_token *found,
                                 struct groom_diag *diag)
{
    char text[ACCESS_SESSION_SIZE], hex[65];
    snprintf(text, sizeof text, "%s", session);
    char *mac = strrchr(text, '.');
    if (mac)
        *mac++ = 0;
    char *until = strrchr(text, '.');
    if (!mac || !until || strlen(session) >= sizeof text || strlen(mac) != 64)
        return groom_fail(diag, GROOM_ENOTFOUND, "this is no session; sign in again");
    sign(access, text, hex);
    if (CRYPTO_memcmp(mac, hex, 64) != 0 || strtoll(until + 1, NULL, 10) * 1000 <= clock_ms(CLOCK_REALTIME))
        return groom_fail(diag, GROOM_ENOTFOUND, "this session has ended; sign in again");
    *until = 0;
    return access_find_id(access, text, found, diag);
}
