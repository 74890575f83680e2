/* How far light gets into the hair: a grid of hair density, and through it the optical depth
 * towards the key light and the openness to all sides. Densities are whole numbers, so that the
 * order in which threads add them does not matter. */
#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "render/scene.h"

#define LONGEST 96          /* cells along the longest side of the hair's box */
#define UNIT 1024.0f        /* length is counted in this fraction of a cell's edge */
#define EXTINCTION 1.1f     /* optical depth of hair that covers its cross-section once */
#define AROUND 0.6f         /* share of the optical depth that counts for light from all sides */
#define SKIP 1.5f           /* cells that a strand does not shadow itself with */

static size_t cells_of(const struct render_light_grid *grid)
{
    return (size_t)grid->size[0] * grid->size[1] * grid->size[2];
}

static void lay_out(const struct render_scene *scene, struct render_light_grid *grid)
{
    float longest = 1e-6f;
    for (int k = 0; k < 3; k++)
        longest = fmaxf(longest, scene->hair_max[k] - scene->hair_min[k]);
    grid->cell = longest / (LONGEST - 4);
    for (int k = 0; k < 3; k++) {
        grid->size[k] = (uint32_t)((scene->hair_max[k] - scene->hair_min[k]) / grid->cell) + 4;
        grid->origin[k] = scene->hair_min[k] - 1.5f * grid->cell;
    }
}

static int cell_of(const struct render_light_grid *grid, const float p[3], size_t *cell)
{
    uint32_t at[3];
    for (int k = 0; k < 3; k++) {
        float x = (p[k] - grid->origin[k]) / grid->cell;
        if (!(x >= 0 && x < (float)grid->size[k]))
            return 0;
        at[k] = (uint32_t)x;
    }
    *cell = ((size_t)at[2] * grid->size[1] + at[1]) * grid->size[0] + at[0];
    return 1;
}

/* --- density --------------------------------------------------------------------- */

static void add_strand(struct render_light_grid *grid, const float (*p)[3], uint32_t n)
{
    for (uint32_t i = 0; i + 1 < n; i++) {
        float middle[3], squares = 0;
        size_t cell;
        for (int k = 0; k < 3; k++) {
            middle[k] = 0.5f * (p[i][k] + p[i + 1][k]);
            squares += (p[i + 1][k] - p[i][k]) * (p[i + 1][k] - p[i][k]);
        }
        if (render_is_finite(middle) && cell_of(grid, middle, &cell))
            __atomic_fetch_add(&grid->length[cell], (uint64_t)(sqrtf(squares) / grid->cell * UNIT), __ATOMIC_RELAXED);
    }
}

static void density_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct render_scene *scene = user;
    const struct groom_strands *s = scene->strands;
    (void)thread;
    for (uint32_t i = piece * RENDER_PIECE; i < s->n_strands && i < (piece + 1) * RENDER_PIECE; i++)
        if (i % scene->stride == 0)
            add_strand(&scene->grid, (const float(*)[3])s->points + s->first[i], s->first[i + 1] - s->first[i]);
}

/* --- light ----------------------------------------------------------------------- */

/* The optical depth of one cell per unit of counted length. */
static float depth_unit(const struct render_scene *scene)
{
    return EXTINCTION * scene->width / (scene->grid.cell * UNIT);
}

/* From a cell towards the key light, a cell's edge at a time, until the grid ends or it is dark. */
static float depth_towards_key(const struct render_scene *scene, const uint32_t cell[3], float unit)
{
    const struct render_light_grid *grid = &scene->grid;
    float depth = 0, at[3];
    for (int k = 0; k < 3; k++)
        at[k] = (float)cell[k] + 0.5f + scene->key[k] * SKIP;
    while (depth < 8) {
        if (!(at[0] >= 0 && at[1] >= 0 && at[2] >= 0 && at[0] < (float)grid->size[0] && at[1] < (float)grid->size[1] && at[2] < (float)grid->size[2]))
            break;
        depth += (float)grid->length[((size_t)at[2] * grid->size[1] + (size_t)at[1]) * grid->size[0] + (size_t)at[0]] * unit;
        for (int k = 0; k < 3; k++)
            at[k] += scene->key[k];
    }
    return depth;
}

static void key_piece(void *user, uint32_t z, uint32_t thread)
{
    struct render_scene *scene = user;
    struct render_light_grid *grid = &scene->grid;
    float unit = depth_unit(scene);
    (void)thread;
    for (uint32_t y = 0; y < grid->size[1]; y++)
        for (uint32_t x = 0; x < grid->size[0]; x++)
            grid->key[((size_t)z * grid->size[1] + y) * grid->size[0] + x] = depth_towards_key(scene, (uint32_t[3]){x, y, z}, unit);
}

/* What a line of cells lets through from its two ends, added to `ambient`. */
static void open_line(struct render_light_grid *grid, size_t first, size_t step, uint32_t n, float unit)
{
    uint64_t before = 0, total = 0;
    for (uint32_t i = 0; i < n; i++)
        total += grid->length[first + i * step];
    for (uint32_t i = 0; i < n; i++) {
        size_t cell = first + i * step;
        uint64_t own = grid->length[cell];
        grid->ambient[cell] += (expf(-AROUND * unit * (float)before) + expf(-AROUND * unit * (float)(total - before - own))) / 6;
        before += own;
    }
}

/* How open cells are to the six sides, by sums along the lines of the grid. */
static void add_ambient(struct render_scene *scene)
{
    struct render_light_grid *grid = &scene->grid;
    const size_t step[3] = {1, grid->size[0], (size_t)grid->size[0] * grid->size[1]};
    float unit = depth_unit(scene);
    for (int axis = 0; axis < 3; axis++) {
        int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (uint32_t i = 0; i < grid->size[u]; i++)
            for (uint32_t j = 0; j < grid->size[v]; j++)
                open_line(grid, i * step[u] + j * step[v], step[axis], grid->size[axis], unit);
    }
}

groom_status render_light_create(struct render_scene *scene, struct groom_diag *diag)
{
    struct render_light_grid *grid = &scene->grid;
    lay_out(scene, grid);
    grid->length = memory_array_zero(scene->allocator, cells_of(grid), sizeof *grid->length);
    grid->key = memory_array(scene->allocator, cells_of(grid), sizeof *grid->key);
    grid->ambient = memory_array_zero(scene->allocator, cells_of(grid), sizeof *grid->ambient);
    if (!grid->length || !grid->key || !grid->ambient)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the light in the picture");
    parallel_for(scene->context, scene->strands->n_strands / RENDER_PIECE + 1, density_piece, scene);
    parallel_for(scene->context, grid->size[2], key_piece, scene);
    add_ambient(scene);
    return GROOM_OK;
}

void render_light_destroy(struct render_scene *scene)
{
    struct render_light_grid *grid = &scene->grid;
    memory_release(scene->allocator, grid->length, cells_of(grid), sizeof *grid->length);
    memory_release(scene->allocator, grid->key, cells_of(grid), sizeof *grid->key);
    memory_release(scene->allocator, grid->ambient, cells_of(grid), sizeof *grid->ambient);
}

/* Trilinear between the middles of cells; outside of the grid the nearest cell answers. */
void render_light_at(const struct render_light_grid *grid, const float p[3], float *key, float *ambient)
{
    size_t base = 0, step[3] = {1, grid->size[0], (size_t)grid->size[0] * grid->size[1]};
    float f[3], depth = 0, open = 0;
    for (int k = 0; k < 3; k++) {
        float x = (p[k] - grid->origin[k]) / grid->cell - 0.5f;
        float most = (float)grid->size[k] - 1.001f;
        x = x > 0 ? x < most ? x : most : 0;
        f[k] = x - (float)(size_t)x;
        base += (size_t)x * step[k];
    }
    for (int c = 0; c < 8; c++) {
        float w = (c & 1 ? f[0] : 1 - f[0]) * (c & 2 ? f[1] : 1 - f[1]) * (c & 4 ? f[2] : 1 - f[2]);
        size_t cell = base + (c & 1 ? step[0] : 0) + (c & 2 ? step[1] : 0) + (c & 4 ? step[2] : 0);
        depth += w * grid->key[cell];
        open += w * grid->ambient[cell];
    }
    *key = expf(-depth);
    *ambient = open;
}
