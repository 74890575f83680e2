/* Angle-weighted pseudo-normals (Baerentzen and Aanaes 2005): of a vertex, the sum of its faces'
 * normals weighted by their angles there; of an edge, the sum of its two faces' normals. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geometry/bvh.h"

/* Which vertex stands for all at the same place: meshes are cut along texture seams. */
struct place {
    float point[3];
    uint32_t vertex;
};

static int compare_places(const void *a, const void *b)
{
    const struct place *p = a, *q = b;
    for (int i = 0; i < 3; i++)
        if (p->point[i] != q->point[i])
            return p->point[i] < q->point[i] ? -1 : 1;
    return p->vertex < q->vertex ? -1 : p->vertex > q->vertex;
}

static int same_place(const struct place *a, const struct place *b)
{
    return a->point[0] == b->point[0] && a->point[1] == b->point[1] && a->point[2] == b->point[2];
}

static void weld(const struct groom_mesh *mesh, struct place *places, uint32_t *welded)
{
    for (uint32_t i = 0; i < mesh->n_vertices; i++) {
        memcpy(places[i].point, mesh->points[i], sizeof places[i].point);
        places[i].vertex = i;
    }
    qsort(places, mesh->n_vertices, sizeof *places, compare_places);
    for (uint32_t i = 0; i < mesh->n_vertices; i++)
        welded[places[i].vertex] = i && same_place(&places[i - 1], &places[i]) ? welded[places[i - 1].vertex] : places[i].vertex;
}

/* A side of a triangle, sorted so that the sides of one edge stand together. */
struct side {
    uint32_t low, high, triangle, corner; /* the edge lies opposite to the corner */
};

static int compare_sides(const void *a, const void *b)
{
    const struct side *p = a, *q = b;
    const uint32_t k[4] = {p->low, p->high, p->triangle, p->corner}, l[4] = {q->low, q->high, q->triangle, q->corner};
    for (int i = 0; i < 4; i++)
        if (k[i] != l[i])
            return k[i] < l[i] ? -1 : 1;
    return 0;
}

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

static void edge_normals(struct groom_bvh *bvh, const uint32_t *welded, struct side *sides)
{
    const struct groom_mesh *mesh = bvh->mesh;
    size_t n = (size_t)mesh->n_triangles * 3;
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t a = welded[mesh->triangles[t][(i + 1) % 3]], b = welded[mesh->triangles[t][(i + 2) % 3]];
            sides[(size_t)t * 3 + i] = (struct side){a < b ? a : b, a < b ? b : a, t, i};
        }
    qsort(sides, n, sizeof *sides, compare_sides);
    for (size_t first = 0, end; first < n; first = end) {
        struct vec sum = {0, 0, 0};
        for (end = first; end < n && sides[end].low == sides[first].low && sides[end].high == sides[first].high; end++)
            sum = vec_add(sum, face_normal(mesh, sides[end].triangle));
        for (size_t i = first; i < end; i++)
            vec_store(vec_unit(sum), bvh->edge_normals[sides[i].triangle][sides[i].corner]);
    }
}

groom_status bvh_pseudo_normals(struct groom_bvh *bvh, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = bvh->allocator;
    uint32_t n_vertices = bvh->mesh->n_vertices;
    size_t n_sides = (size_t)bvh->mesh->n_triangles * 3;
    struct place *places = memory_array(allocator, n_vertices, sizeof *places);
    uint32_t *welded = memory_array(allocator, n_vertices, sizeof *welded);
    struct vec *sums = memory_array(allocator, n_vertices, sizeof *sums);
    struct side *sides = memory_array(allocator, n_sides, sizeof *sides);
    groom_status st = GROOM_OK;
    if (places && welded && sums && sides) {
        weld(bvh->mesh, places, welded);
        vertex_normals(bvh, welded, sums);
        edge_normals(bvh, welded, sides);
    } else {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the normals of the mesh");
    }
    memory_release(allocator, places, n_vertices, sizeof *places);
    memory_release(allocator, welded, n_vertices, sizeof *welded);
    memory_release(allocator, sums, n_vertices, sizeof *sums);
    memory_release(allocator, sides, n_sides, sizeof *sides);
    return st;
}
