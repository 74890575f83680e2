/* Uploads that come in pieces and survive a bad line: what stands behind tus 1.0 (server/http/uploads.c).
 *
 * An upload is a file <folder>/<id> that grows, and a row that says how many of its bytes are on the
 * disk. A sender is only ever told that number, so that what was acknowledged is there after a crash; bytes
 * beyond it are cut when the next piece begins. One thread, the keeper, makes durable what has come in
 * once a second, ends what broken connections leave, and removes what has expired.
 *
 *   begin ──▶ open ─▶ write … ─▶ finish ──▶ open … ──▶ take (the bytes are a blob from now on)
 *                      └─ the line breaks ─▶ abandon
 *
 * One writer at a time: a second one is refused while the first has sent something of late; one that
 * has been silent (a line that died without a word) is put out of office by the next.
 *
 * threads   any; a writer belongs to one thread at a time */
#ifndef UPLOADS_UPLOADS_H
#define UPLOADS_UPLOADS_H

#include "server/blobs/blobs.h"
#include "server/store/store.h"

struct uploads;
struct upload_writer;

struct uploads_options {
    struct store *store; /* borrowed, as are the blobs */
    struct blobs *blobs;
    const struct blobs_system *system; /* NULL: blobs_default_system */
    const char *folder;                /* is made; on the file system of the blobs */
    int64_t expiry_ms;                 /* after the last byte */
    uint32_t settle_ms;                /* 0: 1000 */
    uint32_t silence_ms;               /* 0: 5000 */
};

/* Files of no row are removed. returns  GROOM_EIO, GROOM_ENOMEM and what the store returns */
GROOM_MUST_CHECK groom_status uploads_create(const struct uploads_options *options, struct uploads **uploads,
                                             struct groom_diag *diag);
/* What has come in is made durable. Takes NULL; no writer may be in use. */
void uploads_destroy(struct uploads *uploads);

/* A new upload of n_bytes. upload: the caller's, store_upload_finish */
GROOM_MUST_CHECK groom_status uploads_begin(struct uploads *uploads, const char *project, const char *owner,
                                            uint64_t n_bytes, const char *metadata, struct store_upload *upload,
                                            struct groom_diag *diag);
/* What is known of it; everything that has come in by now is made durable and counted.
 * returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status uploads_look(struct uploads *uploads, const char *id, struct store_upload *upload,
                                           struct groom_diag *diag);
/* Its row, its file and its bytes go; a writer of it is refused from now on. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status uploads_remove(struct uploads *uploads, const char *id, struct groom_diag *diag);
/* Remove what has expired; the keeper does it once a minute. */
GROOM_MUST_CHECK groom_status uploads_expire(struct uploads *uploads, uint64_t *n_removed, struct groom_diag *diag);

/* --- a piece ---------------------------------------------------------------------------- */

/* What the sender says of a piece; the piece counts only where it is so. */
struct upload_checksum {
    const char *algorithm; /* "sha256" or "sha1" (uploads_checksums); NULL: nothing is said */
    unsigned char digest[32];
    size_t n_digest;
};
#define UPLOADS_CHECKSUMS "sha1,sha256"

enum upload_refusal {
    UPLOAD_NOT_REFUSED,
    UPLOAD_BUSY,       /* another writer is at it */
    UPLOAD_OFFSET,     /* the piece begins elsewhere than the upload ends */
    UPLOAD_CHECKSUM,   /* the piece is not what its sender says */
    UPLOAD_INCOMPLETE, /* not all bytes are there yet */
    UPLOAD_TAKEN       /* it is complete and was used: nothing can be added */
};

/* A writer for the bytes from `offset` on.
 * refusal  set with GROOM_ECONFLICT: BUSY, OFFSET or TAKEN
 * returns  GROOM_ENOTFOUND, GROOM_EFORMAT (its file is damaged), GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status upload_open(struct uploads *uploads, const char *id, uint64_t offset,
                                          const struct upload_checksum *checksum, struct upload_writer **writer,
                                          enum upload_refusal *refusal, struct groom_diag *diag);
/* How many bytes may still come. */
uint64_t upload_room(const struct upload_writer *writer);
/* Does not wait for the disk. returns  GROOM_ENOSPC, GROOM_EIO, GROOM_ETOOBIG (more than upload_room),
 * GROOM_ECONFLICT (another writer has taken over, or it was removed) */
GROOM_MUST_CHECK groom_status upload_write(struct upload_writer *writer, const void *bytes, size_t n,
                                           struct groom_diag *diag);
/* The piece is whole: it is on the disk when this returns, and the upload ends at *offset. The writer is gone
 * whatever is returned.
 * returns  GROOM_ECONFLICT with UPLOAD_CHECKSUM: nothing of the piece is kept; else as upload_write */
GROOM_MUST_CHECK groom_status upload_finish(struct upload_writer *writer, uint64_t *offset, int64_t *expires_ms,
                                            enum upload_refusal *refusal, struct groom_diag *diag);
/* The line broke: what came is kept (unless it has a checksum, which can't be told). Does not wait; takes NULL. */
void upload_abandon(struct upload_writer *writer);

/* --- its use ------------------------------------------------------------------------------ */

/* The bytes of a complete upload as a blob, pinned: blobs_unpin when its row is written. May be asked for
 * again until it expires.
 * refusal  set with GROOM_ECONFLICT: BUSY or INCOMPLETE. returns  GROOM_ENOTFOUND, and what blobs_adopt does */
GROOM_MUST_CHECK groom_status uploads_take(struct uploads *uploads, const char *id, char sha256[BLOBS_HASH_SIZE],
                                           uint64_t *n_bytes, enum upload_refusal *refusal,
                                           struct groom_diag *diag);

#endif
