/* Least squares over weights that are not negative and sum to 1. */
#ifndef FIT_SIMPLEX_H
#define FIT_SIMPLEX_H

#include <stdint.h>

#define SIMPLEX_MOST 32

/* Minimises w' G w - 2 b' w over w >= 0, sum w = 1, with at most `support` weights above 0: an
 * active-set method (Lawson and Hanson 1974, with the sum kept) that lets in, one at a time, the
 * weight whose growth lowers the objective fastest. Without a limit on the support that is the
 * minimum; with one it is greedy.
 * gram  [n][n] symmetric, positive definite; n = 1..SIMPLEX_MOST
 * b     [n]
 * w     [n] */
void simplex_solve(const double *gram, const double *b, uint32_t n, uint32_t support, double *w);

#endif
