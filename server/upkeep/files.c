#include "server/upkeep/files.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <openssl/evp.h>

#define PIECE ((size_t)1 << 20)

static groom_status fail(struct groom_diag *diag, const char *path)
{
    switch (errno) {
    case ENOSPC: case EDQUOT: case EFBIG: return groom_fail(diag, GROOM_ENOSPC, "%.300s: the disk is full", path);
    case ENOENT: return groom_fail(diag, GROOM_ENOTFOUND, "%.300s is not there", path);
    default: return groom_fail(diag, GROOM_EIO, "%.300s: %s", path, strerror(errno));
    }
}

static groom_status write_all(int fd, const char *bytes, size_t n, const char *path, struct groom_diag *diag)
{
    while (n > 0) {
        ssize_t wrote = write(fd, bytes, n);
        if (wrote < 0 && errno != EINTR)
            return fail(diag, path);
        bytes += wrote > 0 ? wrote : 0;
        n -= wrote > 0 ? (size_t)wrote : 0;
    }
    return GROOM_OK;
}

/* Bytes of `in`, at most n_bytes of them, through the hash and into `out` (-1: nowhere). */
static groom_status pump(int in, int out, const char *path, const char *to, uint64_t *n_bytes, EVP_MD_CTX *hash,
                         struct groom_diag *diag)
{
    char *piece = malloc(PIECE);
    uint64_t done = 0;
    groom_status status = piece ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to read a file");
    while (status == GROOM_OK && done < *n_bytes) {
        uint64_t left = *n_bytes - done;
        ssize_t got = read(in, piece, left < PIECE ? (size_t)left : PIECE);
        if (got == 0)
            break;
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            status = fail(diag, path);
        else if (EVP_DigestUpdate(hash, piece, (size_t)got) != 1)
            status = groom_fail(diag, GROOM_EINTERNAL, "hashing failed");
        else if (out >= 0)
            status = write_all(out, piece, (size_t)got, to, diag);
        done += got > 0 ? (uint64_t)got : 0;
    }
    free(piece);
    *n_bytes = done;
    return status;
}

static groom_status hash_into(int in, int out, const char *path, const char *to, uint64_t *n_bytes,
                              char sha256[BLOBS_HASH_SIZE], struct groom_diag *diag)
{
    unsigned char digest[EVP_MAX_MD_SIZE];
    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    groom_status status;
    if (!hash || EVP_DigestInit_ex(hash, EVP_sha256(), NULL) != 1)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a hash");
    else
        status = pump(in, out, path, to, n_bytes, hash, diag);
    if (status == GROOM_OK && EVP_DigestFinal_ex(hash, digest, NULL) != 1)
        status = groom_fail(diag, GROOM_EINTERNAL, "hashing failed");
    for (int i = 0; status == GROOM_OK && sha256 && i < 32; i++)
        snprintf(sha256 + 2 * i, 3, "%02x", digest[i]);
    EVP_MD_CTX_free(hash);
    return status;
}

groom_status file_hash(const char *path, uint64_t *n_bytes, char sha256[BLOBS_HASH_SIZE], struct groom_diag *diag)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        return fail(diag, path);
    *n_bytes = UINT64_MAX;
    groom_status status = hash_into(fd, -1, path, NULL, n_bytes, sha256, diag);
    close(fd);
    return status;
}

groom_status file_copy(const char *from, const char *to, uint64_t n_bytes, char sha256[BLOBS_HASH_SIZE],
                       struct groom_diag *diag)
{
    uint64_t n = n_bytes;
    int in = open(from, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (in < 0)
        return fail(diag, from);
    int out = open(to, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
    groom_status status = out >= 0 ? hash_into(in, out, from, to, &n, sha256, diag) : fail(diag, to);
    if (status == GROOM_OK && n_bytes != UINT64_MAX && n < n_bytes)
        status = groom_fail(diag, GROOM_ETRUNCATED, "%.300s has %llu bytes, not %llu", from, (unsigned long long)n,
                            (unsigned long long)n_bytes);
    if (status == GROOM_OK && fsync(out) != 0)
        status = fail(diag, to);
    close(in);
    if (out >= 0)
        close(out);
    return status;
}

groom_status file_link(const char *from, const char *to, bool *linked, struct groom_diag *diag)
{
    *linked = linkat(AT_FDCWD, from, AT_FDCWD, to, 0) == 0;
    if (*linked || errno == EXDEV || errno == EPERM || errno == EOPNOTSUPP || errno == EMLINK)
        return GROOM_OK;
    return fail(diag, from);
}

groom_status folder_make(const char *path, bool may_exist, struct groom_diag *diag)
{
    if (mkdir(path, 0700) == 0 || (errno == EEXIST && may_exist))
        return GROOM_OK;
    if (errno == EEXIST)
        return groom_fail(diag, GROOM_ECONFLICT, "%.300s is there already: name a new folder", path);
    return fail(diag, path);
}

groom_status folder_sync(const char *path, struct groom_diag *diag)
{
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    groom_status status = fd >= 0 && fsync(fd) == 0 ? GROOM_OK : fail(diag, path);
    if (fd >= 0)
        close(fd);
    return status;
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *place)
{
    (void)info, (void)kind, (void)place;
    remove(path);
    return 0;
}

void folder_remove(const char *path) { nftw(path, remove_one, 16, FTW_DEPTH | FTW_PHYS); }
