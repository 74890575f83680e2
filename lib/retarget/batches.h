/* A parallel loop that looks between batches of its pieces whether to stop, and tells how far it is. */
#ifndef RETARGET_BATCHES_H
#define RETARGET_BATCHES_H

#include "base/parallel.h"
#include "groom/diag.h"

struct batches {
    uint32_t n_pieces, batch;
    double from, to;          /* progress before the first piece and after the last; the same: it is not told */
    const char *doing;        /* "cancelled while ..." */
};

/* As parallel_for over all pieces, each once.
 * returns  GROOM_OK, GROOM_ECANCELLED */
groom_status batches_run(const struct groom_context *context, const struct batches *batches, parallel_body *body, void *user,
                         struct groom_diag *diag);

#endif
