/* The connectivity of a mesh's surface, and pieces of it: what regions, maps and membranes stand on.
 *
 * Vertices at one place are one (meshes are cut along texture seams): `corners` names the lowest of them. */
#ifndef RETARGET_SURFACE_H
#define RETARGET_SURFACE_H

#include <stdint.h>

#include "geometry/vec.h"
#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"

#define SURFACE_NONE UINT32_MAX

struct surface {
    const struct groom_mesh *mesh;
    uint32_t n_vertices, n_triangles;
    uint32_t *welded;            /* [n_vertices] the lowest vertex at the same place */
    uint32_t (*corners)[3];      /* [n_triangles] welded */
    uint32_t (*across)[3];       /* [n_triangles] the triangle across the side opposite to each corner, where exactly
                                    two meet and agree in direction; else SURFACE_NONE */
    uint32_t *star_first, *star; /* [n_vertices + 1], [3 n_triangles]: triangles around each vertex */
    const struct groom_allocator *allocator;
};

/* mesh     borrowed until surface_finish
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status surface_init(struct surface *surface, const struct groom_mesh *mesh,
                                           const struct groom_allocator *allocator, struct groom_diag *diag);
void surface_finish(struct surface *surface); /* takes what is zeroed */

static inline struct vec surface_point(const struct surface *surface, uint32_t vertex)
{
    return vec_of(surface->mesh->points[vertex]);
}
double surface_area(const struct surface *surface, uint32_t triangle);

/* Distances along edges: `distance` [n_vertices] comes with 0 or more at the seeds and INFINITY elsewhere, and is
 * lowered up to `limit`.
 * returns  0 where memory is out */
int surface_distances(const struct surface *surface, double limit, double *distance);

/* --- sets of triangles: a byte each ---------------------------------------------------------- */

/* Keep the connected part of the set with the most weight (per triangle, or NULL: area).
 * returns  0 where memory is out */
int surface_keep_largest(const struct surface *surface, unsigned char *set, const uint32_t *weight);
/* Fill holes: of the parts of the complement that touch the set all but the largest join it; so do
 * triangles around vertices at which the set would hang by a point, and those it surrounds on two sides.
 * returns  0 where memory is out */
int surface_fill(const struct surface *surface, unsigned char *set);

/* --- a set as a mesh of its own ----------------------------------------------------------------- */

struct sheet {
    uint32_t n_vertices, n_triangles;
    uint32_t *vertex_of;         /* [n_vertices] of the surface */
    uint32_t *triangle_of;       /* [n_triangles] of the surface, ascending */
    uint32_t (*triangles)[3];    /* [n_triangles] */
    uint32_t (*across)[3];       /* [n_triangles] within the sheet */
    uint32_t n_loop, *loop;      /* the longest boundary loop, the sheet on its left; 0: it is closed */
    uint32_t n_loops;            /* all */
    uint32_t *row_first, *row;   /* [n_vertices + 1] the neighbours of each vertex and itself, ascending */
    uint32_t *local_vertex, *local_triangle; /* [of the surface] SURFACE_NONE where not in the sheet */
    uint32_t n_surface_vertices, n_surface_triangles;
    const struct groom_allocator *allocator;
};

/* set      at least one triangle
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status sheet_init(struct sheet *sheet, const struct surface *surface, const unsigned char *set,
                                         struct groom_diag *diag);
void sheet_finish(struct sheet *sheet); /* takes what is zeroed */

/* Where (row, column) stands in the sheet's rows; they are neighbours or the same. */
uint32_t sheet_entry(const struct sheet *sheet, uint32_t row, uint32_t column);

#endif
