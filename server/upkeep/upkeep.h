/* Checking a data folder, and backing it up, whether a daemon runs on it or not.
 *
 * Both work on a copy of the database that is one state of things, made while others read and write, and
 * keep the collector of blobs still meanwhile. Blobs never change, so a backup on the same file system
 * links them.
 *
 * threads   one call at a time */
#ifndef UPKEEP_UPKEEP_H
#define UPKEEP_UPKEEP_H

#include "server/blobs/blobs.h"
#include "server/store/store.h"

/* What is worked on. */
struct upkeep {
    const char *folder;  /* the data folder */
    struct store *store; /* of the running daemon; NULL: nobody has the database open */
    struct blobs *blobs;
    /* What is found and done, a line at a time: 'p' a problem, 'n' a note, 's' the sum of it. */
    void (*say)(void *user, char kind, const char *text);
    void *user;
};

/* Every page, reference and hash. *n_problems counts the 'p' lines; a status is returned only where the
 * check could not be made. */
GROOM_MUST_CHECK groom_status upkeep_check(const struct upkeep *upkeep, uint64_t *n_problems, struct groom_diag *diag);

/* All that is needed to go on from here, as a data folder of its own: start a groomd on it, or copy it back.
 * to      must not exist; appears when it is whole and on the disk
 * copy    copies of all bytes, also where links would do; each is verified by its hash
 * returns GROOM_ECONFLICT (`to` is there already), GROOM_EFORMAT (a blob is missing or damaged) */
GROOM_MUST_CHECK groom_status upkeep_backup(const struct upkeep *upkeep, const char *to, bool copy,
                                            struct groom_diag *diag);

#endif
