/* Which strands curl and clump together. */
#ifndef FIT_BUNDLES_H
#define FIT_BUNDLES_H

#include "fit/state.h"

/* Strands of one operator guide share its curl and close in on it; nearness on the scalp alone does not tell
 * which do. Strands of a bundle differ by their roots, less towards the tip:
 *     x_ij - mean_bj = rest_j (root_i - root_b) + noise
 * and by their lengths, which say nothing of bundles. Clusters of strands are merged, the pair first that
 * this explains best (Ward 1963), until there are as many bundles as operator guides; then strands go where
 * they, with their neighbours on the scalp, are explained best. The guide of a bundle's middle cluster
 * becomes its operator guide.
 *
 * Fills operator_guide and operator_guide_of of the fit's groom, which has as many guides as there are clusters.
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status bundles_find(struct groom_fit *fit, const struct groom_context *context,
                                           struct groom_diag *diag);

#endif
