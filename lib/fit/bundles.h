/* Which strands curl and clump together. */
#ifndef FIT_BUNDLES_H
#define FIT_BUNDLES_H

#include "fit/state.h"

/* Strands of one operator guide share its curl and close in on it; nearness on the scalp alone does not tell
 * which do. Strands of a bundle differ by their roots, less towards the tip:
 *     x_ij - x_kj = rest_j (root_i - root_k) + noise
 * and by their lengths, which say nothing of bundles. Within a bundle neighbours are much more alike than
 * across its border, even where its far ends are not: strands are merged across borders of least difference
 * (fit/regions.h) until there are as many bundles as operator guides. The guide nearest to the middle of a
 * bundle becomes its operator guide, and is moved there with the shape that guides have around: strands close
 * in on it from where they stand, so that a root elsewhere would bend it by as much.
 *
 * Fills operator_guide and operator_guide_of of the fit's groom, and moves those guides and their centroids.
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status bundles_find(struct groom_fit *fit, const struct groom_context *context,
                                           struct groom_diag *diag);

/* Moves each operator guide, as it is shaped, to the middle of the strands that follow it, on the head.
 * returns  GROOM_OK, GROOM_ENOMEM: nothing has moved */
GROOM_MUST_CHECK groom_status bundles_centre(struct groom_fit *fit, const struct groom_context *context,
                                             struct groom_diag *diag);

#endif
