/* Operator guides that would be worth more elsewhere. */
#ifndef FIT_TRADES_H
#define FIT_TRADES_H

#include "fit/random_search.h"

#define TRADES_NONE UINT32_MAX

/* An operator guide that strands can do without, for a bundle that looks like two. */
struct trade { uint32_t bundle, spare; };

struct trades {
    uint32_t n;
    struct trade *trade;  /* [n] */
    uint32_t *of;         /* [n_gop] the trade that an operator guide takes part in, or TRADES_NONE */
    float *error;         /* [n_strands] as they stand */
    uint32_t *other;      /* [n_strands] the operator guide that a strand would follow next, no spare */
    uint32_t n_strands, n_guides;
};

/* Bundles whose strands are farther off than is usual, the worst first and not too many at once, each with the operator
 * guide whose strands lose least by following others, as long as those lose less than the bundle has to gain.
 * search   of the fit's groom, which has operator guides
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status trades_init(struct trades *trades, struct random_search *search,
                                          const struct groom_context *context, struct groom_diag *diag);
/* Whether an operator guide is a trade's spare. */
int trades_spare(const struct trades *trades, uint32_t guide);
void trades_finish(struct trades *trades, const struct groom_allocator *allocator);

#endif
