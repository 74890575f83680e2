/* A piece of an upload: open where the last ended, write, verify, finish. */
#include "server/uploads/writers.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static groom_status refuse(enum upload_refusal *refusal, enum upload_refusal why)
{
    *refusal = why;
    return GROOM_ECONFLICT;
}

static groom_status io_failure(struct groom_diag *diag, const char *what)
{
    bool full = errno == ENOSPC || errno == EDQUOT || errno == EFBIG;
    return groom_fail(diag, full ? GROOM_ENOSPC : GROOM_EIO, "%s: %s", what, full ? "the disk is full" : strerror(errno));
}

/* --- open ---------------------------------------------------------------------------------- */

/* What lies beyond the durable bytes was never acknowledged. */
static groom_status open_file(struct upload_writer *writer, struct groom_diag *diag)
{
    char path[1500];
    struct stat info;
    uploads_path(writer->uploads, writer->id, path, sizeof path);
    writer->fd = open(path, O_WRONLY | O_CLOEXEC | O_NOFOLLOW);
    if (writer->fd < 0 || fstat(writer->fd, &info) != 0)
        return io_failure(diag, "opening an upload");
    if ((uint64_t)info.st_size < writer->offset)
        return groom_fail(diag, GROOM_EFORMAT, "%llu of the %llu bytes that were received are left: start anew",
                          (unsigned long long)info.st_size, (unsigned long long)writer->offset);
    if (((uint64_t)info.st_size > writer->offset && ftruncate(writer->fd, (off_t)writer->offset) != 0) ||
        lseek(writer->fd, (off_t)writer->offset, SEEK_SET) < 0)
        return io_failure(diag, "opening an upload");
    return GROOM_OK;
}

static groom_status start_hash(struct upload_writer *writer, const struct upload_checksum *checksum,
                               struct groom_diag *diag)
{
    writer->is_verified = !checksum || !checksum->algorithm;
    if (writer->is_verified)
        return GROOM_OK;
    const EVP_MD *md = !strcmp(checksum->algorithm, "sha256") ? EVP_sha256() : EVP_sha1();
    writer->checksum = *checksum;
    writer->hash = EVP_MD_CTX_new();
    if (!writer->hash || EVP_DigestInit_ex(writer->hash, md, NULL) != 1)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a hash");
    return GROOM_OK;
}

static groom_status begin_at(struct upload_writer *writer, uint64_t offset, const struct upload_checksum *checksum,
                             enum upload_refusal *refusal, struct groom_diag *diag)
{
    struct store_upload row = {0};
    groom_status status = store_upload_get(writer->uploads->options.store, writer->id, &row, diag);
    if (status != GROOM_OK)
        return status;
    if (row.sha256[0])
        status = refuse(refusal, UPLOAD_TAKEN);
    else if (row.n_durable != offset)
        status = groom_fail(diag, refuse(refusal, UPLOAD_OFFSET), "the upload ends at %llu, not at %llu",
                            (unsigned long long)row.n_durable, (unsigned long long)offset);
    writer->n_bytes = row.n_bytes;
    writer->offset = writer->n_written = writer->n_durable = row.n_durable;
    store_upload_finish(&row);
    if (status == GROOM_OK)
        status = start_hash(writer, checksum, diag);
    return status == GROOM_OK ? open_file(writer, diag) : status;
}

groom_status upload_open(struct uploads *uploads, const char *id, uint64_t offset,
                         const struct upload_checksum *checksum, struct upload_writer **writer,
                         enum upload_refusal *refusal, struct groom_diag *diag)
{
    struct upload_writer *entered;
    struct store_upload row = {0};
    /* first whether it is there: nobody is to enter under names that he makes up */
    groom_status status = store_upload_get(uploads->options.store, id, &row, diag);
    store_upload_finish(&row);
    if (status != GROOM_OK)
        return status;
    if ((status = writer_enter(uploads, id, false, &entered, diag)) != GROOM_OK)
        return status == GROOM_ECONFLICT ? refuse(refusal, UPLOAD_BUSY) : status;
    if ((status = begin_at(entered, offset, checksum, refusal, diag)) != GROOM_OK) {
        writer_leave(entered);
        return status;
    }
    writer_ready(entered);
    *writer = entered;
    return GROOM_OK;
}

/* --- bytes ------------------------------------------------------------------------------------ */

uint64_t upload_room(const struct upload_writer *writer) { return writer->n_bytes - writer->n_written; }

static groom_status write_all(struct upload_writer *writer, const char *bytes, size_t n, struct groom_diag *diag)
{
    while (n > 0) {
        ssize_t wrote = writer->uploads->options.system->write(writer->fd, bytes, n);
        if (wrote < 0 && errno == EINTR)
            continue;
        if (wrote < 0)
            return io_failure(diag, "writing an upload");
        writer->n_written += (uint64_t)wrote;
        bytes += wrote;
        n -= (size_t)wrote;
    }
    return GROOM_OK;
}

groom_status upload_write(struct upload_writer *writer, const void *bytes, size_t n, struct groom_diag *diag)
{
    groom_status status;
    atomic_store(&writer->heard_ms, uploads_clock_ms());
    pthread_mutex_lock(&writer->io);
    if (writer->revoked)
        status = groom_fail(diag, GROOM_ECONFLICT, "another request has taken this upload over");
    else if (writer->broken)
        status = groom_fail(diag, GROOM_EIO, "the disk has failed; ask for the offset and go on from there");
    else if (n > upload_room(writer))
        status = groom_fail(diag, GROOM_ETOOBIG, "the upload is to have %llu bytes, and more were sent",
                            (unsigned long long)writer->n_bytes);
    else
        status = write_all(writer, bytes, n, diag);
    if (status == GROOM_OK && writer->hash && EVP_DigestUpdate(writer->hash, bytes, n) != 1)
        status = groom_fail(diag, GROOM_EINTERNAL, "hashing an upload failed");
    pthread_mutex_unlock(&writer->io);
    return status;
}

/* --- the end ------------------------------------------------------------------------------------ */

static groom_status verify(struct upload_writer *writer, enum upload_refusal *refusal, struct groom_diag *diag)
{
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned n = 0;
    if (!writer->hash)
        return GROOM_OK;
    if (EVP_DigestFinal_ex(writer->hash, digest, &n) != 1)
        return groom_fail(diag, GROOM_EINTERNAL, "hashing an upload failed");
    if (n != writer->checksum.n_digest || memcmp(digest, writer->checksum.digest, n) != 0)
        return groom_fail(diag, refuse(refusal, UPLOAD_CHECKSUM),
                          "the piece is not what its %s says: send it again from %llu", writer->checksum.algorithm,
                          (unsigned long long)writer->offset);
    pthread_mutex_lock(&writer->io);
    writer->is_verified = true;
    pthread_mutex_unlock(&writer->io);
    return GROOM_OK;
}

/* Nothing of it counts unless all of it is durable. */
static groom_status settle_all(struct upload_writer *writer, struct groom_diag *diag)
{
    groom_status status = writer_settle(writer, diag);
    pthread_mutex_lock(&writer->io);
    if (status == GROOM_OK && writer->revoked)
        status = groom_fail(diag, GROOM_ECONFLICT, "another request has taken this upload over");
    else if (status == GROOM_OK && writer->broken)
        status = groom_fail(diag, GROOM_EIO, "the disk has failed; ask for the offset and go on from there");
    pthread_mutex_unlock(&writer->io);
    return status;
}

groom_status upload_finish(struct upload_writer *writer, uint64_t *offset, int64_t *expires_ms,
                           enum upload_refusal *refusal, struct groom_diag *diag)
{
    groom_status status = verify(writer, refusal, diag);
    if (status == GROOM_OK)
        status = settle_all(writer, diag);
    if (status == GROOM_OK) {
        *offset = writer->n_written;
        *expires_ms = store_now_ms() + writer->uploads->options.expiry_ms;
    }
    writer_leave(writer);
    return status;
}

void upload_abandon(struct upload_writer *writer)
{
    if (!writer)
        return;
    struct uploads *uploads = writer->uploads;
    pthread_mutex_lock(&uploads->lock);
    writer->ended = true;
    pthread_cond_signal(&uploads->wake);
    pthread_mutex_unlock(&uploads->lock);
    writer_release(writer);
}
