/* Instancing weights of strands from their own shapes. */
#ifndef FIT_WEIGHTS_H
#define FIT_WEIGHTS_H

#include "fit/state.h"

struct weights_loss { double before, after; }; /* squared distances (Eq. 5), summed over strands, in the target's frame */

/* Chooses and weighs the guides that strands first .. first+count-1 blend: weights that are not negative and
 * sum to 1, over at most interpolation_guides of the candidates nearest on the scalp, which
 *     minimise |blend of the clusters' mean strands - strand|^2 off the strand's ways  +  pull |w - w0|^2
 * (fit/strand_model.h). w0 are the weights by distance of Eq. 3 among those candidates that are not much less
 * like the strand than neighbours usually are: guides beyond a parting are. The pull is `distance_pull` times
 * what free weights leave of the usual strand, so that weights move away from w0 as far as strands show it
 * beyond their scatter. Where the operators were not named, strands have no ways, and the pull is weak.
 * loss     added to
 * returns  GROOM_OK, GROOM_ENOMEM; a function of the state alone, the same bits for any pool */
GROOM_MUST_CHECK groom_status weights_solve(struct groom_fit *fit, uint32_t first, uint32_t count,
                                            const struct groom_context *context, struct weights_loss *loss,
                                            struct groom_diag *diag);

#endif
