#include "retarget/field.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"

struct fill {
    struct field *field;
};

/* One row of nodes along x. Distances are signed by the winding number: right for open surfaces too. */
static void fill_row(void *user, uint32_t row, uint32_t thread)
{
    struct field *field = ((struct fill *)user)->field;
    uint32_t y = row % field->size[1], z = row / field->size[1];
    float *value = field->value + (size_t)row * field->size[0];
    (void)thread;
    for (uint32_t x = 0; x < field->size[0]; x++) {
        const float p[3] = {field->origin[0] + field->spacing * (float)x, field->origin[1] + field->spacing * (float)y,
                            field->origin[2] + field->spacing * (float)z};
        value[x] = groom_bvh_signed_distance(field->bvh, p);
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
    if (!field->value)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a grid of distances");
    struct fill fill = {field};
    parallel_for(context, field->size[1] * field->size[2], fill_row, &fill);
    return GROOM_OK;
}

void field_finish(struct field *field)
{
    if (field->value)
        memory_release(field->allocator, field->value, (size_t)field->size[0] * field->size[1] * field->size[2], sizeof(float));
    field->value = NULL;
}
