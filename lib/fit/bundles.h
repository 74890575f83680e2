/* Which strands curl and clump together. */
#ifndef FIT_BUNDLES_H
#define FIT_BUNDLES_H

#include "fit/state.h"

/* Strands of one operator guide share its curl and close in on it; nearness on the scalp alone does not tell
 * which do. Within a bundle neighbours are much more alike (fit/likeness.h) than across its border, even where its
 * far ends are not: strands are merged across borders of least difference (fit/regions.h) until there are as many
 * bundles as operator guides. The guide nearest to the middle of a bundle becomes its operator guide, and is moved
 * to where it stands likeliest (fit/sites.h) with the shape that guides have around: strands close in on it from where
 * they stand, so that a root elsewhere would bend it by as much. Stage guides looks for a better place around it.
 *
 * Fills operator_guide and operator_guide_of of the fit's groom, and moves those guides and their centroids.
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status bundles_find(struct groom_fit *fit, const struct groom_context *context,
                                           struct groom_diag *diag);

/* Finds the scalp coordinates of operator guides that were moved.
 * returns  GROOM_OK, GROOM_ENOMEM: nothing has changed */
GROOM_MUST_CHECK groom_status bundles_coordinates(struct groom_fit *fit, const struct groom_context *context,
                                                  struct groom_diag *diag);

#endif
