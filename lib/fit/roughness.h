/* How rough guides are, place by place along them, and how much of that is theirs.
 *
 * Hair that grows side by side is combed and falls alike, so what is rough in a guide is so in those next to it. What
 * operators have left in guides, whose strands' random numbers are never all found, is each guide's own. */
#ifndef FIT_ROUGHNESS_H
#define FIT_ROUGHNESS_H

#include "fit/sparse.h"

/* Of third differences that begin at a vertex, summed up over guides: their squares, and their products with what the
 * neighbours of the guide foretell. */
struct roughness { double square, shared; };

/* shape      [n_guides][m][3]
 * laplacian  [n_guides] rows of guide_laplacian.h
 * out        [m - 3] */
void roughness_measure(const double (*shape)[3], uint32_t m, const struct sparse *laplacian, struct roughness *out);

/* The share of it that neighbours have in common from vertex j on, of a part of the guide around it: 1 at most. */
double roughness_share(const struct roughness *roughness, uint32_t m, uint32_t j);

#endif
