/* What other stages ask of stage `guides`. */
#ifndef FIT_GUIDES_H
#define FIT_GUIDES_H

#include "fit/state.h"

/* The guides with which strands, with the random numbers that they have, come nearest to their targets: one
 * step of Gauss and Newton, smooth along and across as the stage has it.
 * returns GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED; guides are untouched on error */
GROOM_MUST_CHECK groom_status guides_refine(struct groom_fit *fit, const struct groom_context *context,
                                            struct groom_diag *diag);

#endif
