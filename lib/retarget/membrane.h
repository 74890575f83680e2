/* A neo-Hookean membrane of triangles in space (Eqs. 15-17), each vertex of which moves with two
 * parameters (Eq. 18). */
#ifndef RETARGET_MEMBRANE_H
#define RETARGET_MEMBRANE_H

#include <stdint.h>

#include "geometry/vec.h"

/* psi(s1, s2) = mu/2 (s1^2 + s2^2 - 2 - 2 ln J) + lambda/2 (ln J)^2, J = s1 s2, of the singular values of F. */
struct membrane_material {
    double mu, lambda;
};

/* A triangle at rest. */
struct membrane_triangle {
    double area;
    double gradient[3][2]; /* of its corners' hat functions in the plane of D: rows of D^-1 and what completes them to 0 */
};

/* returns  0 where the corners span no area */
int membrane_rest(struct membrane_triangle *rest, const struct vec corner[3]);

/* Area times psi; INFINITY where the triangle has collapsed. */
double membrane_energy(const struct membrane_triangle *rest, struct membrane_material material, const struct vec x[3]);

/* Its derivatives by the corners' parameters, where x moves with jacobian[corner] = dx/du (3 x 2).
 * gradient  [6] corner by corner
 * hessian   [6][6], or NULL; `project`: to the nearest positive semidefinite one (Teran et al. 2005), by the
 *           eigenvectors of the energy in F, which are known: two of scaling, twist, flip, two out of the plane */
void membrane_derivatives(const struct membrane_triangle *rest, struct membrane_material material, const struct vec x[3],
                          const double jacobian[3][3][2], double gradient[6], double hessian[6][6], int project);

#endif
