/* A sheet of surface laid into the unit disk, and the way back: the parameters u of Eqs. 18 and 19. */
#ifndef RETARGET_FLAT_H
#define RETARGET_FLAT_H

#include "retarget/surface.h"

struct flat {
    const struct surface *surface;
    const struct sheet *sheet;
    double (*u)[2]; /* [sheet->n_vertices] */
    const struct groom_allocator *allocator;
};

struct flat_place {
    uint32_t triangle;    /* of the sheet */
    double barycentric[3]; /* of its corners; beyond 0..1 only where the place is in a hole or outside */
};

/* The discrete harmonic map (Eck et al. 1995) with the longest boundary loop on the unit circle by arc
 * length. Cotangents are kept above a small positive number, so that no triangle turns over (Tutte 1963).
 * surface, sheet  borrowed until flat_finish
 * returns         GROOM_OK, GROOM_ENOMEM, GROOM_EDEGENERATE; finish it in any case */
GROOM_MUST_CHECK groom_status flat_init(struct flat *flat, const struct surface *surface, const struct sheet *sheet,
                                        struct groom_diag *diag);
void flat_finish(struct flat *flat); /* takes what is zeroed */

/* The triangle that holds u, walking from triangle `hint`.
 * returns  1; 0 where u lies in none: then the place is of the triangle that comes nearest to holding it */
int flat_locate(const struct flat *flat, const double u[2], uint32_t hint, struct flat_place *place);
struct vec flat_point(const struct flat *flat, const struct flat_place *place); /* x of Eq. 18 */
void flat_jacobian(const struct flat *flat, uint32_t triangle, double jacobian[3][2]); /* dx/du there */
/* The parameters of a point of the surface; 0 where its triangle is not of the sheet. */
int flat_parameters(const struct flat *flat, uint32_t surface_triangle, const float barycentric[3], double u[2]);

/* A displacement of some of a sheet's vertices spread over the others, harmonic in the surface's metric.
 * Kept, for many displacements of the same vertices. */
struct cholesky;
struct spread {
    const struct sheet *sheet;
    double *weight;          /* [row_first[n]] of the Laplacian, as sheet->row */
    uint32_t *unknown;       /* [n_vertices] its equation; SURFACE_NONE: given */
    uint32_t n_unknowns;
    uint32_t *first, *column; /* pattern of the unknowns' matrix */
    double *value, *x;
    struct cholesky *factor;
    const struct groom_allocator *allocator;
};

/* given    [sheet->n_vertices] whether a vertex's displacement is given */
GROOM_MUST_CHECK groom_status spread_init(struct spread *spread, const struct surface *surface, const struct sheet *sheet,
                                          const unsigned char *given, struct groom_diag *diag);
void spread_finish(struct spread *spread); /* takes what is zeroed */
/* Fill in the values of those not given; values are `width` numbers a vertex. */
void spread_solve(struct spread *spread, double *values, uint32_t width);

#endif
