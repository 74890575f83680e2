/* Operators that hair does not need.
 *
 * Where nobody names the operators, all five are fitted. One that the hair was not made with then meets a part of what
 * another one does, a little better than that alone would, as chance has it: straight hair's scale was told 20 % low beside
 * curls of a tenth of a millimetre, spiky hair's 45 %. So what statistics are met about as well without is left out, and the
 * others are told again. */
#ifndef FIT_PRUNE_H
#define FIT_PRUNE_H

#include "fit/state.h"

/* One after the other, the bend, curl or clump that is missed least has no effect from now on (its first parameter is 0, the
 * others as operators begin), until one is missed; the parameters of the others go along. A note says which.
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED; parameters may have changed on error */
GROOM_MUST_CHECK groom_status prune_operators(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag);

#endif
