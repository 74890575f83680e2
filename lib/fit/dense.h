/* Small dense symmetric systems, double precision, row-major, in plain sequential code. */
#ifndef FIT_DENSE_H
#define FIT_DENSE_H

#include <stdint.h>

/* a = L L^T: the lower triangle of a [n][n] becomes L; what is above the diagonal is left alone.
 * returns  0 where a is not positive definite; a is then spoilt */
int dense_cholesky(double *a, uint32_t n);
/* x := L^-1 x */
void dense_forward(const double *l, uint32_t n, double *x);
/* x := L^-T x */
void dense_backward(const double *l, uint32_t n, double *x);

#endif
