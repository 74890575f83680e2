/* How far a guide is from what its neighbours on the scalp would have it be. */
#ifndef FIT_GUIDE_LAPLACIAN_H
#define FIT_GUIDE_LAPLACIAN_H

#include "fit/sparse.h"
#include "groom/diag.h"

/* Row g of L is strength_g (s_g - sum_b c_gb s_b) over the neighbours b of g in the Delaunay triangulation
 * of the guides' roots in scalp coordinates (Chang et al. 2025, Section 5.4): the linear regression of the
 * neighbours, each with weight exp(-|d_g - d_b|^2 / (2 sigma_d^2)) by the directions d in which they leave
 * the scalp, read at g. So shapes that change at one rate over the scalp cost nothing, hairlines do not
 * pull, and the sides of a parting know nothing of each other; strength_g is the neighbours' mean weight.
 * uv, direction  [n]
 * laplacian      entry 0 of its values; with g's column b there is b's column g
 * returns        GROOM_OK, GROOM_ENOMEM, GROOM_EINTERNAL (Qhull); sparse_finish it in any case */
GROOM_MUST_CHECK groom_status guide_laplacian(const float (*uv)[2], const float (*direction)[3], uint32_t n,
                                              double sigma_d, struct sparse *laplacian,
                                              const struct groom_context *context, struct groom_diag *diag);

#endif
