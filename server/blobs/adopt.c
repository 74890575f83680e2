/* Files that become blobs as they are, and pins on blobs that are there. */
#include "server/blobs/folder.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <openssl/evp.h>

#define PIECE ((size_t)1 << 20)

/* Every byte of fd from its beginning to `take`. */
static groom_status read_all(int fd, groom_status (*take)(void *user, const char *bytes, size_t n,
                                                          struct groom_diag *diag),
                             void *user, struct groom_diag *diag)
{
    char *piece = malloc(PIECE);
    off_t at = 0;
    ssize_t got = 0;
    groom_status status = piece ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to read a file");
    while (status == GROOM_OK && (got = pread(fd, piece, PIECE, at)) != 0) {
        if (got > 0)
            status = take(user, piece, (size_t)got, diag);
        else if (errno != EINTR)
            status = blobs_fail(diag, errno, "reading an upload");
        at += got > 0 ? got : 0;
    }
    free(piece);
    return status;
}

static groom_status take_into_hash(void *user, const char *bytes, size_t n, struct groom_diag *diag)
{
    return EVP_DigestUpdate(user, bytes, n) == 1 ? GROOM_OK : groom_fail(diag, GROOM_EINTERNAL, "hashing failed");
}

static groom_status hash_file(int fd, char sha256[BLOBS_HASH_SIZE], struct groom_diag *diag)
{
    unsigned char digest[EVP_MAX_MD_SIZE];
    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    groom_status status;
    if (!hash || EVP_DigestInit_ex(hash, EVP_sha256(), NULL) != 1)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a hash");
    else
        status = read_all(fd, take_into_hash, hash, diag);
    if (status == GROOM_OK && EVP_DigestFinal_ex(hash, digest, NULL) != 1)
        status = groom_fail(diag, GROOM_EINTERNAL, "hashing failed");
    for (int i = 0; status == GROOM_OK && i < 32; i++)
        snprintf(sha256 + 2 * i, 3, "%02x", digest[i]);
    EVP_MD_CTX_free(hash);
    return status;
}

/* With a second name, pinned from the moment that it can be seen. *linked false: another file system. */
static groom_status link_blob(struct blobs *blobs, const char *path, const char *sha256, bool *linked,
                              struct groom_diag *diag)
{
    char name[BLOBS_NAME_SIZE];
    groom_status status = GROOM_OK;
    blob_name(sha256, name);
    pthread_mutex_lock(&blobs->lock);
    if (!pin_add(blobs, sha256)) {
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a pin");
    } else if (linkat(AT_FDCWD, path, blobs->fd, name, 0) != 0 && errno != EEXIST) {
        pin_drop(blobs, sha256);
        *linked = false;
        if (errno != EXDEV && errno != EPERM && errno != EOPNOTSUPP)
            status = blobs_fail(diag, errno, "naming a blob");
    }
    pthread_mutex_unlock(&blobs->lock);
    return status;
}

static groom_status take_into_writer(void *user, const char *bytes, size_t n, struct groom_diag *diag)
{
    return blobs_write(user, bytes, n, diag);
}

static groom_status copy_blob(struct blobs *blobs, int fd, char sha256[BLOBS_HASH_SIZE], struct groom_diag *diag)
{
    struct blobs_writer *writer;
    groom_status status = blobs_begin(blobs, 0, &writer, diag);
    if (status != GROOM_OK)
        return status;
    if ((status = read_all(fd, take_into_writer, writer, diag)) == GROOM_OK)
        return blobs_commit(writer, NULL, sha256, diag);
    blobs_abort(writer);
    return status;
}

groom_status blobs_adopt(struct blobs *blobs, const char *path, char sha256[BLOBS_HASH_SIZE],
                         struct groom_diag *diag)
{
    char hash[BLOBS_HASH_SIZE];
    bool linked = true;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        return blobs_fail(diag, errno, "opening an upload");
    groom_status status = hash_file(fd, hash, diag);
    if (status == GROOM_OK && blobs->system->sync(fd) != 0)
        status = blobs_fail(diag, errno, "syncing an upload");
    if (status == GROOM_OK)
        status = link_blob(blobs, path, hash, &linked, diag);
    if (status == GROOM_OK && !linked)
        status = copy_blob(blobs, fd, hash, diag);
    else if (status == GROOM_OK && (status = sync_folder(blobs, hash, diag)) != GROOM_OK)
        blobs_unpin(blobs, hash);
    close(fd);
    if (status == GROOM_OK)
        memcpy(sha256, hash, BLOBS_HASH_SIZE);
    return status;
}

groom_status blobs_pin(struct blobs *blobs, const char *sha256, struct groom_diag *diag)
{
    char name[BLOBS_NAME_SIZE];
    groom_status status = GROOM_OK;
    if (!blobs_is_hash(sha256))
        return groom_fail(diag, GROOM_EINVAL, "a blob is named by 64 lower-case hexadecimal digits");
    blob_name(sha256, name);
    pthread_mutex_lock(&blobs->lock);
    if (!pin_add(blobs, sha256)) {
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a pin");
    } else if (faccessat(blobs->fd, name, R_OK, AT_SYMLINK_NOFOLLOW) != 0) {
        status = errno == ENOENT ? groom_fail(diag, GROOM_ENOTFOUND, "there is no blob %s", sha256)
                                 : blobs_fail(diag, errno, "looking for a blob");
        pin_drop(blobs, sha256);
    }
    pthread_mutex_unlock(&blobs->lock);
    return status;
}
