/* Shared by the files of this room: the registry of who is at which upload, and one writer. */
#ifndef UPLOADS_WRITERS_H
#define UPLOADS_WRITERS_H

#include <pthread.h>
#include <stdatomic.h>

#include <openssl/evp.h>

#include "server/uploads/uploads.h"

/* One piece that is being received; without a file, a hold on the upload while it is taken or removed.
 *
 * It is referred to by its user (a request) and by the registry; the last to let go frees it. Locks are
 * taken in the order settling, io; the registry's lock is held together with neither. */
struct upload_writer {
    struct uploads *uploads;
    char id[STORE_ID_SIZE];
    int fd;
    uint64_t n_bytes, offset; /* of the upload; where this piece begins */
    EVP_MD_CTX *hash;         /* of a piece with a checksum, else NULL */
    struct upload_checksum checksum;

    pthread_mutex_t settling; /* of making durable; held from the entry until it is ready */
    bool is_entering;
    uint64_t n_durable;
    pthread_mutex_t io; /* of what follows */
    uint64_t n_written; /* where the piece ends by now */
    bool revoked;       /* another has taken over: nothing may be written or acknowledged */
    bool broken;        /* a sync failed: what was not durable may be lost */
    bool is_verified;   /* it has no checksum, or the right one */

    atomic_int n_references;
    atomic_llong heard_ms; /* monotonic: of the last bytes */
    bool ended;            /* the registry's lock: its user has let go, the keeper is to end it */
    struct upload_writer *next;
};

struct uploads {
    struct uploads_options options;
    char *folder;
    pthread_mutex_t lock; /* of the registry */
    pthread_cond_t wake;  /* the keeper */
    struct upload_writer *writers;
    bool stopping, has_keeper;
    pthread_t keeper;
};

int64_t uploads_clock_ms(void);
/* "<folder>/<id>" */
void uploads_path(const struct uploads *uploads, const char *id, char *path, size_t size);

/* Enter the registry as the only one at this upload. Whoever was there and is done, or silent, is settled
 * and put out of office; anyone: whoever it is. Until writer_ready (or writer_leave, by the same thread) a
 * successor waits, so that nobody works on a file that another is still opening or settling.
 * returns  GROOM_ECONFLICT: somebody is at it */
GROOM_MUST_CHECK groom_status writer_enter(struct uploads *uploads, const char *id, bool anyone,
                                           struct upload_writer **writer, struct groom_diag *diag);
void writer_ready(struct upload_writer *writer);
/* Leave it and let go. */
void writer_leave(struct upload_writer *writer);
void writer_release(struct upload_writer *writer);
/* Who is at this upload, with a reference of the caller's, or NULL. */
struct upload_writer *writer_find(struct uploads *uploads, const char *id);
/* Bring to the disk what was written, and say so in the row. Nothing to do is fine. */
GROOM_MUST_CHECK groom_status writer_settle(struct upload_writer *writer, struct groom_diag *diag);
/* The same where nobody else is settling it or entering: the keeper waits for no one. returns  whether it did */
bool writer_try_settle(struct upload_writer *writer);

#endif
