#include "quality/segment_grid.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

#define SIDE 8u               /* cells along a block */
#define CELLS (SIDE * SIDE * SIDE)
#define MOST_BLOCKS 128u      /* along the box */
#define CELL_SIZE 0.5         /* of a segment's mean length, or more: */
#define CELL_METRES 0.0015    /* half of the tolerance that is asked about */
#define LEAST_CELLS 128       /* along the longest side of the box */
#define LONGEST 1.25          /* piece of a segment, of the mean length */
#define MOST_PIECES 65536u    /* of one segment */

/* --- building ---------------------------------------------------------------------------- */

static double segment_length(const float a[3], const float b[3])
{
    double x = (double)b[0] - a[0], y = (double)b[1] - a[1], z = (double)b[2] - a[2];
    return sqrt(x * x + y * y + z * z);
}

static uint32_t n_pieces_of(double length, double longest)
{
    double pieces = ceil(length / longest);
    return pieces > MOST_PIECES ? MOST_PIECES : (uint32_t)pieces;
}

static struct grid_segment piece_of(const float a[3], const float b[3], double length, uint32_t piece, uint32_t n)
{
    struct grid_segment segment;
    for (int c = 0; c < 3; c++) {
        double d = (double)b[c] - a[c];
        segment.middle[c] = (float)(a[c] + d * (piece + 0.5) / n);
        segment.half[c] = (float)(0.5 * d / n);
    }
    segment.inverse = (float)(2 * n / length);
    return segment;
}

static void place_box(struct segment_grid *grid, const struct quality_set *set, double mean)
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, widest = 0;
    for (size_t i = 0; i < (size_t)set->n * set->m; i++)
        for (int c = 0; c < 3; c++) {
            low[c] = fminf(low[c], set->points[i][c]);
            high[c] = fmaxf(high[c], set->points[i][c]);
        }
    for (int c = 0; c < 3; c++)
        widest = fmaxf(widest, high[c] - low[c]);
    double cell = fmin(fmax(CELL_SIZE * mean, CELL_METRES), widest / LEAST_CELLS);
    grid->cell = (float)fmax(cell, 1.001 * widest / (MOST_BLOCKS * SIDE));
    grid->widest = widest;
    for (int c = 0; c < 3; c++) {
        grid->origin[c] = low[c];
        grid->n_across[c] = (uint32_t)((high[c] - low[c]) / (grid->cell * SIDE)) + 1;
    }
}

static uint32_t cell_coordinate(const struct segment_grid *grid, float x, int c)
{
    float at = (x - grid->origin[c]) / grid->cell;
    uint32_t most = grid->n_across[c] * SIDE - 1;
    return !(at > 0) ? 0 : at < (float)most ? (uint32_t)at : most;
}

static size_t block_index(const struct segment_grid *grid, const uint32_t block[3])
{
    return ((size_t)block[2] * grid->n_across[1] + block[1]) * grid->n_across[0] + block[0];
}

static size_t n_places(const struct segment_grid *grid)
{
    return (size_t)grid->n_across[0] * grid->n_across[1] * grid->n_across[2];
}

/* The block of a point, and its cell in there. */
static size_t locate(const struct segment_grid *grid, const float p[3], uint32_t *cell)
{
    uint32_t block[3], within[3];
    for (int c = 0; c < 3; c++) {
        uint32_t at = cell_coordinate(grid, p[c], c);
        block[c] = at / SIDE;
        within[c] = at % SIDE;
    }
    *cell = (within[2] * SIDE + within[1]) * SIDE + within[0];
    return block_index(grid, block);
}

/* Every piece of every segment, once, in order. */
typedef void visit_piece(struct segment_grid *grid, const struct grid_segment *segment);

static inline __attribute__((always_inline)) void each_piece(struct segment_grid *grid, const struct quality_set *set,
                                                             double longest, visit_piece *visit)
{
    for (uint32_t i = 0; i < set->n; i++)
        for (uint32_t j = 0; j + 1 < set->m; j++) {
            const float *a = set->points[(size_t)i * set->m + j], *b = a + 3;
            double length = segment_length(a, b);
            uint32_t n = n_pieces_of(length, longest);
            for (uint32_t piece = 0; piece < n; piece++) {
                struct grid_segment segment = piece_of(a, b, length, piece, n);
                visit(grid, &segment);
            }
        }
}

static void mark_block(struct segment_grid *grid, const struct grid_segment *segment)
{
    uint32_t cell;
    grid->block_of[locate(grid, segment->middle, &cell)] = 0;
    grid->longest_half = fmaxf(grid->longest_half, 1 / segment->inverse);
}

static void count_segment(struct segment_grid *grid, const struct grid_segment *segment)
{
    uint32_t cell;
    size_t block = locate(grid, segment->middle, &cell);
    grid->first[(size_t)grid->block_of[block] * CELLS + cell + 1]++;
}

/* first[cell] runs on to the cell's end. */
static void put_segment(struct segment_grid *grid, const struct grid_segment *segment)
{
    uint32_t cell;
    size_t block = locate(grid, segment->middle, &cell);
    grid->segments[grid->first[(size_t)grid->block_of[block] * CELLS + cell]++] = *segment;
}

static groom_status number_blocks(struct segment_grid *grid, struct groom_diag *diag)
{
    size_t n = n_places(grid);
    uint32_t at = 0;
    for (size_t b = 0; b < n; b++)
        grid->n_blocks += grid->block_of[b] == 0;
    grid->place_of = memory_array(grid->allocator, grid->n_blocks, sizeof *grid->place_of);
    grid->first = memory_array_zero(grid->allocator, (size_t)grid->n_blocks * CELLS + 1, sizeof *grid->first);
    if (!grid->place_of || !grid->first)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to index strands");
    for (size_t b = 0; b < n; b++)
        if (grid->block_of[b] == 0) {
            grid->place_of[at][0] = (uint32_t)(b % grid->n_across[0]);
            grid->place_of[at][1] = (uint32_t)(b / grid->n_across[0] % grid->n_across[1]);
            grid->place_of[at][2] = (uint32_t)(b / grid->n_across[0] / grid->n_across[1]);
            grid->block_of[b] = at++;
        }
    return GROOM_OK;
}

static double mean_length(const struct quality_set *set)
{
    double sum = 0;
    size_t n = 0;
    for (uint32_t i = 0; i < set->n; i++)
        for (uint32_t j = 0; j + 1 < set->m; j++) {
            const float *a = set->points[(size_t)i * set->m + j];
            double length = segment_length(a, a + 3);
            sum += length;
            n += length > 0;
        }
    return n ? sum / (double)n : 1;
}

groom_status segment_grid_init(struct segment_grid *grid, const struct quality_set *set, const struct groom_context *context,
                               struct groom_diag *diag)
{
    double mean = mean_length(set), longest = LONGEST * mean;
    uint64_t sum = 0;
    groom_status st;
    memset(grid, 0, sizeof *grid);
    grid->allocator = memory_allocator(context);
    place_box(grid, set, mean);
    grid->block_of = memory_array(grid->allocator, n_places(grid), sizeof *grid->block_of);
    if (!grid->block_of)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to index %u strands", set->n);
    memset(grid->block_of, 0xff, n_places(grid) * sizeof *grid->block_of);
    each_piece(grid, set, longest, mark_block);
    if ((st = number_blocks(grid, diag)) != GROOM_OK)
        return st;
    each_piece(grid, set, longest, count_segment);
    size_t n_cells = (size_t)grid->n_blocks * CELLS;
    for (size_t c = 0; c < n_cells; c++)
        grid->first[c + 1] = (uint32_t)(sum += grid->first[c + 1]);
    if (sum > UINT32_MAX)
        return groom_fail(diag, GROOM_ETOOBIG, "%u strands are too long to compare", set->n);
    grid->segments = memory_array(grid->allocator, (size_t)sum, sizeof *grid->segments);
    if (!grid->segments)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to index %u strands", set->n);
    each_piece(grid, set, longest, put_segment);
    memmove(grid->first + 1, grid->first, n_cells * sizeof *grid->first); /* ends are begins again */
    grid->first[0] = 0;
    return GROOM_OK;
}

void segment_grid_finish(struct segment_grid *grid)
{
    if (!grid->allocator)
        return;
    size_t n_cells = (size_t)grid->n_blocks * CELLS;
    memory_release(grid->allocator, grid->segments, grid->first ? grid->first[n_cells] : 0, sizeof *grid->segments);
    memory_release(grid->allocator, grid->first, n_cells + 1, sizeof *grid->first);
    memory_release(grid->allocator, grid->place_of, grid->n_blocks, sizeof *grid->place_of);
    memory_release(grid->allocator, grid->block_of, n_places(grid), sizeof *grid->block_of);
    memset(grid, 0, sizeof *grid);
}

/* --- asking ------------------------------------------------------------------------------- */

struct query {
    const struct quality_place *place;
    float reach;      /* squared: cells whose box is farther are passed over */
    /* nearest */
    float pad, squared, cosine;
    /* matches */
    const float *tolerance, *least_cosine;
    uint32_t n;
    int *found;
};

typedef void visit_segment(struct query *query, const struct grid_segment *segment);

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static float squared_distance(const float p[3], const struct grid_segment *segment)
{
    float d[3] = {p[0] - segment->middle[0], p[1] - segment->middle[1], p[2] - segment->middle[2]};
    float t = dot(d, segment->half) * segment->inverse * segment->inverse;
    t = t < -1 ? -1 : t > 1 ? 1 : t;
    for (int c = 0; c < 3; c++)
        d[c] -= t * segment->half[c];
    return dot(d, d);
}

/* Squared distance from x to low .. low + size. */
static float axis_distance(float x, float low, float size)
{
    float d = x < low ? low - x : x > low + size ? x - low - size : 0;
    return d * d;
}

static inline __attribute__((always_inline)) void scan_block(const struct segment_grid *grid, uint32_t block,
                                                             struct query *query, visit_segment *visit)
{
    const float *p = query->place->position;
    float away[3][SIDE];
    for (int c = 0; c < 3; c++)
        for (uint32_t k = 0; k < SIDE; k++)
            away[c][k] = axis_distance(p[c], grid->origin[c] + grid->cell * (float)(grid->place_of[block][c] * SIDE + k),
                                       grid->cell);
    const uint32_t *first = grid->first + (size_t)block * CELLS;
    for (uint32_t z = 0; z < SIDE; z++)
        for (uint32_t y = 0; y < SIDE && away[2][z] <= query->reach; y++)
            for (uint32_t x = 0; x < SIDE && away[2][z] + away[1][y] <= query->reach; x++) {
                uint32_t cell = (z * SIDE + y) * SIDE + x;
                if (away[2][z] + away[1][y] + away[0][x] > query->reach)
                    continue;
                for (uint32_t s = first[cell]; s < first[cell + 1]; s++)
                    visit(query, &grid->segments[s]);
            }
}

static float block_distance(const struct segment_grid *grid, const uint32_t at[3], const float p[3])
{
    float size = grid->cell * SIDE, squared = 0;
    for (int c = 0; c < 3; c++)
        squared += axis_distance(p[c], grid->origin[c] + size * (float)at[c], size);
    return squared;
}

/* All blocks within `radius` of the place. */
static inline __attribute__((always_inline)) void scan_around(const struct segment_grid *grid, float radius,
                                                              struct query *query, visit_segment *visit)
{
    const float *p = query->place->position;
    uint32_t low[3], high[3], at[3];
    for (int c = 0; c < 3; c++) {
        low[c] = cell_coordinate(grid, p[c] - radius, c) / SIDE;
        high[c] = cell_coordinate(grid, p[c] + radius, c) / SIDE;
    }
    for (at[2] = low[2]; at[2] <= high[2]; at[2]++)
        for (at[1] = low[1]; at[1] <= high[1]; at[1]++)
            for (at[0] = low[0]; at[0] <= high[0]; at[0]++) {
                uint32_t block = grid->block_of[block_index(grid, at)];
                if (block != UINT32_MAX && block_distance(grid, at, p) <= query->reach)
                    scan_block(grid, block, query, visit);
            }
}

static float squared_of(float x) { return x * x; }

static void keep_nearest(struct query *query, const struct grid_segment *segment)
{
    float squared = squared_distance(query->place->position, segment);
    if (!(squared < query->squared))
        return;
    query->squared = squared;
    query->cosine = dot(segment->half, query->place->direction) * segment->inverse;
    query->reach = fminf(query->reach, squared_of(sqrtf(squared) + query->pad));
}

/* The nearest block first, so that it rules out most of the others. */
static void scan_all(const struct segment_grid *grid, struct query *query)
{
    const float *p = query->place->position;
    uint32_t nearest = 0;
    float least = INFINITY;
    for (uint32_t b = 0; b < grid->n_blocks; b++) {
        float d = block_distance(grid, grid->place_of[b], p);
        if (d < least) {
            least = d;
            nearest = b;
        }
    }
    query->reach = INFINITY;
    scan_block(grid, nearest, query, keep_nearest);
    for (uint32_t b = 0; b < grid->n_blocks; b++)
        if (b != nearest && block_distance(grid, grid->place_of[b], p) <= query->reach)
            scan_block(grid, b, query, keep_nearest);
}

void segment_grid_nearest(const struct segment_grid *grid, const struct quality_place *place, float *squared, float *cosine)
{
    /* a segment lies in the cell of its middle; rounding of cells' corners is a small part of a cell */
    float pad = grid->longest_half + 0.01f * grid->cell;
    struct query query = {.place = place, .pad = pad, .squared = INFINITY};
    for (float radius = 2 * grid->cell; radius < 40 * grid->cell; radius *= 4) {
        query.reach = squared_of(radius + pad);
        scan_around(grid, radius + pad, &query, keep_nearest);
        if (query.squared <= radius * radius)
            break;
        query.squared = INFINITY;
    }
    if (!(query.squared < INFINITY))
        scan_all(grid, &query);
    *squared = query.squared;
    *cosine = query.cosine;
}

static void note_match(struct query *query, const struct grid_segment *segment)
{
    float cosine = dot(segment->half, query->place->direction) * segment->inverse;
    if (!(cosine >= query->least_cosine[query->n - 1]))
        return;
    float squared = squared_distance(query->place->position, segment);
    for (uint32_t k = query->n; k-- > 0;)
        if (squared <= squared_of(query->tolerance[k]) && cosine >= query->least_cosine[k])
            query->found[k] = 1;
    if (query->found[0])
        query->reach = -1; /* nothing more to learn */
}

void segment_grid_matches(const struct segment_grid *grid, const struct quality_place *place, const float *distance,
                          const float *cosine, uint32_t n, int *found)
{
    float radius = distance[n - 1] + grid->longest_half + 0.01f * grid->cell;
    struct query query = {.place = place, .reach = squared_of(radius), .tolerance = distance, .least_cosine = cosine,
                          .n = n, .found = found};
    memset(found, 0, n * sizeof *found);
    scan_around(grid, radius, &query, note_match);
}
