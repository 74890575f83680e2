/* What strands have of their own, to be had back: the guides they are blended from and at what weights, the operator
 * guide they follow, and their random numbers. */
#ifndef FIT_STRAND_STATE_H
#define FIT_STRAND_STATE_H

#include "groom/groom.h"

struct strand_state {
    const uint32_t *strand; /* [n] borrowed, or NULL: from `first` on */
    uint32_t first, n, n_instancing, n_operators;
    uint32_t *guide;        /* [n][n_instancing] */
    float *weight;          /* [n][n_instancing] */
    uint32_t *follows;      /* [n] */
    float *number;          /* [n][n_operators], of those that draw one a strand */
};

/* Whether an operator draws one random number a strand. */
int strand_state_draws(const struct groom_operator *op);

/* As n strands stand in the groom: those of `strand`, or first .. first + n - 1.
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status strand_state_init(struct strand_state *state, const struct groom *groom, const uint32_t *strand,
                                                uint32_t first, uint32_t n, const struct groom_allocator *allocator,
                                                struct groom_diag *diag);
void strand_state_finish(struct strand_state *state, const struct groom_allocator *allocator);

/* The strand at place `at`: as it stands now; and as it was. */
void strand_state_keep(struct strand_state *state, const struct groom *groom, uint32_t at);
void strand_state_give_back(const struct strand_state *state, struct groom *groom, uint32_t at);

#endif
