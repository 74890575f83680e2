/* Saving a fit with the daemon, and taking it up again. */
#ifndef WORKER_CHECKPOINT_H
#define WORKER_CHECKPOINT_H

#include "groom/fit.h"
#include "server/worker/blob.h"

struct checkpoints {
    unsigned char *bytes;      /* of the last one, kept for the next */
    size_t n_bytes, capacity;
    uint32_t stage;            /* stages done at the last one */
    double saved_at_s;
};

/* Where the clock starts: at `stage` stages done. */
void checkpoints_init(struct checkpoints *checkpoints, const struct groom_fit *fit);
void checkpoints_finish(struct checkpoints *checkpoints);

/* Save after a step where a stage has ended or two seconds have gone by; `now`: in any case.
 * returns  GROOM_OK, GROOM_ENOMEM, what work_link_call returns */
GROOM_MUST_CHECK groom_status checkpoints_save(struct checkpoints *checkpoints, const struct groom_fit *fit, int now,
                                               struct work_link *link, struct groom_diag *diag);

/* Load what an earlier attempt saved. One that does not fit (other inputs, another version, damaged)
 * is passed over with a warning on standard error: the fit starts anew.
 * returns  GROOM_OK, GROOM_ENOMEM, what work_link_call returns */
GROOM_MUST_CHECK groom_status checkpoints_load(struct groom_fit *fit, const struct order_blob *name,
                                               struct work_link *link, const struct groom_context *context,
                                               struct groom_diag *diag);

/* Stages that are done. */
uint32_t checkpoints_stage(const struct groom_fit *fit);

#endif
