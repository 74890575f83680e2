/* L-BFGS for the strands that Levenberg-Marquardt leaves going downhill: scalar, linear in elements. */
#ifndef CURVATURE_SCULPT_TAIL_H
#define CURVATURE_SCULPT_TAIL_H

#include "curvature/energy.h"

#define TAIL_MEMORY 8

/* Doubles of scratch for n elements. */
size_t tail_space(uint32_t n);

/* Minimise from q (in place), at most max_iterations; returns the energy, never more than at q.
 * space     [tail_space(n)]
 * junction  [n + 1] */
double tail_minimise(const struct sculpt_problem *problem, double (*q)[3], uint32_t max_iterations,
                     double tolerance, double most_turning, double *space, struct chain_state *junction,
                     uint32_t *iterations, int *converged);

#endif
