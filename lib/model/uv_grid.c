#include "model/uv_grid.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

#define POINTS_A_CELL 2.0
#define MAXIMUM_SIDE 1024

static uint32_t cell_along(const struct uv_grid *grid, double value, int axis)
{
    double cell = floor((value - grid->origin[axis]) / grid->cell[axis]);
    return cell <= 0.0 ? 0 : cell >= grid->side - 1.0 ? grid->side - 1 : (uint32_t)cell;
}

static uint32_t cell_of(const struct uv_grid *grid, const float point[2])
{
    return cell_along(grid, point[1], 1) * grid->side + cell_along(grid, point[0], 0);
}

static void measure(struct uv_grid *grid)
{
    grid->side = (uint32_t)fmin(ceil(sqrt(grid->n_points / POINTS_A_CELL)), MAXIMUM_SIDE);
    for (int axis = 0; axis < 2; axis++) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t i = 0; i < grid->n_points; i++) {
            low = fmin(low, grid->points[i][axis]);
            high = fmax(high, grid->points[i][axis]);
        }
        grid->origin[axis] = low;
        grid->cell[axis] = high > low ? (high - low) / grid->side : 1.0;
    }
}

/* Counting sort by cell. */
static void fill(struct uv_grid *grid)
{
    uint32_t n_cells = grid->side * grid->side;
    memset(grid->first, 0, ((size_t)n_cells + 1) * sizeof *grid->first);
    for (uint32_t i = 0; i < grid->n_points; i++)
        grid->first[cell_of(grid, grid->points[i])]++;
    uint32_t sum = 0;
    for (uint32_t c = 0; c <= n_cells; c++)
        grid->first[c] = sum += grid->first[c];
    for (uint32_t i = grid->n_points; i-- > 0;)
        grid->index[--grid->first[cell_of(grid, grid->points[i])]] = i;
}

groom_status uv_grid_init(struct uv_grid *grid, const float (*points)[2], uint32_t n,
                          const struct groom_allocator *allocator)
{
    *grid = (struct uv_grid){.points = points, .n_points = n, .allocator = allocator};
    measure(grid);
    grid->first = memory_array(allocator, (size_t)grid->side * grid->side + 1, sizeof *grid->first);
    grid->index = memory_array(allocator, n, sizeof *grid->index);
    if (!grid->first || !grid->index) {
        uv_grid_finish(grid);
        return GROOM_ENOMEM;
    }
    fill(grid);
    return GROOM_OK;
}

void uv_grid_finish(struct uv_grid *grid)
{
    memory_release(grid->allocator, grid->first, (size_t)grid->side * grid->side + 1, sizeof *grid->first);
    memory_release(grid->allocator, grid->index, grid->n_points, sizeof *grid->index);
    *grid = (struct uv_grid){0};
}

/* The k best so far, sorted by distance, then index. */
struct best {
    uint32_t k, n;
    uint32_t *index;
    double *squared;
};

static void best_offer(struct best *best, uint32_t index, double squared)
{
    uint32_t at = best->n;
    while (at > 0 && (squared < best->squared[at - 1] ||
                      (squared == best->squared[at - 1] && index < best->index[at - 1])))
        at--;
    if (at >= best->k)
        return;
    if (best->n < best->k)
        best->n++;
    for (uint32_t i = best->n - 1; i > at; i--) {
        best->index[i] = best->index[i - 1];
        best->squared[i] = best->squared[i - 1];
    }
    best->index[at] = index;
    best->squared[at] = squared;
}

static void visit_cell(const struct uv_grid *grid, uint32_t cell, const float query[2], uint32_t except,
                       struct best *best)
{
    for (uint32_t i = grid->first[cell]; i < grid->first[cell + 1]; i++) {
        uint32_t p = grid->index[i];
        double dx = (double)grid->points[p][0] - query[0], dy = (double)grid->points[p][1] - query[1];
        if (p != except)
            best_offer(best, p, dx * dx + dy * dy);
    }
}

/* The cells at Chebyshev distance `ring` from (cx, cy) that are on the grid. */
static void visit_ring(const struct uv_grid *grid, int64_t cx, int64_t cy, int64_t ring, const float query[2],
                       uint32_t except, struct best *best)
{
    int64_t side = grid->side;
    for (int64_t y = cy - ring < 0 ? 0 : cy - ring; y <= cy + ring && y < side; y++) {
        int64_t step = y == cy - ring || y == cy + ring || ring == 0 ? 1 : 2 * ring;
        for (int64_t x = cx - ring; x <= cx + ring && x < side; x += step)
            if (x >= 0)
                visit_cell(grid, (uint32_t)(y * side + x), query, except, best);
    }
}

uint32_t uv_grid_nearest(const struct uv_grid *grid, const float query[2], uint32_t k, uint32_t except,
                         uint32_t *index, double *squared)
{
    struct best best = {.k = k, .index = index, .squared = squared};
    int64_t cx = cell_along(grid, query[0], 0), cy = cell_along(grid, query[1], 1);
    double cell = fmin(grid->cell[0], grid->cell[1]) * (1.0 - 1e-9);
    for (int64_t ring = 0; ring < grid->side; ring++) {
        visit_ring(grid, cx, cy, ring, query, except, &best);
        /* whatever was not visited lies more than ring cells away */
        if (best.n == k && best.squared[k - 1] < (double)ring * cell * (double)ring * cell)
            break;
    }
    return best.n;
}
