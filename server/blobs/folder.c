/* Opening a folder of blobs, names, pins, reading. */
#include "server/blobs/folder.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

groom_status blobs_fail(struct groom_diag *diag, int error, const char *what)
{
    switch (error) {
    case ENOSPC: case EDQUOT: case EFBIG:
        return groom_fail(diag, GROOM_ENOSPC, "%s: the disk is full", what);
    case ENOMEM: return groom_fail(diag, GROOM_ENOMEM, "%s: no memory", what);
    default: return groom_fail(diag, GROOM_EIO, "%s: %s", what, strerror(error));
    }
}

/* --- names --------------------------------------------------------------------------- */

bool blobs_is_hash(const char *text)
{
    return text && strspn(text, "0123456789abcdef") == 64 && text[64] == 0;
}

void blob_name(const char *sha256, char name[BLOBS_NAME_SIZE])
{
    snprintf(name, BLOBS_NAME_SIZE, "%.2s/%.64s", sha256, sha256);
}

groom_status blobs_path(const struct blobs *blobs, const char *sha256, char *path, size_t path_size)
{
    if (!blobs_is_hash(sha256))
        return GROOM_EINVAL;
    int n = snprintf(path, path_size, "%s/%.2s/%s", blobs->folder, sha256, sha256);
    return (size_t)n < path_size ? GROOM_OK : GROOM_ETOOBIG;
}

/* --- pins ------------------------------------------------------------------------------ */

bool pin_add(struct blobs *blobs, const char *sha256)
{
    for (struct blobs_pin *pin = blobs->pins; pin; pin = pin->next) {
        if (strcmp(pin->sha256, sha256) == 0) {
            pin->count++;
            return true;
        }
    }
    struct blobs_pin *pin = calloc(1, sizeof *pin);
    if (!pin)
        return false;
    memcpy(pin->sha256, sha256, BLOBS_HASH_SIZE);
    pin->count = 1;
    pin->next = blobs->pins;
    blobs->pins = pin;
    return true;
}

bool pin_held(const struct blobs *blobs, const char *sha256)
{
    for (const struct blobs_pin *pin = blobs->pins; pin; pin = pin->next)
        if (strcmp(pin->sha256, sha256) == 0)
            return true;
    return false;
}

void pin_drop(struct blobs *blobs, const char *sha256)
{
    for (struct blobs_pin **at = &blobs->pins; *at; at = &(*at)->next) {
        struct blobs_pin *pin = *at;
        if (strcmp(pin->sha256, sha256) != 0)
            continue;
        if (--pin->count == 0) {
            *at = pin->next;
            free(pin);
        }
        return;
    }
}

void blobs_unpin(struct blobs *blobs, const char *sha256)
{
    pthread_mutex_lock(&blobs->lock);
    pin_drop(blobs, sha256);
    pthread_mutex_unlock(&blobs->lock);
}

/* --- opening ------------------------------------------------------------------------------ */

static groom_status make_folder(int parent, const char *name, struct groom_diag *diag)
{
    if (mkdirat(parent, name, 0750) != 0 && errno != EEXIST)
        return blobs_fail(diag, errno, name);
    return GROOM_OK;
}

/* All 256 folders at once, so that no upload has to make and sync one. */
static groom_status make_folders(struct blobs *blobs, struct groom_diag *diag)
{
    groom_status status = make_folder(blobs->fd, "tmp", diag);
    for (int i = 0; status == GROOM_OK && i < 256; i++) {
        char name[3];
        snprintf(name, sizeof name, "%02x", i);
        status = make_folder(blobs->fd, name, diag);
    }
    if (status == GROOM_OK && blobs->system->sync(blobs->fd) != 0)
        status = blobs_fail(diag, errno, blobs->folder);
    return status;
}

/* What a killed daemon was writing. Nobody writes yet. */
static groom_status remove_temporaries(struct blobs *blobs, struct groom_diag *diag)
{
    int fd = openat(blobs->fd, "tmp", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *entries = fd >= 0 ? fdopendir(fd) : NULL;
    if (!entries) {
        groom_status status = blobs_fail(diag, errno, "the folder of temporary blobs");
        if (fd >= 0)
            close(fd);
        return status;
    }
    for (struct dirent *entry; (entry = readdir(entries));)
        if (entry->d_name[0] != '.')
            unlinkat(fd, entry->d_name, 0);
    closedir(entries);
    return GROOM_OK;
}

static groom_status open_folder(struct blobs *blobs, const char *folder, struct groom_diag *diag)
{
    if (!(blobs->folder = strdup(folder)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the blobs");
    groom_status status = make_folder(AT_FDCWD, folder, diag);
    if (status != GROOM_OK)
        return status;
    if ((blobs->fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC)) < 0)
        return blobs_fail(diag, errno, folder);
    status = make_folders(blobs, diag);
    return status == GROOM_OK ? remove_temporaries(blobs, diag) : status;
}

groom_status blobs_open(const char *folder, const struct blobs_system *system, struct blobs **blobs,
                        struct groom_diag *diag)
{
    struct blobs *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the blobs");
    made->fd = -1;
    made->system = system ? system : &blobs_default_system;
    pthread_mutex_init(&made->lock, NULL);
    groom_status status = open_folder(made, folder, diag);
    if (status != GROOM_OK) {
        blobs_close(made);
        return status;
    }
    *blobs = made;
    return GROOM_OK;
}

void blobs_close(struct blobs *blobs)
{
    if (!blobs)
        return;
    while (blobs->pins) {
        struct blobs_pin *next = blobs->pins->next;
        free(blobs->pins);
        blobs->pins = next;
    }
    if (blobs->fd >= 0)
        close(blobs->fd);
    pthread_mutex_destroy(&blobs->lock);
    free(blobs->folder);
    free(blobs);
}

/* --- reading ---------------------------------------------------------------------------------- */

groom_status blobs_read(struct blobs *blobs, const char *sha256, int *fd, uint64_t *n_bytes,
                        struct groom_diag *diag)
{
    char name[BLOBS_NAME_SIZE];
    struct stat info;
    if (!blobs_is_hash(sha256))
        return groom_fail(diag, GROOM_EINVAL, "a blob is named by 64 lower-case hexadecimal digits");
    blob_name(sha256, name);
    int opened = openat(blobs->fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (opened < 0 && errno == ENOENT)
        return groom_fail(diag, GROOM_ENOTFOUND, "there is no blob %s", sha256);
    if (opened < 0 || fstat(opened, &info) != 0) {
        groom_status status = blobs_fail(diag, errno, "reading a blob");
        if (opened >= 0)
            close(opened);
        return status;
    }
    *fd = opened;
    *n_bytes = (uint64_t)info.st_size;
    return GROOM_OK;
}
