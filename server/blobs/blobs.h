/* Content-addressed files: uploads and checkpoints, named by the SHA-256 of their bytes.
 *
 * A blob is written to a temporary name, synced, renamed to blobs/ab/abcdef…, and its folder synced;
 * then its row is written (server/store). So a row never names a missing blob, and a half-written
 * one is never visible. A blob without a row is garbage, for the collector.
 *
 * A committed blob is pinned until blobs_unpin, so that the collector cannot take it between its
 * commit and its row:
 *     blobs_commit → store_…_put → blobs_unpin
 *
 * threads   any; a writer belongs to one thread at a time */
#ifndef BLOBS_BLOBS_H
#define BLOBS_BLOBS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "groom/diag.h"

#define BLOBS_HASH_SIZE 65 /* SHA-256 in lower-case hexadecimal */

struct blobs;
struct blobs_writer;

/* The seam below: what reaches the file system. Tests make each call fail in turn. */
struct blobs_system {
    ssize_t (*write)(int fd, const void *bytes, size_t n);
    int (*preallocate)(int fd, off_t n_bytes); /* -1 and errno; ENOSPC refuses the writer */
    int (*sync)(int fd);
    int (*rename)(int folder_fd, const char *from, const char *to);
};
extern const struct blobs_system blobs_default_system;

/* Open (or make) a folder of blobs; temporaries that a killed daemon left are removed.
 * system  NULL: blobs_default_system
 * returns GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status blobs_open(const char *folder, const struct blobs_system *system,
                                         struct blobs **blobs, struct groom_diag *diag);
void blobs_close(struct blobs *blobs); /* takes NULL; no writer may be left */

/* --- writing ------------------------------------------------------------------------ */

/* Start a blob. n_expected: its size where known (room is set aside at once), or 0.
 * returns GROOM_ENOSPC, GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status blobs_begin(struct blobs *blobs, uint64_t n_expected,
                                          struct blobs_writer **writer, struct groom_diag *diag);
/* Add bytes. After a failure only blobs_abort is left.
 * returns GROOM_ENOSPC, GROOM_EIO */
GROOM_MUST_CHECK groom_status blobs_write(struct blobs_writer *writer, const void *bytes, size_t n,
                                          struct groom_diag *diag);
/* SHA-256 of the bytes so far. returns  false where memory is out */
bool blobs_digest(const struct blobs_writer *writer, unsigned char digest[32]);
uint64_t blobs_written(const struct blobs_writer *writer);
/* Make it durable and visible, and pin it. The writer is gone, whatever is returned; on failure so is
 * the blob. Bytes that are there already are kept once.
 * expected  SHA-256 that the sender claims, or NULL; GROOM_EINVAL where it is another
 * sha256    its name */
GROOM_MUST_CHECK groom_status blobs_commit(struct blobs_writer *writer, const char *expected,
                                           char sha256[BLOBS_HASH_SIZE], struct groom_diag *diag);
void blobs_abort(struct blobs_writer *writer); /* takes NULL; nothing stays */
/* The bytes of a file become a blob, pinned; the file stays (both are one where the file system can link).
 * Nobody may write to it any more.
 * returns GROOM_ENOSPC, GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status blobs_adopt(struct blobs *blobs, const char *path, char sha256[BLOBS_HASH_SIZE],
                                          struct groom_diag *diag);
/* Pin a blob that is there. returns GROOM_ENOTFOUND, GROOM_ENOMEM, GROOM_EIO */
GROOM_MUST_CHECK groom_status blobs_pin(struct blobs *blobs, const char *sha256, struct groom_diag *diag);
/* The row is written (or will never be). */
void blobs_unpin(struct blobs *blobs, const char *sha256);

/* --- reading -------------------------------------------------------------------------- */

/* A descriptor for reading (close-on-exec), the caller's to close, and the size.
 * returns GROOM_ENOTFOUND, GROOM_EINVAL (not a SHA-256), GROOM_EIO */
GROOM_MUST_CHECK groom_status blobs_read(struct blobs *blobs, const char *sha256, int *fd, uint64_t *n_bytes,
                                         struct groom_diag *diag);
/* "<folder>/ab/abcdef…"; returns GROOM_EINVAL (not a SHA-256), GROOM_ETOOBIG (path is too small) */
GROOM_MUST_CHECK groom_status blobs_path(const struct blobs *blobs, const char *sha256, char *path,
                                         size_t path_size);
bool blobs_is_hash(const char *text); /* 64 lower-case hexadecimal digits */

/* --- keeping house ----------------------------------------------------------------------- */

/* Does a row refer to it? A failure keeps the blob. */
typedef groom_status (*blobs_referenced)(void *user, const char *sha256, bool *referenced);

/* Remove a blob unless it is pinned or referred to; *removed says. Removing what is not there is fine. */
GROOM_MUST_CHECK groom_status blobs_collect(struct blobs *blobs, const char *sha256, blobs_referenced referenced,
                                            void *user, bool *removed, struct groom_diag *diag);
/* While it is held nothing is removed (a backup or a check walks the blobs); counts, so that holds nest. What
 * would have been removed is garbage for a later collection. */
void blobs_hold(struct blobs *blobs);
void blobs_release(struct blobs *blobs);
/* Collect every blob that no row refers to; counts what went. */
GROOM_MUST_CHECK groom_status blobs_collect_all(struct blobs *blobs, blobs_referenced referenced, void *user,
                                                uint64_t *n_removed, struct groom_diag *diag);
/* Call `visit` for every blob; it may stop the walk by returning something other than GROOM_OK. */
GROOM_MUST_CHECK groom_status blobs_each(struct blobs *blobs,
                                         groom_status (*visit)(void *user, const char *sha256, uint64_t n_bytes),
                                         void *user, struct groom_diag *diag);

#endif
