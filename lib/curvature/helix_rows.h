/* Many helices through pairs of point-tangents, four at a time (curvature/helix.h has one). */
#ifndef CURVATURE_HELIX_ROWS_H
#define CURVATURE_HELIX_ROWS_H

#include <stdint.h>

/* helix_through for every pair of neighbours.
 * p, t     [n + 1] points and unit tangents
 * omega    [n] Darboux vectors in the world
 * length   [n] */
typedef void helix_chain_function(uint32_t n, const double (*p)[3], const double (*t)[3], double (*omega)[3],
                                  double *length);
helix_chain_function helix_chain;
/* The same, per instruction set; every variant gives the same bits. */
helix_chain_function helix_chain_generic, helix_chain_avx2;

/* helix_through in these terms. */
void helix_through_pair(const double p0[3], const double t0[3], const double p1[3], const double t1[3],
                        double omega[3], double *length);

#endif
