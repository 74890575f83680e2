/* Walking the blobs, and removing those that no row refers to. */
#include "server/blobs/folder.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

groom_status blobs_collect(struct blobs *blobs, const char *sha256, blobs_referenced referenced, void *user,
                           bool *removed, struct groom_diag *diag)
{
    char name[BLOBS_NAME_SIZE];
    bool kept = true;
    if (!blobs_is_hash(sha256))
        return groom_fail(diag, GROOM_EINVAL, "a blob is named by 64 lower-case hexadecimal digits");
    blob_name(sha256, name);
    /* The row is asked for with the lock held: whoever writes one holds a pin, which needs the lock. */
    pthread_mutex_lock(&blobs->lock);
    groom_status status = GROOM_OK;
    if (blobs->n_holds == 0 && !pin_held(blobs, sha256))
        status = referenced(user, sha256, &kept);
    if (status == GROOM_OK && !kept && unlinkat(blobs->fd, name, 0) != 0) {
        kept = true;
        if (errno != ENOENT)
            status = blobs_fail(diag, errno, "removing a blob");
    }
    pthread_mutex_unlock(&blobs->lock);
    if (status == GROOM_OK && removed)
        *removed = !kept;
    return status;
}

void blobs_hold(struct blobs *blobs)
{
    pthread_mutex_lock(&blobs->lock);
    blobs->n_holds++;
    pthread_mutex_unlock(&blobs->lock);
}

void blobs_release(struct blobs *blobs)
{
    pthread_mutex_lock(&blobs->lock);
    blobs->n_holds--;
    pthread_mutex_unlock(&blobs->lock);
}

static groom_status visit_folder(struct blobs *blobs, const char *name,
                                 groom_status (*visit)(void *user, const char *sha256, uint64_t n_bytes),
                                 void *user, struct groom_diag *diag)
{
    int fd = openat(blobs->fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *entries = fd >= 0 ? fdopendir(fd) : NULL;
    groom_status status = GROOM_OK;
    if (!entries) {
        status = blobs_fail(diag, errno, "walking the blobs");
        if (fd >= 0)
            close(fd);
        return status;
    }
    for (struct dirent *entry; status == GROOM_OK && (entry = readdir(entries));) {
        struct stat info;
        if (blobs_is_hash(entry->d_name) && fstatat(fd, entry->d_name, &info, AT_SYMLINK_NOFOLLOW) == 0)
            status = visit(user, entry->d_name, (uint64_t)info.st_size);
    }
    closedir(entries);
    return status;
}

groom_status blobs_each(struct blobs *blobs,
                        groom_status (*visit)(void *user, const char *sha256, uint64_t n_bytes), void *user,
                        struct groom_diag *diag)
{
    groom_status status = GROOM_OK;
    for (int i = 0; status == GROOM_OK && i < 256; i++) {
        char name[3];
        snprintf(name, sizeof name, "%02x", i);
        status = visit_folder(blobs, name, visit, user, diag);
    }
    return status;
}

struct collector {
    struct blobs *blobs;
    blobs_referenced referenced;
    void *user;
    uint64_t n_removed;
    struct groom_diag *diag;
};

static groom_status collect_one(void *user, const char *sha256, uint64_t n_bytes)
{
    struct collector *collector = user;
    bool removed = false;
    groom_status status = blobs_collect(collector->blobs, sha256, collector->referenced, collector->user, &removed,
                                        collector->diag);
    collector->n_removed += removed;
    return status;
}

groom_status blobs_collect_all(struct blobs *blobs, blobs_referenced referenced, void *user, uint64_t *n_removed,
                               struct groom_diag *diag)
{
    struct collector collector = {blobs, referenced, user, 0, diag};
    groom_status status = blobs_each(blobs, collect_one, &collector, diag);
    if (status == GROOM_OK && n_removed)
        *n_removed = collector.n_removed;
    return status;
}
