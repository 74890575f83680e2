/* The ways in which operators move a strand off what its guides make of it.
 *
 * To first order a strand is  blend_i + sum_w c_iw way_w + the rest, where a way is what a random number of one
 * standard deviation does: scale moves a strand one way (along its own shape), bend two (about the two axes
 * across its operator guide's root), and clump three (towards an operator guide whose place is not known).
 * What lies along the ways is the operators' to explain: whoever looks for weights must not count it, else he
 * takes from them. Curl and frizz make waves, which hardly look like a difference of guides. */
#ifndef FIT_STRAND_MODEL_H
#define FIT_STRAND_MODEL_H

#include "fit/state.h"

#define STRAND_WAYS 6 /* at most */

struct strand_model {
    const struct groom_fit *fit;
    uint32_t m;
    double scale, bend;        /* deviations; 0: not in the chain */
    double bend_start;
    double profile, gather;    /* of the clump; how far operator guides are from strands, a coordinate. gather 0: none */
    const double (*shape)[3];  /* [n_guides * m] of what strands are blended from, from the root, in the target's frame */
};

/* Of the fit's groom and its chain. Starting values are guesses: each operator may move strands as far as
 * they say, or as it commonly does.
 * shape  borrowed */
void strand_model_init(struct strand_model *model, const struct groom_fit *fit, const double (*shape)[3]);

/* ways [STRAND_WAYS][m] of strand i, whose guides make `blend` [m] of it; returns how many there are */
uint32_t strand_ways(const struct strand_model *model, uint32_t i, const double (*blend)[3], double (*ways)[3]);

#endif
