#include "server/worker/checkpoint.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/work.h"
#include "server/worker/clock.h"

#define INTERVAL_S 2.0

uint32_t checkpoints_stage(const struct groom_fit *fit)
{
    struct groom_fit_progress progress;
    groom_fit_progress(fit, &progress);
    return groom_fit_done(fit) ? progress.count : progress.index;
}

void checkpoints_init(struct checkpoints *checkpoints, const struct groom_fit *fit)
{
    memset(checkpoints, 0, sizeof *checkpoints);
    checkpoints->stage = checkpoints_stage(fit);
    checkpoints->saved_at_s = clock_s();
}

void checkpoints_finish(struct checkpoints *checkpoints)
{
    free(checkpoints->bytes);
    memset(checkpoints, 0, sizeof *checkpoints);
}

static groom_status collect(void *user, const void *bytes, size_t n_bytes)
{
    struct checkpoints *c = user;
    if (c->n_bytes + n_bytes > c->capacity) {
        size_t capacity = 2 * (c->n_bytes + n_bytes);
        unsigned char *more = realloc(c->bytes, capacity);
        if (!more)
            return GROOM_ENOMEM;
        c->bytes = more;
        c->capacity = capacity;
    }
    memcpy(c->bytes + c->n_bytes, bytes, n_bytes);
    c->n_bytes += n_bytes;
    return GROOM_OK;
}

static groom_status put(struct checkpoints *c, uint32_t stage, struct work_link *link,
                        struct groom_diag *diag)
{
    char path[sizeof WORK_PATH_CHECKPOINT + 24];
    struct http_request request = {.method = "PUT",
                                   .path = path,
                                   .content_type = "application/octet-stream",
                                   .body = c->bytes,
                                   .n_body = c->n_bytes};
    snprintf(path, sizeof path, "%s?stage=%u", WORK_PATH_CHECKPOINT, stage);
    return work_link_call(link, &request, NULL, diag);
}

groom_status checkpoints_save(struct checkpoints *checkpoints, const struct groom_fit *fit, int now,
                              struct work_link *link, struct groom_diag *diag)
{
    uint32_t stage = checkpoints_stage(fit);
    if (!now && stage == checkpoints->stage && clock_s() - checkpoints->saved_at_s < INTERVAL_S)
        return GROOM_OK;
    checkpoints->n_bytes = 0;
    groom_status st = groom_fit_save(fit, (struct groom_sink){.write = collect, .user = checkpoints}, diag);
    if (st == GROOM_OK)
        st = put(checkpoints, stage, link, diag);
    checkpoints->stage = stage;
    checkpoints->saved_at_s = clock_s();
    return st;
}

groom_status checkpoints_load(struct groom_fit *fit, const struct order_blob *name, struct work_link *link,
                              const struct groom_context *context, struct groom_diag *diag)
{
    struct blob blob = {0};
    struct groom_memory_source memory;
    struct groom_diag reason = {0};
    groom_status st = blob_fetch(link, name, &blob, &reason);
    if (st == GROOM_OK) {
        struct groom_source source = groom_source_from_memory(&memory, blob.bytes, blob.n_bytes);
        st = groom_fit_load(fit, &source, context, &reason);
    }
    blob_release(&blob);
    if (st == GROOM_OK || st == GROOM_ECANCELLED)
        return st;
    if (st == GROOM_ENOMEM)
        return groom_fail(diag, st, "no memory for the checkpoint");
    fprintf(stderr, "groom-worker: warning: the checkpoint is not used, the job starts anew: %s\n",
            reason.detail);
    return GROOM_OK;
}
