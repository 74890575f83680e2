/* Files of a data folder: hashing, linking, copying with their bytes on the disk. */
#ifndef UPKEEP_FILES_H
#define UPKEEP_FILES_H

#include "server/blobs/blobs.h"

/* Size and SHA-256 of a file. returns  GROOM_ENOTFOUND, GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status file_hash(const char *path, uint64_t *n_bytes, char sha256[BLOBS_HASH_SIZE],
                                        struct groom_diag *diag);
/* The first n_bytes of a file (UINT64_MAX: all) into a new one, synced.
 * sha256  of what was copied; or NULL. returns  as above; GROOM_ENOSPC; GROOM_ETRUNCATED (it has fewer) */
GROOM_MUST_CHECK groom_status file_copy(const char *from, const char *to, uint64_t n_bytes,
                                        char sha256[BLOBS_HASH_SIZE], struct groom_diag *diag);
/* A second name for a file. *linked false: the file system cannot. returns  GROOM_ENOTFOUND, GROOM_EIO */
GROOM_MUST_CHECK groom_status file_link(const char *from, const char *to, bool *linked, struct groom_diag *diag);
/* A new folder; one that is there is fine where `may_exist`. returns  GROOM_ECONFLICT, GROOM_EIO */
GROOM_MUST_CHECK groom_status folder_make(const char *path, bool may_exist, struct groom_diag *diag);
GROOM_MUST_CHECK groom_status folder_sync(const char *path, struct groom_diag *diag);
/* The folder and everything below. */
void folder_remove(const char *path);

#endif
