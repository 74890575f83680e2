/* How far light gets into the hair: a grid of hair density, and through it the optical depth
 * towards the key light and the openness to all sides. Densities are whole numbers, so that the
 * order in which threads add them does not matter. */
#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "groom/render.h"

#define PIECE 4096u         /* strands */
#define UNIT 1024.0f        /* length is counted in this fraction of a cell's edge */
#define EXTINCTION 1.1f     /* optical depth of hair that covers its cross-section once */
#define AROUND 0.6f         /* share of the optical depth that counts for light from all sides */
#define SKIP 1.5f           /* cells that a strand does not shadow itself with */
#define FEWEST 8u           /* cells along the longest side of the hair's box */
#define MOST 256u

struct lighting {
    const struct groom_strands *strands;
    const struct groom_light_options *options;
    struct groom_light *light;
    uint64_t *length; /* [cells] hair in the cell, in 1/1024 of its edge */
    float unit;       /* the optical depth of one cell per unit of counted length */
};

static size_t cells_of(const struct groom_light *grid)
{
    return (size_t)grid->size[0] * grid->size[1] * grid->size[2];
}

static int is_finite(const float p[3])
{
    return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

/* returns 0 where no point is finite */
static int measure(const struct groom_strands *strands, float low[3], float high[3])
{
    for (int k = 0; k < 3; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
    }
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        for (int k = 0; k < 3 && is_finite(strands->points[i]); k++) {
            low[k] = fminf(low[k], strands->points[i][k]);
            high[k] = fmaxf(high[k], strands->points[i][k]);
        }
    return low[0] <= high[0];
}

static void lay_out(struct groom_light *grid, const float low[3], const float high[3], uint32_t longest_cells)
{
    float longest = 1e-6f;
    for (int k = 0; k < 3; k++)
        longest = fmaxf(longest, high[k] - low[k]);
    grid->cell = longest / (float)(longest_cells - 4);
    for (int k = 0; k < 3; k++) {
        grid->size[k] = (uint32_t)((high[k] - low[k]) / grid->cell) + 4;
        grid->origin[k] = low[k] - 1.5f * grid->cell;
    }
}

static int cell_of(const struct groom_light *grid, const float p[3], size_t *cell)
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

static void add_strand(struct lighting *job, const float (*p)[3], uint32_t n)
{
    for (uint32_t i = 0; i + 1 < n; i++) {
        float middle[3], squares = 0;
        size_t cell;
        for (int k = 0; k < 3; k++) {
            middle[k] = 0.5f * (p[i][k] + p[i + 1][k]);
            squares += (p[i + 1][k] - p[i][k]) * (p[i + 1][k] - p[i][k]);
        }
        if (is_finite(middle) && cell_of(job->light, middle, &cell))
            __atomic_fetch_add(&job->length[cell], (uint64_t)(sqrtf(squares) / job->light->cell * UNIT), __ATOMIC_RELAXED);
    }
}

static void density_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct lighting *job = user;
    const struct groom_strands *s = job->strands;
    (void)thread;
    for (uint32_t i = piece * PIECE; i < s->n_strands && i < (piece + 1) * PIECE; i++)
        if (i % job->options->stride == 0)
            add_strand(job, (const float(*)[3])s->points + s->first[i], s->first[i + 1] - s->first[i]);
}

/* --- light ----------------------------------------------------------------------- */

/* From a cell towards the key light, a cell's edge at a time, until the grid ends or it is dark. */
static float depth_towards_key(const struct lighting *job, const uint32_t cell[3])
{
    const struct groom_light *grid = job->light;
    const float *key = job->options->key;
    float depth = 0, at[3];
    for (int k = 0; k < 3; k++)
        at[k] = (float)cell[k] + 0.5f + key[k] * SKIP;
    while (depth < 8) {
        if (!(at[0] >= 0 && at[1] >= 0 && at[2] >= 0 && at[0] < (float)grid->size[0] && at[1] < (float)grid->size[1] && at[2] < (float)grid->size[2]))
            break;
        depth += (float)job->length[((size_t)at[2] * grid->size[1] + (size_t)at[1]) * grid->size[0] + (size_t)at[0]] * job->unit;
        for (int k = 0; k < 3; k++)
            at[k] += key[k];
    }
    return depth;
}

static void key_piece(void *user, uint32_t z, uint32_t thread)
{
    const struct lighting *job = user;
    struct groom_light *grid = job->light;
    (void)thread;
    for (uint32_t y = 0; y < grid->size[1]; y++)
        for (uint32_t x = 0; x < grid->size[0]; x++)
            grid->key[((size_t)z * grid->size[1] + y) * grid->size[0] + x] = depth_towards_key(job, (uint32_t[3]){x, y, z});
}

/* What a line of cells lets through from its two ends, added to `ambient`. */
static void open_line(struct lighting *job, size_t first, size_t step, uint32_t n)
{
    uint64_t before = 0, total = 0;
    for (uint32_t i = 0; i < n; i++)
        total += job->length[first + i * step];
    for (uint32_t i = 0; i < n; i++) {
        size_t cell = first + i * step;
        uint64_t own = job->length[cell];
        job->light->ambient[cell] += (expf(-AROUND * job->unit * (float)before) + expf(-AROUND * job->unit * (float)(total - before - own))) / 6;
        before += own;
    }
}

/* How open cells are to the six sides, by sums along the lines of the grid. */
static void add_ambient(struct lighting *job)
{
    const struct groom_light *grid = job->light;
    const size_t step[3] = {1, grid->size[0], (size_t)grid->size[0] * grid->size[1]};
    for (int axis = 0; axis < 3; axis++) {
        int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (uint32_t i = 0; i < grid->size[u]; i++)
            for (uint32_t j = 0; j < grid->size[v]; j++)
                open_line(job, i * step[u] + j * step[v], step[axis], grid->size[axis]);
    }
}

static void fill(struct lighting *job, const struct groom_context *context)
{
    job->unit = EXTINCTION * job->options->width_m / (job->light->cell * UNIT);
    parallel_for(context, job->strands->n_strands / PIECE + 1, density_piece, job);
    parallel_for(context, job->light->size[2], key_piece, job);
    add_ambient(job);
}

static groom_status light_allocate(const struct groom_allocator *allocator, const float low[3], const float high[3],
                                   uint32_t cells, struct groom_light **out)
{
    struct groom_light *light = memory_array_zero(allocator, 1, sizeof *light);
    if (!light)
        return GROOM_ENOMEM;
    light->allocator = allocator;
    lay_out(light, low, high, cells);
    light->key = memory_array(allocator, cells_of(light), sizeof *light->key);
    light->ambient = memory_array_zero(allocator, cells_of(light), sizeof *light->ambient);
    *out = light;
    return light->key && light->ambient ? GROOM_OK : GROOM_ENOMEM;
}

void groom_light_destroy(struct groom_light *light)
{
    if (!light)
        return;
    memory_release(light->allocator, light->key, cells_of(light), sizeof *light->key);
    memory_release(light->allocator, light->ambient, cells_of(light), sizeof *light->ambient);
    memory_release(light->allocator, light, 1, sizeof *light);
}

groom_status groom_light_create(const struct groom_strands *strands, const struct groom_light_options *options,
                                const struct groom_context *context, struct groom_light **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_light *light = NULL;
    struct lighting job = {.strands = strands, .options = options};
    float low[3], high[3];
    if (options->cells < FEWEST || options->cells > MOST || options->stride == 0 || !(options->width_m >= 0))
        return groom_fail(diag, GROOM_EINVAL, "a grid of light has %u..%u cells a side, and hair a width and a stride", FEWEST, MOST);
    if (!measure(strands, low, high))
        return groom_fail(diag, GROOM_EEMPTY, "no point of the strands is finite: there is nothing to light");
    if (light_allocate(allocator, low, high, options->cells, &light) != GROOM_OK ||
        !(job.length = memory_array_zero(allocator, cells_of(light), sizeof *job.length))) {
        groom_light_destroy(light);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the light in the picture");
    }
    job.light = light;
    fill(&job, context);
    memory_release(allocator, job.length, cells_of(light), sizeof *job.length);
    *out = light;
    return GROOM_OK;
}

/* Trilinear between the middles of cells; outside of the grid the nearest cell answers. */
void groom_light_at(const struct groom_light *grid, const float p[3], float *key, float *ambient)
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
