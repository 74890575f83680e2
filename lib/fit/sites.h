/* Where operator guides stand, from which strands follow them. */
#ifndef FIT_SITES_H
#define FIT_SITES_H

#include "fit/state.h"

struct site {
    double at[3]; /* metres, on the head where there is one */
    double n;     /* strands that follow it */
};

/* Strands follow the operator guide that is nearest on the scalp (Chang et al. 2025, Section 5.2), so where strands of one
 * end and those of the next begin, both are as far: the places that such borders are likeliest for lie two to three times
 * nearer to the truth than the middles of strands, which is what few strands are left with.
 * follows  [n] which of the n_sites each strand follows
 * site     [n_sites]; one that nothing follows has no place
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status sites_find(const struct groom_fit *fit, const uint32_t *follows, uint32_t n_sites,
                                         struct site *site, const struct groom_context *context, struct groom_diag *diag);

#endif
