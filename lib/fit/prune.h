/* Operators that hair does not need.
 *
 * Where nobody names the operators, all five are fitted. Those that the hair was not made with then meet a little of what
 * chance does: curls of a tenth of a millimetre, bends of a degree, as sliders that do nothing and numbers that are looked for
 * in vain. So what statistics are met about as well without is left out, and the others are told again. */
#ifndef FIT_PRUNE_H
#define FIT_PRUNE_H

#include "fit/state.h"

/* Whether the operators were not named, and there are strands enough to tell which are needed. */
int prune_tells(const struct groom_fit *fit);

/* One after the other, the bend, curl or clump that is missed least has no effect from now on (its first parameter is 0, the
 * others as operators begin), until one is missed; the parameters of the others go along. A note says which.
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED; parameters may have changed on error */
GROOM_MUST_CHECK groom_status prune_operators(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag);

#endif
