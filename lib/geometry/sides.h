/* The sides of a mesh's triangles, edge by edge, with vertices at one place taken as one. */
#ifndef GEOMETRY_SIDES_H
#define GEOMETRY_SIDES_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"

/* A side of a triangle; those of one edge stand together. */
struct mesh_side {
    uint32_t low, high;        /* welded vertices of the edge, low <= high */
    uint32_t triangle, corner; /* the side lies opposite to the corner */
};

struct mesh_sides {
    uint32_t n_vertices;
    uint32_t *welded; /* [n_vertices] the lowest vertex at the same place: meshes are cut along texture seams */
    size_t n;         /* 3 a triangle */
    struct mesh_side *sides; /* [n] by edge, then triangle, then corner */
    const struct groom_allocator *allocator;
};

/* mesh     borrowed for the call; indices in range
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status mesh_sides_init(struct mesh_sides *sides, const struct groom_mesh *mesh,
                                              const struct groom_allocator *allocator, struct groom_diag *diag);
void mesh_sides_finish(struct mesh_sides *sides); /* takes what is zeroed */

/* One past the last side of the edge whose first side is `first`. */
size_t mesh_edge_end(const struct mesh_sides *sides, size_t first);

#endif
