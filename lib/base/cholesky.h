/* Direct solution of sparse symmetric positive definite systems, in double: the pattern is ordered and
 * analysed once, factored for each set of values, solved for each right-hand side. One thread, same bits. */
#ifndef BASE_CHOLESKY_H
#define BASE_CHOLESKY_H

#include <stdint.h>

#include "groom/context.h"

struct cholesky;

/* The pattern of an n x n matrix by rows: columns column[first[i] .. first[i + 1] - 1] of row i, both
 * triangles, each column once, the diagonal among them; borrowed until destroyed.
 * Ordered by nested dissection of the pattern's graph (George 1973), separators from breadth-first levels.
 * returns  NULL where memory is out */
struct cholesky *cholesky_create(uint32_t n, const uint32_t *first, const uint32_t *column,
                                 const struct groom_allocator *allocator);
void cholesky_destroy(struct cholesky *factor); /* takes NULL */

/* value    [first[n]] in the pattern's order; of the two triangles one is read
 * returns  0 where the matrix is not positive definite; the factor is then of no use */
int cholesky_factor(struct cholesky *factor, const double *value);

/* x        [n] the right-hand side, replaced by the solution */
void cholesky_solve(const struct cholesky *factor, double *x);

#endif
