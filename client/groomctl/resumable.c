#include "client/groomctl/resumable.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define MAX_TRIES   12 /* in a row that bring nothing; about a minute and a half */
#define MAX_WAIT_MS 15000

struct resumable {
    struct groomctl *ctl;
    int fd;
    uint64_t n_bytes, offset;
    const char *name;
    char state[PATH_MAX]; /* the file that remembers the upload; "" where none can be kept */
    char upload[256];     /* "/v1/uploads/upl_…"; "" before it is made */
};

/* --- what is remembered --------------------------------------------------------------------- */

/* FNV-1a: it names a file of our own, nobody's word is taken for it. */
static uint64_t hash_text(const char *text)
{
    uint64_t hash = 14695981039346656037u;
    for (; *text; text++)
        hash = (hash ^ (unsigned char)*text) * 1099511628211u;
    return hash;
}

static bool make_folders(char *path)
{
    for (char *slash = strchr(path + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = 0;
        bool made = mkdir(path, 0700) == 0 || errno == EEXIST;
        *slash = '/';
        if (!made)
            return false;
    }
    return true;
}

static void find_state(struct resumable *r, const char *path)
{
    char full[PATH_MAX], key[PATH_MAX + 512];
    const char *base = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    struct stat info;
    if ((!base || !*base) && !home)
        return;
    if (!realpath(path, full) || fstat(r->fd, &info))
        return;
    snprintf(key, sizeof key, "%s\n%s\n%lld\n%lld.%09ld", http_client_base_url(r->ctl->client), full,
             (long long)info.st_size, (long long)info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
    bool own = base && *base;
    int n = snprintf(r->state, sizeof r->state, "%s%s/groomctl/upload-%016llx", own ? base : home,
                     own ? "" : "/.local/state", (unsigned long long)hash_text(key));
    if (n < 0 || (size_t)n >= sizeof r->state || !make_folders(r->state))
        r->state[0] = 0;
}

static void recall(struct resumable *r)
{
    FILE *file = r->state[0] ? fopen(r->state, "r") : NULL;
    if (!file)
        return;
    if (!fgets(r->upload, sizeof r->upload, file) || strncmp(r->upload, "/v1/uploads/", 12))
        r->upload[0] = 0;
    r->upload[strcspn(r->upload, "\n")] = 0;
    fclose(file);
}

static void remember(const struct resumable *r)
{
    int fd = r->state[0] ? open(r->state, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600) : -1;
    if (fd < 0)
        return;
    if (dprintf(fd, "%s\n", r->upload) < 0)
        unlink(r->state);
    close(fd);
}

static void forget(const struct resumable *r)
{
    if (r->state[0])
        unlink(r->state);
}

/* --- calls ---------------------------------------------------------------------------------- */

#define VERSION "Tus-Resumable: 1.0.0"

/* Where the upload is by now. returns  false where it is not there (any more) */
static bool ask(struct resumable *r, http_outcome *outcome)
{
    struct http_request request = {.method = "HEAD", .path = r->upload, .headers = {VERSION}};
    struct http_response response;
    *outcome = http_perform(r->ctl->client, &request, &response);
    bool there = *outcome == HTTP_ANSWERED && response.status == 200 && response.upload_offset >= 0 &&
                 response.upload_length == (long long)r->n_bytes;
    if (there)
        r->offset = (uint64_t)response.upload_offset;
    http_response_finish(&response);
    return there;
}

/* *spoken false: this server knows no uploads in pieces. */
static int create(struct resumable *r, bool *spoken)
{
    char length[64];
    struct http_response response;
    snprintf(length, sizeof length, "Upload-Length: %llu", (unsigned long long)r->n_bytes);
    struct http_request request = {.method = "POST", .path = "/v1/uploads", .headers = {VERSION, length}};
    http_outcome outcome = http_perform(r->ctl->client, &request, &response);
    bool made = outcome == HTTP_ANSWERED && response.status == 201 && response.location[0] == '/';
    int status = DONE;
    *spoken = !(outcome == HTTP_ANSWERED && (response.status == 404 || response.status == 405));
    if (made) {
        snprintf(r->upload, sizeof r->upload, "%s", response.location);
        r->offset = 0;
        remember(r);
    } else if (*spoken) {
        status = api_complain(r->ctl, outcome, &response);
    }
    http_response_finish(&response);
    return status;
}

/* The rest, in one piece. */
static http_outcome send_rest(struct resumable *r, struct http_response *response)
{
    struct sending sending;
    char offset[64];
    snprintf(offset, sizeof offset, "Upload-Offset: %llu", (unsigned long long)r->offset);
    sending_init(&sending, r->name, r->offset, r->n_bytes);
    struct http_request request = {.method = "PATCH",
                                   .path = r->upload,
                                   .headers = {VERSION, offset},
                                   .content_type = "application/offset+octet-stream",
                                   .body_fd = r->fd,
                                   .n_body = r->n_bytes - r->offset,
                                   .sent = r->ctl->is_terminal && !r->ctl->json ? sending_draw : NULL,
                                   .user = &sending,
                                   .idle_timeout_s = 60};
    memset(response, 0, sizeof *response);
    http_outcome outcome = HTTP_BROKEN;
    if (lseek(r->fd, (off_t)r->offset, SEEK_SET) >= 0)
        outcome = http_perform(r->ctl->client, &request, response);
    sending_clear(&sending);
    return outcome;
}

/* --- going on -------------------------------------------------------------------------------- */

/* What another try may mend. */
static bool is_passing(http_outcome outcome, int status)
{
    if (outcome == HTTP_ANSWERED)
        return status == 409 || status == 423 || status == 429 || status == 502 || status == 503 || status == 504;
    return outcome == HTTP_BROKEN || outcome == HTTP_UNREACHABLE;
}

/* returns  false where Ctrl-C came */
static bool wait_for(int try)
{
    int ms = try == 0 ? 0 : 250 << (try < 7 ? try : 7);
    struct timespec nap = {0, 50000000};
    for (int waited = 0; waited < (ms < MAX_WAIT_MS ? ms : MAX_WAIT_MS); waited += 50) {
        if (groomctl_interrupted())
            return false;
        nanosleep(&nap, NULL);
    }
    return !groomctl_interrupted();
}

static int say_interrupted(const struct resumable *r)
{
    if (r->state[0])
        fputs("groomctl: interrupted; the same command goes on where this one ended\n", stderr);
    else
        fprintf(stderr, "groomctl: interrupted; nothing of %s was kept\n", r->name);
    return INTERRUPTED;
}

/* All of it, try after try as long as they bring something. */
static int send_all(struct resumable *r)
{
    struct http_response response;
    http_outcome outcome;
    for (int try = 0; r->offset < r->n_bytes;) {
        uint64_t before = r->offset;
        outcome = send_rest(r, &response);
        bool done = outcome == HTTP_ANSWERED && response.status == 204;
        if (done)
            r->offset = response.upload_offset > (long long)before ? (uint64_t)response.upload_offset : before;
        else if (outcome == HTTP_INTERRUPTED || groomctl_interrupted()) {
            http_response_finish(&response);
            return say_interrupted(r);
        } else if (!is_passing(outcome, response.status) || try >= MAX_TRIES) {
            int status = api_complain(r->ctl, outcome, &response);
            http_response_finish(&response);
            return status;
        }
        http_response_finish(&response);
        if (!done && !wait_for(try))
            return say_interrupted(r);
        if (!done && !ask(r, &outcome) && outcome == HTTP_ANSWERED) {
            fputs("groomctl: the server has dropped the upload; do it again\n", stderr);
            forget(r);
            return REFUSED;
        }
        try = r->offset > before ? 0 : try + 1;
    }
    return DONE;
}

/* The collection takes it; asked again where the answer was lost. */
static int use(struct resumable *r, const struct url *url, cJSON **answer)
{
    struct url full = *url;
    struct http_response response;
    url_query(&full, "upload", r->upload + strlen("/v1/uploads/"));
    for (int try = 0;; try++) {
        struct http_request request = {.method = "POST", .path = full.text, .idle_timeout_s = 300};
        http_outcome outcome = http_perform(r->ctl->client, &request, &response);
        bool done = outcome == HTTP_ANSWERED && response.status >= 200 && response.status < 300;
        if (done || !is_passing(outcome, response.status) || try >= MAX_TRIES || !wait_for(try + 1)) {
            int status = done ? DONE : api_complain(r->ctl, outcome, &response);
            *answer = done ? cJSON_ParseWithLength(response.body, response.n_body) : NULL;
            if (done || outcome == HTTP_ANSWERED)
                forget(r);
            http_response_finish(&response);
            return status;
        }
        http_response_finish(&response);
    }
}

bool upload_resumable(struct groomctl *ctl, const struct url *url, int fd, uint64_t n_bytes, const char *path,
                      int *status, cJSON **answer)
{
    const char *slash = strrchr(path, '/');
    struct resumable r = {.ctl = ctl, .fd = fd, .n_bytes = n_bytes, .name = slash ? slash + 1 : path};
    http_outcome outcome;
    bool spoken = true;
    *status = DONE;
    find_state(&r, path);
    recall(&r);
    if (r.upload[0] && ask(&r, &outcome)) {
        if (r.offset && !ctl->json)
            fprintf(stderr, "going on from %.1f of %.1f MB\n", (double)r.offset * 1e-6, (double)n_bytes * 1e-6);
    } else {
        *status = create(&r, &spoken);
    }
    if (!spoken)
        return false;
    if (*status == DONE)
        *status = send_all(&r);
    if (*status == DONE)
        *status = use(&r, url, answer);
    return true;
}
