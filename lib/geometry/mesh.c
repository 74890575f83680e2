/* The mesh container: creation, checks, names. */
#include "groom/mesh.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"

static const char *const format_names[] = {
    "auto",
#define FORMAT_NAME(name, slug, media, extension, text) slug,
    GROOM_MESH_FORMAT_LIST(FORMAT_NAME)
#undef FORMAT_NAME
};

const char *groom_mesh_format_name(groom_mesh_format format)
{
    return (unsigned)format < GROOM_MESH_FORMAT_COUNT ? format_names[format] : "auto";
}

groom_status groom_mesh_format_parse(const char *name, groom_mesh_format *format, struct groom_diag *diag)
{
    for (int i = 0; i < GROOM_MESH_FORMAT_COUNT; i++) {
        if (strcmp(name, format_names[i]) == 0) {
            *format = (groom_mesh_format)i;
            return GROOM_OK;
        }
    }
    return groom_fail(diag, GROOM_EINVAL, "\"%.40s\" is no mesh format; it may be auto, obj or ply", name);
}

groom_status groom_mesh_create(uint32_t n_vertices, uint32_t n_triangles, uint32_t n_uvs,
                               const struct groom_context *context, struct groom_mesh **out,
                               struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_mesh *mesh = memory_array_zero(allocator, 1, sizeof *mesh);
    if (!mesh)
        goto no_memory;
    mesh->allocator = allocator;
    mesh->n_vertices = n_vertices;
    mesh->n_triangles = n_triangles;
    mesh->n_uvs = n_uvs;
    mesh->points = memory_array(allocator, n_vertices, sizeof *mesh->points);
    mesh->triangles = memory_array(allocator, n_triangles, sizeof *mesh->triangles);
    if (n_uvs) {
        mesh->uvs = memory_array(allocator, n_uvs, sizeof *mesh->uvs);
        mesh->uv_triangles = memory_array(allocator, n_triangles, sizeof *mesh->uv_triangles);
    }
    if (!mesh->points || !mesh->triangles || (n_uvs && (!mesh->uvs || !mesh->uv_triangles)))
        goto no_memory;
    *out = mesh;
    return GROOM_OK;
no_memory:
    groom_mesh_destroy(mesh);
    return groom_fail(diag, GROOM_ENOMEM, "no memory for a mesh of %u vertices and %u triangles", n_vertices, n_triangles);
}

void groom_mesh_destroy(struct groom_mesh *mesh)
{
    if (!mesh)
        return;
    const struct groom_allocator *allocator = mesh->allocator;
    memory_release(allocator, mesh->points, mesh->n_vertices, sizeof *mesh->points);
    memory_release(allocator, mesh->triangles, mesh->n_triangles, sizeof *mesh->triangles);
    memory_release(allocator, mesh->uvs, mesh->n_uvs, sizeof *mesh->uvs);
    memory_release(allocator, mesh->uv_triangles, mesh->n_triangles, sizeof *mesh->uv_triangles);
    memory_release(allocator, mesh, 1, sizeof *mesh);
}

static int all_finite(const float *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(values[i]))
            return 0;
    return 1;
}

static int all_below(const uint32_t (*triangles)[3], size_t n, uint32_t limit)
{
    for (size_t i = 0; i < n; i++)
        if (triangles[i][0] >= limit || triangles[i][1] >= limit || triangles[i][2] >= limit)
            return 0;
    return 1;
}

groom_status groom_mesh_validate(const struct groom_mesh *mesh, struct groom_diag *diag)
{
    if (!all_finite((const float *)mesh->points, (size_t)mesh->n_vertices * 3))
        return groom_fail(diag, GROOM_EINVAL, "the mesh has a vertex that is not finite");
    if (!all_below((const uint32_t(*)[3])mesh->triangles, mesh->n_triangles, mesh->n_vertices))
        return groom_fail(diag, GROOM_EINVAL, "a triangle of the mesh names a vertex that is not there (it has %u)", mesh->n_vertices);
    if (mesh->n_uvs && !all_finite((const float *)mesh->uvs, (size_t)mesh->n_uvs * 2))
        return groom_fail(diag, GROOM_EINVAL, "the mesh has a texture coordinate that is not finite");
    if (mesh->n_uvs && !all_below((const uint32_t(*)[3])mesh->uv_triangles, mesh->n_triangles, mesh->n_uvs))
        return groom_fail(diag, GROOM_EINVAL, "a triangle of the mesh names a texture coordinate that is not there (it has %u)", mesh->n_uvs);
    return GROOM_OK;
}

void groom_mesh_bounds(const struct groom_mesh *mesh, float bbox_min[3], float bbox_max[3])
{
    for (int axis = 0; axis < 3; axis++) {
        float low = INFINITY, high = -INFINITY;
        for (uint32_t i = 0; i < mesh->n_vertices; i++) {
            low = fminf(low, mesh->points[i][axis]);
            high = fmaxf(high, mesh->points[i][axis]);
        }
        bbox_min[axis] = low;
        bbox_max[axis] = high;
    }
}
