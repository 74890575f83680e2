/* The scalp as a membrane that stays in the surface of the head: projected Newton on Eq. 15. */
#ifndef RETARGET_EMBEDDED_H
#define RETARGET_EMBEDDED_H

#include "retarget/membrane.h"
#include "retarget/region.h"

struct embedded {
    const struct groom_scalp_region *region;
    struct membrane_material material;
    struct membrane_triangle *rest; /* [scalp.n_triangles] */
    double (*u)[2];                 /* [scalp.n_vertices] parameters */
    struct flat_place *place;       /* [n_vertices] host triangles, Eq. 19 */
    struct vec *x;                  /* [n_vertices] Eq. 18 */
    uint32_t n_newton, n_loads;     /* iterations and load steps so far */
    const struct groom_allocator *allocator;
};

/* The membrane at rest, where the scalp is.
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status embedded_init(struct embedded *membrane, const struct groom_scalp_region *region, struct groom_diag *diag);
void embedded_finish(struct embedded *membrane); /* takes what is zeroed */

/* Put every vertex at these parameters. */
void embedded_place(struct embedded *membrane, const double (*u)[2]);
double embedded_energy(const struct embedded *membrane); /* INFINITY where a triangle has collapsed */

/* Minimise the energy while the given vertices go to target, loaded in steps that turn no triangle over.
 * spread   of the scalp with the same vertices given: predicts each step
 * given, target  [scalp.n_vertices]
 * returns  GROOM_OK; GROOM_EDEGENERATE where even the smallest load step would fold it; GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status embedded_deform(struct embedded *membrane, struct spread *spread, const unsigned char *given,
                                              const double (*target)[2], const struct groom_context *context,
                                              struct groom_diag *diag);

#endif
