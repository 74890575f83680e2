#include "server/uploads/writers.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define EXPIRE_MS 60000
#define PATH_SIZE 1500

/* --- begin and look --------------------------------------------------------------------------- */

static void drop_file(const struct uploads *uploads, const char *id)
{
    char path[PATH_SIZE];
    uploads_path(uploads, id, path, sizeof path);
    unlink(path); /* what stays is swept at the next start */
}

/* An empty file whose name is on the disk. */
static groom_status make_file(struct uploads *uploads, const char *id, struct groom_diag *diag)
{
    char path[PATH_SIZE];
    groom_status status = GROOM_OK;
    uploads_path(uploads, id, path, sizeof path);
    int file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
    int folder = open(uploads->folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file < 0 || folder < 0 || uploads->options.system->sync(folder) != 0) {
        bool full = errno == ENOSPC || errno == EDQUOT;
        status = groom_fail(diag, full ? GROOM_ENOSPC : GROOM_EIO, "starting an upload: %s", strerror(errno));
        unlink(path);
    }
    if (file >= 0)
        close(file);
    if (folder >= 0)
        close(folder);
    return status;
}

groom_status uploads_begin(struct uploads *uploads, const char *project, const char *owner, uint64_t n_bytes,
                           const char *metadata, struct store_upload *upload, struct groom_diag *diag)
{
    struct store_upload made = {.n_bytes = n_bytes, .created_ms = store_now_ms()};
    snprintf(made.project, sizeof made.project, "%s", project ? project : "");
    snprintf(made.owner, sizeof made.owner, "%s", owner ? owner : "");
    made.expires_ms = made.created_ms + uploads->options.expiry_ms;
    groom_status status = store_make_id("upl_", made.id);
    if (status == GROOM_OK && !(made.metadata = strdup(metadata ? metadata : "")))
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for an upload");
    if (status == GROOM_OK && (status = make_file(uploads, made.id, diag)) == GROOM_OK &&
        (status = store_upload_create(uploads->options.store, &made, diag)) != GROOM_OK)
        drop_file(uploads, made.id);
    if (status == GROOM_OK)
        *upload = made;
    else
        store_upload_finish(&made);
    return status;
}

groom_status uploads_look(struct uploads *uploads, const char *id, struct store_upload *upload,
                          struct groom_diag *diag)
{
    struct upload_writer *writer = writer_find(uploads, id);
    if (writer) {
        groom_status settled = writer_settle(writer, NULL);
        (void)settled; /* then the row says less */
        writer_release(writer);
    }
    return store_upload_get(uploads->options.store, id, upload, diag);
}

/* --- removing ------------------------------------------------------------------------------------- */

static groom_status is_referenced(void *store, const char *sha256, bool *referenced)
{
    return store_blob_referenced(store, sha256, referenced, NULL);
}

/* The row first: a file without a row is swept at the next start, a row without its file would lie. */
groom_status uploads_remove(struct uploads *uploads, const char *id, struct groom_diag *diag)
{
    char garbage[STORE_HASH_SIZE] = "";
    struct upload_writer *hold;
    struct store_upload row = {0};
    groom_status status = store_upload_get(uploads->options.store, id, &row, diag);
    store_upload_finish(&row);
    if (status != GROOM_OK || (status = writer_enter(uploads, id, true, &hold, diag)) != GROOM_OK)
        return status;
    if ((status = store_upload_remove(uploads->options.store, id, garbage, diag)) == GROOM_OK) {
        drop_file(uploads, id);
        if (garbage[0] && blobs_collect(uploads->options.blobs, garbage, is_referenced, uploads->options.store, NULL,
                                        NULL) != GROOM_OK)
            garbage[0] = 0; /* stays for a later collection */
    }
    writer_leave(hold);
    return status;
}

/* An upload that somebody is at does not expire under his hands. */
static groom_status expire_one(struct uploads *uploads, const char *id, uint64_t *n_removed, struct groom_diag *diag)
{
    char garbage[STORE_HASH_SIZE] = "";
    struct upload_writer *hold;
    groom_status status = writer_enter(uploads, id, false, &hold, diag);
    if (status == GROOM_ECONFLICT)
        return GROOM_OK;
    if (status != GROOM_OK)
        return status;
    struct store_upload row = {0};
    /* again, now that nobody else is there: its last piece may have moved the end */
    bool alive = store_upload_get(uploads->options.store, id, &row, NULL) == GROOM_OK;
    store_upload_finish(&row);
    if (!alive && (status = store_upload_remove(uploads->options.store, id, garbage, diag)) == GROOM_OK) {
        drop_file(uploads, id);
        ++*n_removed;
        if (garbage[0])
            status = blobs_collect(uploads->options.blobs, garbage, is_referenced, uploads->options.store, NULL, diag);
    }
    writer_leave(hold);
    return status;
}

groom_status uploads_expire(struct uploads *uploads, uint64_t *n_removed, struct groom_diag *diag)
{
    struct store_upload_list list = {0};
    uint64_t n = 0;
    groom_status status = store_uploads_list(uploads->options.store, store_now_ms(), &list, diag);
    for (size_t i = 0; status == GROOM_OK && i < list.n; i++)
        status = expire_one(uploads, list.items[i].id, &n, diag);
    store_upload_list_finish(&list);
    if (n_removed)
        *n_removed = n;
    return status;
}

/* --- use ---------------------------------------------------------------------------------------------- */

/* Linked, then the row, then the file's own name goes: after a crash at any point the bytes are in one
 * place that the row names. */
static groom_status make_blob(struct uploads *uploads, const char *id, char sha256[BLOBS_HASH_SIZE],
                              struct groom_diag *diag)
{
    const struct uploads_options *options = &uploads->options;
    char path[PATH_SIZE];
    uploads_path(uploads, id, path, sizeof path);
    groom_status status = blobs_adopt(options->blobs, path, sha256, diag);
    if (status != GROOM_OK)
        return status;
    status = store_upload_set_blob(options->store, id, sha256, store_now_ms() + options->expiry_ms, diag);
    if (status == GROOM_OK)
        unlink(path);
    else
        blobs_unpin(options->blobs, sha256);
    return status;
}

static groom_status take(struct uploads *uploads, const char *id, char sha256[BLOBS_HASH_SIZE], uint64_t *n_bytes,
                         enum upload_refusal *refusal, struct groom_diag *diag)
{
    struct store_upload row = {0};
    groom_status status = store_upload_get(uploads->options.store, id, &row, diag);
    if (status != GROOM_OK)
        return status;
    if (row.n_durable < row.n_bytes) {
        *refusal = UPLOAD_INCOMPLETE;
        status = groom_fail(diag, GROOM_ECONFLICT, "the upload has %llu of its %llu bytes: send the rest",
                            (unsigned long long)row.n_durable, (unsigned long long)row.n_bytes);
    } else if (row.n_bytes == 0) {
        status = groom_fail(diag, GROOM_EINVAL, "the upload is empty");
    } else if (row.sha256[0]) {
        memcpy(sha256, row.sha256, BLOBS_HASH_SIZE);
        status = blobs_pin(uploads->options.blobs, sha256, diag);
    } else {
        status = make_blob(uploads, id, sha256, diag);
    }
    *n_bytes = row.n_bytes;
    store_upload_finish(&row);
    return status;
}

groom_status uploads_take(struct uploads *uploads, const char *id, char sha256[BLOBS_HASH_SIZE], uint64_t *n_bytes,
                          enum upload_refusal *refusal, struct groom_diag *diag)
{
    struct upload_writer *hold;
    struct store_upload row = {0};
    groom_status status = store_upload_get(uploads->options.store, id, &row, diag);
    store_upload_finish(&row);
    if (status != GROOM_OK)
        return status;
    if ((status = writer_enter(uploads, id, false, &hold, diag)) != GROOM_OK) {
        *refusal = status == GROOM_ECONFLICT ? UPLOAD_BUSY : UPLOAD_NOT_REFUSED;
        return status;
    }
    status = take(uploads, id, sha256, n_bytes, refusal, diag);
    writer_leave(hold);
    return status;
}

/* --- the keeper --------------------------------------------------------------------------------------- */

/* The writer after `skip` others, with a reference; NULL where none is left in
 * this round. */
static struct upload_writer *next_writer(struct uploads *uploads, size_t skip, bool *ended)
{
    pthread_mutex_lock(&uploads->lock);
    struct upload_writer *writer = uploads->writers;
    for (; writer && skip > 0; skip--)
        writer = writer->next;
    if (writer) {
        atomic_fetch_add(&writer->n_references, 1);
        *ended = writer->ended;
    }
    pthread_mutex_unlock(&uploads->lock);
    return writer;
}

static void see_to_writers(struct uploads *uploads)
{
    bool ended = false;
    size_t n_seen = 0;
    for (struct upload_writer *writer; (writer = next_writer(uploads, n_seen, &ended));) {
        if (writer_try_settle(writer) && ended)
            writer_leave(writer);
        else {
            writer_release(writer);
            n_seen++;
        }
    }
}

static void sleep_until(struct uploads *uploads, int64_t until_ms)
{
    struct timespec until = {until_ms / 1000, until_ms % 1000 * 1000000};
    bool any_ended = false;
    pthread_mutex_lock(&uploads->lock);
    for (const struct upload_writer *writer = uploads->writers; writer; writer = writer->next)
        any_ended |= writer->ended;
    if (!uploads->stopping && !any_ended)
        pthread_cond_timedwait(&uploads->wake, &uploads->lock, &until);
    pthread_mutex_unlock(&uploads->lock);
}

static bool is_stopping(struct uploads *uploads)
{
    pthread_mutex_lock(&uploads->lock);
    bool stopping = uploads->stopping;
    pthread_mutex_unlock(&uploads->lock);
    return stopping;
}

static void *keep(void *user)
{
    struct uploads *uploads = user;
    int64_t expire_ms = uploads_clock_ms();
    while (!is_stopping(uploads)) {
        see_to_writers(uploads);
        if (uploads_clock_ms() >= expire_ms) {
            groom_status status = uploads_expire(uploads, NULL, NULL);
            (void)status; /* the next round tries again */
            expire_ms = uploads_clock_ms() + EXPIRE_MS;
        }
        sleep_until(uploads, uploads_clock_ms() + uploads->options.settle_ms);
    }
    see_to_writers(uploads);
    return NULL;
}

/* --- opening -------------------------------------------------------------------------------------------- */

/* A file is kept where its upload is there and not yet a blob. */
static bool is_orphan(struct uploads *uploads, const char *name)
{
    struct store_upload row = {0};
    groom_status status = store_upload_get(uploads->options.store, name, &row, NULL);
    bool orphan = status == GROOM_ENOTFOUND || (status == GROOM_OK && row.sha256[0]);
    store_upload_finish(&row);
    return orphan;
}

static groom_status sweep(struct uploads *uploads, struct groom_diag *diag)
{
    DIR *entries = opendir(uploads->folder);
    if (!entries)
        return groom_fail(diag, GROOM_EIO, "%.200s cannot be read: %s", uploads->folder, strerror(errno));
    for (struct dirent *entry; (entry = readdir(entries));)
        if (entry->d_name[0] != '.' && is_orphan(uploads, entry->d_name))
            unlinkat(dirfd(entries), entry->d_name, 0);
    closedir(entries);
    return GROOM_OK;
}

static groom_status open_folder(struct uploads *uploads, struct groom_diag *diag)
{
    if (!(uploads->folder = strdup(uploads->options.folder)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the uploads");
    if (mkdir(uploads->folder, 0750) != 0 && errno != EEXIST)
        return groom_fail(diag, GROOM_EIO, "the folder %.200s cannot be made: %s", uploads->folder, strerror(errno));
    return sweep(uploads, diag);
}

static void init(struct uploads *uploads, const struct uploads_options *options)
{
    pthread_condattr_t monotonic;
    uploads->options = *options;
    if (!options->system)
        uploads->options.system = &blobs_default_system;
    if (!options->settle_ms)
        uploads->options.settle_ms = 1000;
    if (!options->silence_ms)
        uploads->options.silence_ms = 5000;
    pthread_mutex_init(&uploads->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&uploads->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
}

groom_status uploads_create(const struct uploads_options *options, struct uploads **uploads, struct groom_diag *diag)
{
    struct uploads *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the uploads");
    init(made, options);
    groom_status status = open_folder(made, diag);
    if (status == GROOM_OK && pthread_create(&made->keeper, NULL, keep, made) != 0)
        status = groom_fail(diag, GROOM_ENOMEM, "no thread for the uploads");
    if (status != GROOM_OK) {
        uploads_destroy(made);
        return status;
    }
    made->has_keeper = true;
    *uploads = made;
    return GROOM_OK;
}

void uploads_destroy(struct uploads *uploads)
{
    if (!uploads)
        return;
    if (uploads->has_keeper) {
        pthread_mutex_lock(&uploads->lock);
        uploads->stopping = true;
        pthread_cond_signal(&uploads->wake);
        pthread_mutex_unlock(&uploads->lock);
        pthread_join(uploads->keeper, NULL);
    }
    pthread_cond_destroy(&uploads->wake);
    pthread_mutex_destroy(&uploads->lock);
    free(uploads->folder);
    free(uploads);
}
