/* Strands that cannot be hair of this head: they leave the fit, as strands do that no camera sees. */
#ifndef FIT_OUTLIERS_H
#define FIT_OUTLIERS_H

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/strands.h"

/* Marks strands whose root is more than 8 times as far from the middle of the roots as the median root, or that reach
 * farther from their root than 4 times what nine strands of ten do and 20 times that median. None is marked where it
 * would be more than a tenth of them: then they are what there is.
 * strands  each has at least 2 finite vertices
 * outlier  [n_strands] 0 or 1, the caller's
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status outliers_find(const struct groom_strands *strands, const struct groom_context *context,
                                            unsigned char *outlier, uint32_t *n_outliers, struct groom_diag *diag);

#endif
