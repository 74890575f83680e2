/* Strands that no camera sees, and outliers: taken out of the target, put back into the groom. */
#ifndef FIT_UNSEEN_H
#define FIT_UNSEEN_H

#include "fit/state.h"

/* Leaves the target with the strands that are seen and are no outliers: their order stays, n becomes their number,
 * and fit->all knows the others. Where there is no camera, or no camera sees anything, all are seen.
 * outlier  [n] 0 or 1
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status unseen_remove(struct groom_fit *fit, const unsigned char *outlier,
                                            const struct groom_context *context,
                                            struct groom_diag *diag);

/* A groom of all strands: those that are seen as the fit has them, the others instanced by distance, with
 * the nearest operator guide that keeps them out of the head, and random numbers drawn from the seed. What of these is in
 * the head all the same gets what the nearest strand has that is seen and keeps it out, of 32 that are out themselves.
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status unseen_restore(const struct groom_fit *fit, const struct groom_context *context,
                                             struct groom **groom, struct groom_diag *diag);

/* Gives fit->all back. */
void unseen_finish(struct groom_fit *fit);

#endif
