/* Strands out of the head: the last look at what a fit has made. */
#ifndef FIT_HEAD_CLEAR_H
#define FIT_HEAD_CLEAR_H

#include "fit/random_search.h"

/* What is left in the head, of strands that were looked at. */
struct head_left {
    float depth;                /* metres from which on a strand counts */
    uint32_t n_deep, n_beyond;  /* so deep in the head, and so much deeper in it than the deepest of their targets */
};

/* Strands first .. first + count - 1 that are in the head take Newton's steps with a stiff price on depth. Those that are
 * deeper in than the deepest of their targets come out at any cost, if need be by another operator guide near them and
 * blended from other guides: those around them, then those farther off, one after the other, at an ever stiffer price; at
 * last with all that a strand next to them has of its own.
 * Those that follow their targets in come out only where they are about as near to these as they were. What does not come
 * out has its own back: a groom has no vertices of single strands.
 * search   of the fit's groom; its weights are those of its last pass
 * left     out
 * returns  GROOM_OK, GROOM_ENOMEM; nothing has changed on error */
GROOM_MUST_CHECK groom_status head_clear(struct random_search *search, uint32_t first, uint32_t count,
                                         struct head_left *left, const struct groom_context *context,
                                         struct groom_diag *diag);

#endif
