/* Bundles that are two, and bundles that are none. */
#ifndef FIT_REGROUP_H
#define FIT_REGROUP_H

#include "fit/strand_error.h"
#include "fit/state.h"

/* Stage initialize tells bundles by how much strands differ from their neighbours (fit/likeness.h). Where frizz is as large
 * as the difference of two curls, it takes two bundles for one, and, as their number is given, has an operator guide left
 * for strands that need none of their own. Once numbers are known, both show: strands of the former stay several times as
 * far from their targets as others, those of the latter could follow a neighbour as well (fit/trades.h). So the latter's
 * operator guide is given to the worse half of the former's strands; numbers of both curls, then of their strands, are
 * looked for, strands follow the better of the two, and numbers are looked for once more. Where that does not bring all
 * strands concerned much nearer to their targets, they have back what they had.
 *
 * weights  of strands' errors
 * returns  GROOM_OK, GROOM_ENOMEM: nothing has changed
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status regroup(struct groom_fit *fit, struct strand_error_weights weights,
                                      const struct groom_context *context, struct groom_diag *diag);

#endif
