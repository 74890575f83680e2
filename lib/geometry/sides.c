#include "geometry/sides.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

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

static int compare_sides(const void *a, const void *b)
{
    const struct mesh_side *p = a, *q = b;
    const uint32_t k[4] = {p->low, p->high, p->triangle, p->corner}, l[4] = {q->low, q->high, q->triangle, q->corner};
    for (int i = 0; i < 4; i++)
        if (k[i] != l[i])
            return k[i] < l[i] ? -1 : 1;
    return 0;
}

static void collect(const struct groom_mesh *mesh, struct mesh_sides *sides)
{
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t a = sides->welded[mesh->triangles[t][(i + 1) % 3]], b = sides->welded[mesh->triangles[t][(i + 2) % 3]];
            sides->sides[(size_t)t * 3 + i] = (struct mesh_side){a < b ? a : b, a < b ? b : a, t, i};
        }
    qsort(sides->sides, sides->n, sizeof *sides->sides, compare_sides);
}

groom_status mesh_sides_init(struct mesh_sides *sides, const struct groom_mesh *mesh,
                             const struct groom_allocator *allocator, struct groom_diag *diag)
{
    *sides = (struct mesh_sides){.n_vertices = mesh->n_vertices, .n = (size_t)mesh->n_triangles * 3, .allocator = allocator};
    sides->welded = memory_array(allocator, mesh->n_vertices, sizeof *sides->welded);
    sides->sides = memory_array(allocator, sides->n, sizeof *sides->sides);
    struct place *places = memory_array(allocator, mesh->n_vertices, sizeof *places);
    groom_status st = GROOM_OK;
    if (sides->welded && sides->sides && places) {
        weld(mesh, places, sides->welded);
        collect(mesh, sides);
    } else {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the edges of the mesh");
    }
    memory_release(allocator, places, mesh->n_vertices, sizeof *places);
    return st;
}

void mesh_sides_finish(struct mesh_sides *sides)
{
    if (!sides->allocator)
        return;
    memory_release(sides->allocator, sides->welded, sides->n_vertices, sizeof *sides->welded);
    memory_release(sides->allocator, sides->sides, sides->n, sizeof *sides->sides);
    *sides = (struct mesh_sides){0};
}

size_t mesh_edge_end(const struct mesh_sides *sides, size_t first)
{
    size_t end = first;
    while (end < sides->n && sides->sides[end].low == sides->sides[first].low && sides->sides[end].high == sides->sides[first].high)
        end++;
    return end;
}
