/* The inside of struct groom_bvh: Embree's scene, pseudo-normals, and the winding tree. */
#ifndef GEOMETRY_BVH_H
#define GEOMETRY_BVH_H

#include <embree3/rtcore.h>

#include "geometry/vec.h"
#include "groom/spatial.h"

struct winding_tree;

struct groom_bvh {
    const struct groom_mesh *mesh;
    const struct groom_allocator *allocator;
    RTCDevice device;
    RTCScene scene;
    float (*face_normals)[3];      /* [n_triangles] unit, zero where it has no area */
    float (*edge_normals)[3][3];   /* [n_triangles] of the edge opposite to each corner */
    float (*vertex_normals)[3];    /* [n_vertices] */
    struct winding_tree *winding;
};

/* Pseudo-normals of faces, edges and vertices, with vertices at one place taken as one. */
GROOM_MUST_CHECK groom_status bvh_pseudo_normals(struct groom_bvh *bvh, struct groom_diag *diag);

GROOM_MUST_CHECK groom_status winding_tree_create(const struct groom_mesh *mesh, const struct groom_allocator *allocator,
                                                  struct winding_tree **tree, struct groom_diag *diag);
void winding_tree_destroy(struct winding_tree *tree);
double winding_number(const struct winding_tree *tree, struct vec point);

/* The closest point of a triangle, as weights of its corners (Ericson 2005, section 5.1.5); right
 * for triangles of no area too. */
void closest_on_triangle(struct vec p, const struct vec corner[3], double weight[3]);

#endif
