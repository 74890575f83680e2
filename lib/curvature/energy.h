/* Eq. 15 of one strand and its gradient, scalar and linear in the elements: what the solver's tail
 * uses, and what the tests hold the kernels against. */
#ifndef CURVATURE_ENERGY_H
#define CURVATURE_ENERGY_H

#include <stdint.h>

#include "curvature/chain.h"
#include "curvature/sculpt_lanes.h"

/* sum_k |S(lambda_k) - a_k|^2 + c |q - rest|^2. Anchors rise along the strand. */
struct sculpt_problem {
    struct chain chain;      /* its q is where the solver starts; the functions below take q apart */
    uint32_t n_anchors;
    const struct located_anchor *anchor;
    const double (*rest)[3]; /* [n] */
    double c;
};

/* Where arc length s of the chain lies. */
struct located_anchor energy_locate(const struct chain *chain, double s, const double target[3]);

/* *anchor_part: the first sum alone, or NULL. */
double energy_value(const struct sculpt_problem *problem, const double (*q)[3], double *anchor_part);

/* gradient [n][3]; junction [n + 1] scratch; returns the energy. */
double energy_gradient(const struct sculpt_problem *problem, const double (*q)[3], double (*gradient)[3],
                       struct chain_state *junction);

/* d S(element i, s) / d q_j, a 3x3 block (Eqs. 17-26 in closed form); junction from energy_junctions. */
mat3 energy_jacobian_block(const struct chain *chain, const double (*q)[3], const struct chain_state *junction,
                           uint32_t i, double s, uint32_t j);
void energy_junctions(const struct chain *chain, const double (*q)[3], struct chain_state *junction);

#endif
