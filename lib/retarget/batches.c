#include "retarget/batches.h"

#include "base/progress.h"

struct batch {
    parallel_body *body;
    void *user;
    uint32_t first;
};

static void run_piece(void *user, uint32_t index, uint32_t thread)
{
    const struct batch *batch = user;
    batch->body(batch->user, batch->first + index, thread);
}

groom_status batches_run(const struct groom_context *context, const struct batches *batches, parallel_body *body, void *user,
                         struct groom_diag *diag)
{
    struct batch batch = {.body = body, .user = user};
    while (batch.first < batches->n_pieces) {
        uint32_t left = batches->n_pieces - batch.first, n = left < batches->batch ? left : batches->batch;
        if (progress_cancelled(context))
            return groom_fail(diag, GROOM_ECANCELLED, "cancelled while %s", batches->doing);
        parallel_for(context, n, run_piece, &batch);
        batch.first += n;
        if (batches->to > batches->from)
            progress_report(context, batches->from + (batches->to - batches->from) * batch.first / batches->n_pieces);
    }
    return GROOM_OK;
}
