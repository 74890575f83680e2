/* Questions about where things are: the surface of a mesh (Embree), nearest neighbours (FLANN),
 * Delaunay triangulation (Qhull).
 *
 * Everything created here is read-only afterwards and may be asked from many threads at once.
 * The answers are exact, and the same bits for any pool. */
#ifndef GROOM_SPATIAL_H
#define GROOM_SPATIAL_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- the surface of a mesh ------------------------------------------------ */

struct groom_bvh;

/* Index a mesh for the questions below.
 * mesh     borrowed until groom_bvh_destroy
 * returns  GROOM_OK, GROOM_EINVAL (an index out of range, a point that is not finite), GROOM_EEMPTY
 *          (no triangle), GROOM_ENOMEM, GROOM_EINTERNAL (Embree; its own memory is not the context's) */
GROOM_MUST_CHECK groom_status groom_bvh_create(const struct groom_mesh *mesh,
                                               const struct groom_context *context,
                                               struct groom_bvh **bvh, struct groom_diag *diag);
void groom_bvh_destroy(struct groom_bvh *bvh); /* takes NULL */
const struct groom_mesh *groom_bvh_mesh(const struct groom_bvh *bvh);

struct groom_surface_point {
    uint32_t triangle;
    float barycentric[3]; /* weights of the triangle's corners; sum to 1 */
    float position[3];
    /* Unit. Of a closest point: the angle-weighted pseudo-normal of the face, edge or vertex that it
     * lies on (Baerentzen and Aanaes 2005), whose side tells inside from outside near a well-made
     * surface. Of a ray: the normal of the triangle. Zero where there is none. */
    float normal[3];
    float distance;       /* from the query point; along the ray in units of its direction */
};

/* The nearest point of the surface within max_distance (INFINITY: anywhere). Ties go to the lower
 * triangle index.
 * returns  1, or 0 where there is none or the query is not finite; *closest is set only with 1 */
int groom_bvh_closest(const struct groom_bvh *bvh, const float point[3], float max_distance,
                      struct groom_surface_point *closest);

/* The first hit of origin + t direction, t_min <= t <= t_max, from either side. direction need not
 * be of unit length. Watertight along shared edges.
 * returns  1, or 0 where there is none or the query is not finite */
int groom_bvh_ray(const struct groom_bvh *bvh, const float origin[3], const float direction[3],
                  float t_min, float t_max, struct groom_surface_point *hit);

/* Whether anything lies between. Faster than groom_bvh_ray. */
int groom_bvh_occluded(const struct groom_bvh *bvh, const float origin[3], const float direction[3],
                       float t_min, float t_max);

/* How often the surface winds around a point: 1 inside a closed surface, 0 outside; for an open one
 * (a head cut at the neck) a smooth number between (Jacobson et al. 2013, by the tree of Barill et
 * al. 2018, Eq. 15; within about 0.05 of the exact sum). 0 for a point that is not finite. */
float groom_bvh_winding(const struct groom_bvh *bvh, const float point[3]);

/* |winding| > 1/2: right for closed, open, doubled, self-intersecting and inside-out surfaces alike. */
int groom_bvh_inside(const struct groom_bvh *bvh, const float point[3]);

/* Distance to the surface, negative inside (by groom_bvh_inside). INFINITY for a point that is not finite. */
float groom_bvh_signed_distance(const struct groom_bvh *bvh, const float point[3]);

/* Signed distances of n points.
 * out      [n], the caller's */
void groom_bvh_signed_distances(const struct groom_bvh *bvh, const float (*points)[3], uint32_t n, float *out,
                                const struct groom_context *context);

/* Closest points of n points, anywhere. A query that is not finite gets triangle UINT32_MAX and
 * distance INFINITY.
 * out      [n], the caller's */
void groom_bvh_closest_points(const struct groom_bvh *bvh, const float (*points)[3], uint32_t n,
                              struct groom_surface_point *out, const struct groom_context *context);

/* --- nearest neighbours ---------------------------------------------------- */

struct groom_neighbours;

/* Index n points of `dimension` numbers each.
 * points   [n][dimension], finite; copied
 * returns  GROOM_OK, GROOM_EINVAL (a point that is not finite, dimension 0), GROOM_EEMPTY (n = 0),
 *          GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_neighbours_create(const float *points, uint32_t n, uint32_t dimension,
                                                      const struct groom_context *context,
                                                      struct groom_neighbours **neighbours,
                                                      struct groom_diag *diag);
void groom_neighbours_destroy(struct groom_neighbours *neighbours); /* takes NULL */

/* The k nearest points of each query, nearest first; equal distances by lower index.
 * queries  [n_queries][dimension], finite
 * ids      [n_queries][k]
 * squared  [n_queries][k] squared distances, or NULL
 * Where k is larger than the number of points n, the entries from n on are UINT32_MAX and INFINITY.
 * returns  GROOM_OK, GROOM_EINVAL (k = 0, a query that is not finite), GROOM_ENOMEM; the outputs
 *          are unspecified on error */
GROOM_MUST_CHECK groom_status groom_neighbours_find(const struct groom_neighbours *neighbours,
                                                    const float *queries, uint32_t n_queries, uint32_t k,
                                                    uint32_t *ids, float *squared,
                                                    const struct groom_context *context,
                                                    struct groom_diag *diag);

/* --- Delaunay triangulation -------------------------------------------------- */

struct groom_triangulation {
    uint32_t n_points, n_triangles, n_edges;
    uint32_t *same_as;        /* [n_points] the lowest index of a point at the same place; itself mostly */
    uint32_t (*triangles)[3]; /* [n_triangles] counter-clockwise, lowest index first, sorted */
    uint32_t (*edges)[2];     /* [n_edges] lower index first, sorted */
    const struct groom_allocator *allocator;
};

/* Delaunay triangulation of n points of the plane. Triangles and edges name only points with
 * same_as[i] == i. Points that all lie on one line have no triangle and the edges of the path
 * along it; one place alone has no edge.
 * returns  GROOM_OK, GROOM_EINVAL (a point that is not finite), GROOM_EEMPTY (n = 0), GROOM_ENOMEM,
 *          GROOM_EINTERNAL with Qhull's own words */
GROOM_MUST_CHECK groom_status groom_triangulation_create(const float (*points)[2], uint32_t n,
                                                         const struct groom_context *context,
                                                         struct groom_triangulation **triangulation,
                                                         struct groom_diag *diag);
void groom_triangulation_destroy(struct groom_triangulation *triangulation); /* takes NULL */

#ifdef __cplusplus
}
#endif
#endif
