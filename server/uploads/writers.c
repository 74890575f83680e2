/* Who is at which upload: one writer each, how it is put out of office, and how its bytes get durable. */
#include "server/uploads/writers.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

int64_t uploads_clock_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

void uploads_path(const struct uploads *uploads, const char *id, char *path, size_t size)
{
    snprintf(path, size, "%s/%.*s", uploads->folder, STORE_ID_SIZE, id);
}

/* --- references -------------------------------------------------------------------------- */

static struct upload_writer *writer_create(struct uploads *uploads, const char *id)
{
    struct upload_writer *writer = calloc(1, sizeof *writer);
    if (!writer)
        return NULL;
    writer->uploads = uploads;
    snprintf(writer->id, sizeof writer->id, "%s", id);
    writer->fd = -1;
    atomic_init(&writer->n_references, 2); /* the caller's and the registry's */
    atomic_init(&writer->heard_ms, uploads_clock_ms());
    pthread_mutex_init(&writer->settling, NULL);
    pthread_mutex_init(&writer->io, NULL);
    pthread_mutex_lock(&writer->settling);
    writer->is_entering = true;
    return writer;
}

void writer_release(struct upload_writer *writer)
{
    if (atomic_fetch_sub(&writer->n_references, 1) > 1)
        return;
    if (writer->fd >= 0)
        close(writer->fd);
    EVP_MD_CTX_free(writer->hash);
    pthread_mutex_destroy(&writer->settling);
    pthread_mutex_destroy(&writer->io);
    free(writer);
}

/* --- the registry; its lock is held ------------------------------------------------------- */

static struct upload_writer **place_of(struct uploads *uploads, const char *id)
{
    struct upload_writer **at = &uploads->writers;
    while (*at && strcmp((*at)->id, id) != 0)
        at = &(*at)->next;
    return at;
}

struct upload_writer *writer_find(struct uploads *uploads, const char *id)
{
    pthread_mutex_lock(&uploads->lock);
    struct upload_writer *writer = *place_of(uploads, id);
    if (writer)
        atomic_fetch_add(&writer->n_references, 1);
    pthread_mutex_unlock(&uploads->lock);
    return writer;
}

/* --- making durable ------------------------------------------------------------------------ */

/* How far its bytes may count; nothing of a piece that another has taken over or that is not verified. */
static bool may_settle(struct upload_writer *writer, uint64_t *n_written)
{
    pthread_mutex_lock(&writer->io);
    *n_written = writer->n_written;
    bool may = writer->fd >= 0 && !writer->revoked && !writer->broken && writer->is_verified;
    pthread_mutex_unlock(&writer->io);
    return may && *n_written > writer->n_durable;
}

/* After a sync that failed the kernel may have let go of bytes that it says it wrote: none of them counts. */
static groom_status sync_writer(struct upload_writer *writer, struct groom_diag *diag)
{
    const struct uploads_options *options = &writer->uploads->options;
    if (options->system->sync(writer->fd) == 0)
        return GROOM_OK;
    int error = errno;
    pthread_mutex_lock(&writer->io);
    writer->broken = true;
    pthread_mutex_unlock(&writer->io);
    return groom_fail(diag, error == ENOSPC || error == EDQUOT ? GROOM_ENOSPC : GROOM_EIO, "syncing an upload: %s",
                      strerror(error));
}

static groom_status settle(struct upload_writer *writer, struct groom_diag *diag)
{
    const struct uploads_options *options = &writer->uploads->options;
    uint64_t n_written;
    if (!may_settle(writer, &n_written))
        return GROOM_OK;
    groom_status status = sync_writer(writer, diag);
    if (status == GROOM_OK)
        status = store_upload_advance(options->store, writer->id, n_written, store_now_ms() + options->expiry_ms, diag);
    if (status == GROOM_OK)
        writer->n_durable = n_written;
    return status;
}

groom_status writer_settle(struct upload_writer *writer, struct groom_diag *diag)
{
    pthread_mutex_lock(&writer->settling);
    groom_status status = settle(writer, diag);
    pthread_mutex_unlock(&writer->settling);
    return status;
}

bool writer_try_settle(struct upload_writer *writer)
{
    if (pthread_mutex_trylock(&writer->settling) != 0)
        return false;
    groom_status status = settle(writer, NULL);
    (void)status; /* nothing was acknowledged; the sender is told the offset that the row has */
    pthread_mutex_unlock(&writer->settling);
    return true;
}

/* Its last bytes are made durable, then none of its calls does anything. With `settling` held, so that
 * a settling under way ends before the successor looks how far the upload is. */
static void put_out(struct upload_writer *writer)
{
    pthread_mutex_lock(&writer->settling);
    groom_status status = settle(writer, NULL);
    (void)status; /* what could not be made durable is sent again */
    pthread_mutex_lock(&writer->io);
    writer->revoked = true;
    pthread_mutex_unlock(&writer->io);
    pthread_mutex_unlock(&writer->settling);
}

/* --- coming and going ------------------------------------------------------------------------- */

static bool is_in_office(const struct uploads *uploads, const struct upload_writer *writer)
{
    return !writer->ended && uploads_clock_ms() - atomic_load(&writer->heard_ms) < uploads->options.silence_ms;
}

groom_status writer_enter(struct uploads *uploads, const char *id, bool anyone, struct upload_writer **writer,
                          struct groom_diag *diag)
{
    struct upload_writer *made = writer_create(uploads, id);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for an upload");
    pthread_mutex_lock(&uploads->lock);
    struct upload_writer **at = place_of(uploads, id), *former = *at;
    bool refused = former && !anyone && is_in_office(uploads, former);
    if (!refused) {
        made->next = former ? former->next : NULL;
        *at = made;
    }
    pthread_mutex_unlock(&uploads->lock);
    if (refused) {
        writer_ready(made);
        atomic_store(&made->n_references, 1);
        writer_release(made);
        return groom_fail(diag, GROOM_ECONFLICT, "another request is sending to this upload");
    }
    if (former) {
        put_out(former);
        writer_release(former);
    }
    *writer = made;
    return GROOM_OK;
}

void writer_ready(struct upload_writer *writer)
{
    writer->is_entering = false;
    pthread_mutex_unlock(&writer->settling);
}

void writer_leave(struct upload_writer *writer)
{
    struct uploads *uploads = writer->uploads;
    if (writer->is_entering)
        writer_ready(writer);
    pthread_mutex_lock(&uploads->lock);
    struct upload_writer **at = place_of(uploads, writer->id);
    bool present = *at == writer;
    if (present)
        *at = writer->next;
    pthread_mutex_unlock(&uploads->lock);
    if (present)
        writer_release(writer);
    writer_release(writer);
}
