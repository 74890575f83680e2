/* Angle-weighted pseudo-normals (Baerentzen and Aanaes 2005): of a vertex, the sum of its faces'
 * normals weighted by their angles there; of an edge, the sum of its two faces' normals. */
#include <string.h>

#include "base/memory.h"
#include "geometry/bvh.h"
#include "geometry/sides.h"

static struct vec face_normal(const struct groom_mesh *mesh, uint32_t t)
{
    const uint32_t *v = mesh->triangles[t];
    struct vec a = vec_of(mesh->points[v[0]]);
    return vec_unit(vec_cross(vec_sub(vec_of(mesh->points[v[1]]), a), vec_sub(vec_of(mesh->points[v[2]]), a)));
}

static double angle_at(const struct groom_mesh *mesh, uint32_t t, int corner)
{
    const uint32_t *v = mesh->triangles[t];
    struct vec o = vec_of(mesh->points[v[corner]]);
    struct vec a = vec_sub(vec_of(mesh->points[v[(corner + 1) % 3]]), o), b = vec_sub(vec_of(mesh->points[v[(corner + 2) % 3]]), o);
    return atan2(vec_length(vec_cross(a, b)), vec_dot(a, b));
}

static void vertex_normals(struct groom_bvh *bvh, const uint32_t *welded, struct vec *sums)
{
    const struct groom_mesh *mesh = bvh->mesh;
    memset(sums, 0, mesh->n_vertices * sizeof *sums);
    for (uint32_t t = 0; t < mesh->n_triangles; t++) {
        struct vec n = face_normal(mesh, t);
        vec_store(n, bvh->face_normals[t]);
        for (int i = 0; i < 3; i++) {
            struct vec *sum = &sums[welded[mesh->triangles[t][i]]];
            *sum = vec_add(*sum, vec_scale(n, angle_at(mesh, t, i)));
        }
    }
    for (uint32_t i = 0; i < mesh->n_vertices; i++)
        vec_store(vec_unit(sums[welded[i]]), bvh->vertex_normals[i]);
}

static void edge_normals(struct groom_bvh *bvh, const struct mesh_sides *sides)
{
    for (size_t first = 0, end; first < sides->n; first = end) {
        struct vec sum = {0, 0, 0};
        end = mesh_edge_end(sides, first);
        for (size_t i = first; i < end; i++)
            sum = vec_add(sum, face_normal(bvh->mesh, sides->sides[i].triangle));
        for (size_t i = first; i < end; i++)
            vec_store(vec_unit(sum), bvh->edge_normals[sides->sides[i].triangle][sides->sides[i].corner]);
    }
}

groom_status bvh_pseudo_normals(struct groom_bvh *bvh, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = bvh->allocator;
    struct mesh_sides sides = {0};
    struct vec *sums = memory_array(allocator, bvh->mesh->n_vertices, sizeof *sums);
    groom_status st = sums ? mesh_sides_init(&sides, bvh->mesh, allocator, diag)
                           : groom_fail(diag, GROOM_ENOMEM, "no memory for the normals of the mesh");
    if (st == GROOM_OK) {
        vertex_normals(bvh, sides.welded, sums);
        edge_normals(bvh, &sides);
    }
    mesh_sides_finish(&sides);
    memory_release(allocator, sums, bvh->mesh->n_vertices, sizeof *sums);
    return st;
}
