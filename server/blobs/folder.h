/* Shared by the files of this room: the open folder, its pins, and names. */
#ifndef BLOBS_FOLDER_H
#define BLOBS_FOLDER_H

#include <pthread.h>

#include "server/blobs/blobs.h"

struct blobs_pin {
    char sha256[BLOBS_HASH_SIZE];
    uint32_t count;
    struct blobs_pin *next;
};

struct blobs {
    char *folder;
    int fd;                /* of the folder */
    const struct blobs_system *system;
    pthread_mutex_t lock;  /* pins, and the step from a temporary to a blob or from a blob to nothing */
    struct blobs_pin *pins;
    uint32_t n_holds;       /* nothing is removed while there are any */
    uint64_t n_temporaries; /* names them */
};

#define BLOBS_NAME_SIZE 80 /* "ab/abcdef…", "tmp/…" */

/* "ab/abcdef…", inside the folder. */
void blob_name(const char *sha256, char name[BLOBS_NAME_SIZE]);
/* With the lock held. Make the pin before what it protects. */
bool pin_add(struct blobs *blobs, const char *sha256); /* false: no memory */
bool pin_held(const struct blobs *blobs, const char *sha256);
void pin_drop(struct blobs *blobs, const char *sha256);
/* A name in the folder of this blob is on the disk when this returns. */
groom_status sync_folder(struct blobs *blobs, const char *sha256, struct groom_diag *diag);
/* errno of a failed call as a status. */
groom_status blobs_fail(struct groom_diag *diag, int error, const char *what);

#endif
