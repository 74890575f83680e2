/* Where operator guides stand that take on other strands. */
#ifndef FIT_SPARE_GUIDES_H
#define FIT_SPARE_GUIDES_H

#include "fit/state.h"
#include "fit/trades.h"

/* The operator guide becomes the guide nearest to the middle of the strands that follow it now, of those that neither are
 * nor were any; where all guides are, its own goes there, and strands that were blended from it are of their other guides.
 * It stands in the middle of its strands, in the mean shape of their blends.
 * was    the groom before
 * shape  [m] scratch */
void spare_guide_take(struct groom *groom, const struct groom *was, uint32_t spare, double (*shape)[3]);
/* The same again, once other strands follow it. */
void spare_guide_stand(struct groom *groom, uint32_t spare, double (*shape)[3]);

/* As it was before, and the strands' weights with it. */
void spare_guide_put_back(struct groom *groom, const struct groom *was, uint32_t spare);

/* After trades: all that take part go to their likeliest places (fit/sites.h), clusters of guides that were taken become
 * those of their strands, and strands that had or would have a guide that moved are blended anew (fit/weights.h).
 * kept     [trades.n] whether a trade holds
 * returns  GROOM_OK, GROOM_ENOMEM: the groom may have changed, nothing else has */
GROOM_MUST_CHECK groom_status spare_guides_settle(struct groom_fit *fit, const struct trades *trades, const uint8_t *kept,
                                                  const struct groom_context *context, struct groom_diag *diag);

#endif
