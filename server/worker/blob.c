#include "server/worker/blob.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/work.h"

static groom_status verify(const struct order_blob *name, const struct blob *blob, struct groom_diag *diag)
{
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned n = 0;
    char hexadecimal[ORDER_HASH_SIZE];
    if (!EVP_Digest(blob->bytes, blob->n_bytes, digest, &n, EVP_sha256(), NULL) ||
        2 * n + 1 != sizeof hexadecimal)
        return groom_fail(diag, GROOM_EINTERNAL, "SHA-256 cannot be computed");
    for (unsigned i = 0; i < n; i++)
        snprintf(hexadecimal + 2 * i, 3, "%02x", digest[i]);
    if (!strcmp(hexadecimal, name->sha256))
        return GROOM_OK;
    return groom_fail(diag, GROOM_EIO, "the bytes named %.16s... are others (%.16s..., %zu of %llu bytes)",
                      name->sha256, hexadecimal, blob->n_bytes, (unsigned long long)name->n_bytes);
}

/* --- from a shared folder -------------------------------------------------------------------- */

static int map_file(const struct order_blob *name, struct blob *blob)
{
    struct stat status;
    int fd = open(name->path, O_RDONLY | O_CLOEXEC);
    void *map = MAP_FAILED;
    if (fd >= 0 && !fstat(fd, &status) && S_ISREG(status.st_mode) && status.st_size > 0 &&
        (uint64_t)status.st_size == name->n_bytes)
        map = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (fd >= 0)
        close(fd);
    if (map == MAP_FAILED)
        return 0;
    *blob = (struct blob){.bytes = map, .n_bytes = (size_t)name->n_bytes, .is_map = 1};
    return 1;
}

/* --- over HTTP ---------------------------------------------------------------------------------- */

struct reception {
    struct blob *blob;
    size_t capacity;
};

static void begin(void *user)
{
    struct reception *r = user;
    r->blob->n_bytes = 0;
}

/* More bytes than were announced are dropped here and found out by their hash. */
static size_t receive(void *user, const char *bytes, size_t n)
{
    struct reception *r = user;
    size_t room = r->capacity - r->blob->n_bytes, taken = n < room ? n : room;
    memcpy(r->blob->bytes + r->blob->n_bytes, bytes, taken);
    r->blob->n_bytes += taken;
    return n;
}

static groom_status download_once(struct work_link *link, const struct order_blob *name, struct blob *blob,
                                  struct groom_diag *diag)
{
    char path[sizeof WORK_PATH_BLOBS + ORDER_HASH_SIZE + 1];
    struct reception reception = {blob, (size_t)name->n_bytes};
    struct http_request request = {
        .method = "GET", .path = path, .sink = receive, .begin = begin, .user = &reception};
    snprintf(path, sizeof path, "%s/%s", WORK_PATH_BLOBS, name->sha256);
    groom_status st = work_link_call(link, &request, NULL, diag);
    return st == GROOM_OK ? verify(name, blob, diag) : st;
}

static groom_status download(struct work_link *link, const struct order_blob *name, struct blob *blob,
                             struct groom_diag *diag)
{
    blob->bytes = malloc((size_t)name->n_bytes + 1);
    if (!blob->bytes)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for an input of %llu bytes",
                          (unsigned long long)name->n_bytes);
    groom_status st = download_once(link, name, blob, diag);
    if (st != GROOM_OK)
        blob_release(blob);
    return st;
}

groom_status blob_fetch(struct work_link *link, const struct order_blob *name, struct blob *blob,
                        struct groom_diag *diag)
{
    memset(blob, 0, sizeof *blob);
    if (name->path[0] && map_file(name, blob)) {
        if (verify(name, blob, NULL) == GROOM_OK)
            return GROOM_OK;
        blob_release(blob);
    }
    return download(link, name, blob, diag);
}

void blob_release(struct blob *blob)
{
    if (blob->is_map)
        munmap(blob->bytes, blob->n_bytes);
    else
        free(blob->bytes);
    memset(blob, 0, sizeof *blob);
}
