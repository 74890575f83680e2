#include "retarget/field.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/bvh.h"
#include "geometry/sides.h"
#include "retarget/batches.h"

#define BATCH 512         /* rows of the grid between two looks at progress */
#define OFF_SURFACE 1e-4f /* metres from a triangle at which its sides are told */

/* --- sides ---------------------------------------------------------------------------------- */

/* Triangles at the rim of a hole have no sides to speak of; nor where more than two meet. */
static groom_status mark_rims(struct field *field, struct groom_diag *diag)
{
    const struct groom_mesh *mesh = groom_bvh_mesh(field->bvh);
    struct mesh_sides sides = {0};
    uint8_t *rim = memory_array_zero(field->allocator, mesh->n_vertices, 1);
    groom_status st = mesh_sides_init(&sides, mesh, field->allocator, diag);
    field->closed = 1;
    if (st == GROOM_OK && !rim)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the sides of the body");
    for (size_t first = 0, end; st == GROOM_OK && first < sides.n; first = end) {
        end = mesh_edge_end(&sides, first);
        if (end - first == 2)
            continue;
        field->closed = 0;
        rim[sides.sides[first].low] = rim[sides.sides[first].high] = 1;
    }
    for (uint32_t t = 0; st == GROOM_OK && t < mesh->n_triangles; t++)
        for (int c = 0; c < 3; c++)
            if (rim[sides.welded[mesh->triangles[t][c]]])
                field->side[t] = FIELD_SIDE_IS_NONE;
    memory_release(field->allocator, rim, mesh->n_vertices, 1);
    mesh_sides_finish(&sides);
    return st;
}

static enum field_side look_at(const struct groom_bvh *bvh, uint32_t triangle)
{
    const struct groom_mesh *mesh = groom_bvh_mesh(bvh);
    const uint32_t *i = mesh->triangles[triangle];
    const float *normal = bvh->face_normals[triangle];
    float front[3], behind[3];
    for (int c = 0; c < 3; c++) {
        float middle = (mesh->points[i[0]][c] + mesh->points[i[1]][c] + mesh->points[i[2]][c]) / 3;
        front[c] = middle + OFF_SURFACE * normal[c];
        behind[c] = middle - OFF_SURFACE * normal[c];
    }
    return !groom_bvh_inside(bvh, front) && groom_bvh_inside(bvh, behind) ? FIELD_SIDE_TELLS : FIELD_SIDE_IS_NONE;
}

/* What two threads may find at once is the same. */
static enum field_side side_of(const struct field *field, uint32_t triangle)
{
    enum field_side side = (enum field_side)__atomic_load_n(&field->side[triangle], __ATOMIC_RELAXED);
    if (side == FIELD_NOT_LOOKED_AT) {
        side = look_at(field->bvh, triangle);
        __atomic_store_n(&field->side[triangle], (uint8_t)side, __ATOMIC_RELAXED);
    }
    return side;
}

static double signed_of(const struct field *field, const float p[3], const struct groom_surface_point *near)
{
    double in_front = 0;
    int inside;
    for (int c = 0; c < 3; c++)
        in_front += ((double)p[c] - near->position[c]) * near->normal[c];
    if (side_of(field, near->triangle) == FIELD_SIDE_TELLS && fabs(in_front) > 0.2 * near->distance)
        inside = in_front < 0;
    else
        inside = groom_bvh_inside(field->bvh, p);
    return inside ? -(double)near->distance : near->distance;
}

double field_signed(const struct field *field, const float p[3], struct groom_surface_point *near)
{
    return groom_bvh_closest(field->bvh, p, INFINITY, near) ? signed_of(field, p, near) : INFINITY;
}

/* --- the grid ------------------------------------------------------------------------------- */

#define BAND 3 /* spacings: distances beyond are not looked for */

/* Distance of a node, up to the band, negative inside. `before`: of the node before it in the row, NAN at its start. */
static float node_value(const struct field *field, const float p[3], float before)
{
    struct groom_surface_point near;
    float band = BAND * field->spacing;
    if (groom_bvh_closest(field->bvh, p, band, &near))
        return (float)signed_of(field, p, &near);
    int inside = field->closed && !isnan(before) ? before < 0 : groom_bvh_inside(field->bvh, p);
    return inside ? -band : band;
}

/* One row of nodes along x. */
static void fill_row(void *user, uint32_t row, uint32_t thread)
{
    struct field *field = user;
    uint32_t y = row % field->size[1], z = row / field->size[1];
    float *value = field->value + (size_t)row * field->size[0];
    (void)thread;
    for (uint32_t x = 0; x < field->size[0]; x++) {
        const float p[3] = {field->origin[0] + field->spacing * (float)x, field->origin[1] + field->spacing * (float)y,
                            field->origin[2] + field->spacing * (float)z};
        value[x] = node_value(field, p, x ? value[x - 1] : NAN);
    }
}

groom_status field_init(struct field *field, const struct groom_bvh *bvh, const float low[3], const float high[3],
                        float margin, uint32_t n_nodes, const struct groom_context *context, struct groom_diag *diag)
{
    double volume = 1;
    memset(field, 0, sizeof *field);
    field->bvh = bvh;
    field->allocator = memory_allocator(context);
    groom_mesh_bounds(groom_bvh_mesh(bvh), field->low, field->high);
    float box[2][3];
    for (int c = 0; c < 3; c++) {
        box[0][c] = fmaxf(field->low[c], low[c]) - margin;
        box[1][c] = fmaxf(fminf(field->high[c], high[c]) + margin, box[0][c] + 2 * margin);
        volume *= box[1][c] - box[0][c];
    }
    field->spacing = (float)cbrt(volume / n_nodes);
    for (int c = 0; c < 3; c++) {
        field->origin[c] = box[0][c];
        field->size[c] = (uint32_t)((box[1][c] - box[0][c]) / field->spacing) + 2;
    }
    field->value = memory_array(field->allocator, (size_t)field->size[0] * field->size[1] * field->size[2], sizeof(float));
    field->side = memory_array_zero(field->allocator, groom_bvh_mesh(bvh)->n_triangles, 1);
    if (!field->value || !field->side)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a grid of distances");
    groom_status st = mark_rims(field, diag);
    if (st != GROOM_OK)
        return st;
    struct batches batches = {.n_pieces = field->size[1] * field->size[2], .batch = BATCH, .doing = "distances from the body were measured"};
    return batches_run(context, &batches, fill_row, field, diag);
}

void field_finish(struct field *field)
{
    if (field->side)
        memory_release(field->allocator, field->side, groom_bvh_mesh(field->bvh)->n_triangles, 1);
    if (field->value)
        memory_release(field->allocator, field->value, (size_t)field->size[0] * field->size[1] * field->size[2], sizeof(float));
    field->value = NULL;
    field->side = NULL;
}
