/* The last digits of frizz. */
#ifndef FIT_CALIBRATE_H
#define FIT_CALIBRATE_H

#include "fit/state.h"

/* Amplitudes of frizz by which strands, each with the random numbers found for it, turn as sharply on average as their
 * targets: curvature is what is seen of frizz, and a mean over all vertices tells it to a few parts in a thousand, where
 * spectra of strands that are drawn anew tell it to a hundredth. Nothing else moves: sharper hair could be had by more of
 * other things as well, which have better witnesses. All frizz that is enabled changes by one factor, near 1.
 * returns  GROOM_OK, GROOM_ENOMEM; parameters are untouched on error */
GROOM_MUST_CHECK groom_status calibrate_frizz(struct groom_fit *fit, const struct groom_context *context,
                                              struct groom_diag *diag);

#endif
