/* The last degrees of the axes that hair was made along, off strands whose random numbers were found.
 *
 * Statistics tell turned hair's axes to within 3 to 20 degrees (axes.h). A strand whose frizz was found tells them far more
 * sharply: turned by 8 degrees, it is 4 to 40 times as far from its target, but for what its guides and numbers could make
 * good. So strands are compared with their targets across all that a guide which is off by a slow wave, or numbers that are
 * off, would move them along; and those that are explained best count most, as the others say nothing. */
#ifndef FIT_ALIGN_H
#define FIT_ALIGN_H

#include "fit/state.h"

/* Turns fit->frame, where axes are those near the hair's, to where strands come nearest to their targets. Where they tell it
 * beyond doubt, fit->axes is AXES_FOUND from then on. Numbers are left for others to move along.
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED; the fit is untouched on error
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status align_axes(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag);

#endif
