#include "server/upkeep/upkeep.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/upkeep/files.h"

#define PATH_SIZE 1500

struct backup {
    const struct upkeep *upkeep;
    bool copy;
    char to[PATH_SIZE], database[STORE_PLACE_SIZE]; /* the folder while it is being made */
    char last[BLOBS_HASH_SIZE], last_folder[3];
    uint64_t n_blobs, n_linked, n_bytes, n_uploads;
    char (*gone)[STORE_ID_SIZE]; /* uploads that are not there any more */
    size_t n_gone;
    groom_status status; /* of the first failure: the walk goes on without doing anything */
    struct groom_diag *diag;
};

/* --- blobs ---------------------------------------------------------------------------------- */

static groom_status enter_folder(struct backup *backup, const char *sha256)
{
    char path[PATH_SIZE + 64];
    if (!strncmp(backup->last_folder, sha256, 2))
        return GROOM_OK;
    if (backup->last_folder[0]) {
        snprintf(path, sizeof path, "%s/blobs/%s", backup->to, backup->last_folder);
        groom_status status = folder_sync(path, backup->diag);
        if (status != GROOM_OK)
            return status;
    }
    memcpy(backup->last_folder, sha256, 2);
    snprintf(path, sizeof path, "%s/blobs/%.2s", backup->to, sha256);
    return folder_make(path, true, backup->diag);
}

static groom_status take_blob(struct backup *backup, const char *sha256, uint64_t n_bytes, const char *owner)
{
    char from[PATH_SIZE], to[PATH_SIZE + 128], found[BLOBS_HASH_SIZE] = "";
    bool linked = false;
    groom_status status = enter_folder(backup, sha256);
    snprintf(from, sizeof from, "%s/blobs/%.2s/%s", backup->upkeep->folder, sha256, sha256);
    snprintf(to, sizeof to, "%s/blobs/%.2s/%s", backup->to, sha256, sha256);
    if (status == GROOM_OK && !backup->copy)
        status = file_link(from, to, &linked, backup->diag);
    if (status == GROOM_OK && !linked && (status = file_copy(from, to, UINT64_MAX, found, backup->diag)) == GROOM_OK &&
        strcmp(found, sha256))
        status = groom_fail(backup->diag, GROOM_EFORMAT, "the blob %s of %s is damaged; groomd check says all that is",
                            sha256, owner);
    if (status == GROOM_ENOTFOUND)
        status = groom_fail(backup->diag, GROOM_EFORMAT, "the blob %s of %s is missing; groomd check says all that is",
                            sha256, owner);
    backup->n_blobs++;
    backup->n_linked += linked;
    backup->n_bytes += n_bytes;
    return status;
}

static void on_blob(void *user, const char *sha256, uint64_t n_bytes, const char *owner)
{
    struct backup *backup = user;
    if (backup->status != GROOM_OK || !blobs_is_hash(sha256) || !strcmp(backup->last, sha256))
        return;
    memcpy(backup->last, sha256, BLOBS_HASH_SIZE);
    backup->status = take_blob(backup, sha256, n_bytes, owner);
}

/* --- uploads in pieces -------------------------------------------------------------------------- */

/* Its file has become a blob since the database was copied: those bytes, then. */
static groom_status copy_moved(struct backup *backup, const char *id, const char *to, bool *found)
{
    struct store_upload row = {0};
    char from[PATH_SIZE];
    *found = false;
    if (!backup->upkeep->store || store_upload_get(backup->upkeep->store, id, &row, NULL) != GROOM_OK)
        return GROOM_OK;
    groom_status status = GROOM_OK;
    if (row.sha256[0]) {
        snprintf(from, sizeof from, "%s/blobs/%.2s/%s", backup->upkeep->folder, row.sha256, row.sha256);
        status = file_copy(from, to, UINT64_MAX, NULL, backup->diag);
        *found = status == GROOM_OK;
    }
    store_upload_finish(&row);
    return status;
}

static groom_status note_gone(struct backup *backup, const char *id)
{
    char(*larger)[STORE_ID_SIZE] = realloc(backup->gone, (backup->n_gone + 1) * sizeof *larger);
    if (!larger)
        return groom_fail(backup->diag, GROOM_ENOMEM, "no memory for a backup");
    backup->gone = larger;
    snprintf(backup->gone[backup->n_gone++], STORE_ID_SIZE, "%s", id);
    return GROOM_OK;
}

static groom_status drop_gone(struct backup *backup)
{
    groom_status status = GROOM_OK;
    for (size_t i = 0; status == GROOM_OK && i < backup->n_gone; i++)
        status = store_copy_drop_upload(backup->database, backup->gone[i], backup->diag);
    return status;
}

/* Always copied: this file grows and is cut. One that has gone meanwhile goes from the backup, too. */
static void on_upload(void *user, const char *id, uint64_t n_durable)
{
    struct backup *backup = user;
    char from[PATH_SIZE], to[PATH_SIZE + 64];
    bool found = true;
    if (backup->status != GROOM_OK)
        return;
    snprintf(from, sizeof from, "%s/uploads/%s", backup->upkeep->folder, id);
    snprintf(to, sizeof to, "%s/uploads/%s", backup->to, id);
    groom_status status = file_copy(from, to, n_durable, NULL, backup->diag);
    if (status == GROOM_ENOTFOUND && (status = copy_moved(backup, id, to, &found)) == GROOM_OK && !found)
        status = note_gone(backup, id);
    backup->n_uploads += found;
    backup->status = status;
}

/* --- what else lies in the folder ------------------------------------------------------------------ */

/* Tokens and the like: small files beside the database. */
static bool is_ours(const char *name)
{
    return name[0] != '.' && strcmp(name, "lock") && !store_has_entry(name) && strcmp(name, "control");
}

static groom_status copy_others(struct backup *backup)
{
    DIR *entries = opendir(backup->upkeep->folder);
    groom_status status = GROOM_OK;
    if (!entries)
        return groom_fail(backup->diag, GROOM_EIO, "%.300s: %s", backup->upkeep->folder, strerror(errno));
    for (struct dirent *entry; status == GROOM_OK && (entry = readdir(entries));) {
        char from[PATH_SIZE + 256], to[PATH_SIZE + 300];
        struct stat info;
        snprintf(from, sizeof from, "%s/%s", backup->upkeep->folder, entry->d_name);
        snprintf(to, sizeof to, "%s/%s", backup->to, entry->d_name);
        if (is_ours(entry->d_name) && lstat(from, &info) == 0 && S_ISREG(info.st_mode)) {
            status = file_copy(from, to, UINT64_MAX, NULL, backup->diag);
            if (status == GROOM_OK && chmod(to, info.st_mode & 0777) != 0)
                status = groom_fail(backup->diag, GROOM_EIO, "%.300s: %s", to, strerror(errno));
        }
    }
    closedir(entries);
    return status;
}

/* --- all of it ---------------------------------------------------------------------------------------- */

static groom_status make_folders(struct backup *backup)
{
    static const char *const names[] = {"", "/blobs", "/uploads"};
    char path[PATH_SIZE + 32];
    groom_status status = GROOM_OK;
    for (size_t i = 0; status == GROOM_OK && i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s%s", backup->to, names[i]);
        status = folder_make(path, false, backup->diag);
    }
    return status;
}

static groom_status fill(struct backup *backup)
{
    char from[STORE_PLACE_SIZE];
    const struct store_check_sink sink = {NULL, on_blob, on_upload, backup};
    struct store *store = backup->upkeep->store;
    groom_status status = make_folders(backup);
    if (status != GROOM_OK)
        return status;
    store_place(backup->upkeep->folder, from);
    status = store ? store_copy(store, backup->database, backup->diag)
                   : store_copy_file(from, backup->database, backup->diag);
    if (status == GROOM_OK)
        status = store_copy_check(backup->database, &sink, backup->diag);
    if (status == GROOM_OK)
        status = backup->status;
    if (status == GROOM_OK)
        status = drop_gone(backup);
    return status == GROOM_OK ? copy_others(backup) : status;
}

/* Everything below is on the disk before the folder has its name. */
static groom_status sync_all(struct backup *backup)
{
    char path[PATH_SIZE + 64];
    groom_status status = GROOM_OK;
    if (backup->last_folder[0]) {
        snprintf(path, sizeof path, "%s/blobs/%s", backup->to, backup->last_folder);
        status = folder_sync(path, backup->diag);
    }
    static const char *const names[] = {"/blobs", "/uploads", ""};
    for (size_t i = 0; status == GROOM_OK && i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s%s", backup->to, names[i]);
        status = folder_sync(path, backup->diag);
    }
    return status;
}

static groom_status give_name(struct backup *backup, const char *to)
{
    char parent[PATH_SIZE];
    if (rename(backup->to, to) != 0)
        return groom_fail(backup->diag, GROOM_EIO, "%.300s: %s", to, strerror(errno));
    snprintf(parent, sizeof parent, "%s", to);
    char *slash = strrchr(parent, '/');
    if (slash)
        slash[slash == parent] = 0;
    return folder_sync(slash ? parent : ".", backup->diag);
}

groom_status upkeep_backup(const struct upkeep *upkeep, const char *to, bool copy, struct groom_diag *diag)
{
    struct backup backup = {.upkeep = upkeep, .copy = copy, .status = GROOM_OK, .diag = diag};
    char text[256];
    if (access(to, F_OK) == 0)
        return groom_fail(diag, GROOM_ECONFLICT, "%.300s is there already: name a new folder", to);
    if ((size_t)snprintf(backup.to, sizeof backup.to, "%s.partial", to) >= sizeof backup.to)
        return groom_fail(diag, GROOM_EINVAL, "the name of the folder is too long");
    store_place(backup.to, backup.database);
    if (access(backup.to, F_OK) == 0)
        return groom_fail(diag, GROOM_ECONFLICT, "%.300s is left from a backup that was cut off: remove it", backup.to);
    blobs_hold(upkeep->blobs);
    groom_status status = fill(&backup);
    blobs_release(upkeep->blobs);
    if (status == GROOM_OK && (status = sync_all(&backup)) == GROOM_OK)
        status = give_name(&backup, to);
    free(backup.gone);
    if (status != GROOM_OK) {
        folder_remove(backup.to);
        return status;
    }
    snprintf(text, sizeof text, "%llu blobs of %.1f MB (%llu linked, the others copied), %llu uploads under way",
             (unsigned long long)backup.n_blobs, (double)backup.n_bytes * 1e-6, (unsigned long long)backup.n_linked,
             (unsigned long long)backup.n_uploads);
    upkeep->say(upkeep->user, 's', text);
    return GROOM_OK;
}
