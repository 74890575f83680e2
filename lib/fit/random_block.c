#include "fit/random_block.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "fit/head_planes.h"

/* --- life ------------------------------------------------------------------------------- */

static size_t memory_lanes(uint32_t m) { return (size_t)(3 + 4 + 4 + 3 * RANDOM_BLOCK_WEIGHTS) * m + STRAND_ERROR_SCRATCH(m); }

groom_status random_block_memory_init(struct random_search_memory *memory, uint32_t m, uint32_t n_active,
                                      const struct groom_allocator *allocator)
{
    groom_status st = workspace_init(&memory->w, m, n_active + 3, allocator);
    if (st != GROOM_OK)
        return st;
    if (!(memory->memory = memory_array(allocator, memory_lanes(m), sizeof *memory->memory)))
        return GROOM_ENOMEM;
    memory->target.point = memory->memory;
    memory->plane = memory->target.point + (size_t)3 * m;
    memory->scratch = memory->plane + (size_t)4 * m;
    memory->blend = memory->scratch + STRAND_ERROR_SCRATCH(m);
    memory->toward = memory->blend + (size_t)4 * m;
    return GROOM_OK;
}

void random_block_memory_finish(struct random_search_memory *memory, uint32_t m, const struct groom_allocator *allocator)
{
    workspace_finish(&memory->w, allocator);
    memory_release(allocator, memory->memory, memory_lanes(m), sizeof *memory->memory);
}

/* --- the chain ----------------------------------------------------------------------------- */

struct block random_block_range(const struct random_search *search, uint32_t first, uint32_t n)
{
    uint32_t strand[LANES];
    n = n < LANES ? n : LANES;
    for (uint32_t l = 0; l < n; l++)
        strand[l] = search->only ? search->only[first + l] : first + l;
    return block_of(strand, n);
}

static int is_left_out(const struct random_search *search, uint32_t active) { return search->leave_out >> active & 1; }

static void apply(const struct random_search *search, struct random_search_memory *memory, uint32_t active,
                  struct bundle x, struct bundle y)
{
    groom_operator_type type = search->plan.groom->operators[search->plan.active[active]].type;
    x.fallen = NULL; /* operators may be left out, or changed */
    kernel_of(type)->forward[search->plan.variant](&memory->in[active], x, y, memory->w.scratch);
}

/* Planes where the target is inside: through the target. */
static void let_in_with_target(const struct random_search *search, struct random_search_memory *memory)
{
    uint32_t m = search->fit->m;
    for (uint32_t k = 0; k < head_planes_of(m); k++) {
        const lanes *p = (const lanes *)memory->target.point + (size_t)3 * head_plane_vertex(k, m);
        lanes *plane = memory->plane + (size_t)4 * k;
        FOR_LANES(l)
        {
            float outside = plane[0][l] * p[0][l] + plane[1][l] * p[1][l] + plane[2][l] * p[2][l] + plane[3][l];
            plane[3][l] -= at_most(outside, 0.0f);
        }
    }
}

static void load_planes(const struct random_search *search, struct random_search_memory *memory, const struct block *block)
{
    const struct groom_fit *fit = search->fit;
    uint32_t n = head_planes_of(fit->m);
    const float *row[LANES];
    memory->target.plane = NULL;
    if (!fit->head_plane)
        return;
    for (uint32_t l = 0; l < LANES; l++)
        row[l] = fit->head_plane[(size_t)block->strand[l] * n].normal;
    block_from_rows(row, NULL, 4 * n, memory->plane);
    if (!search->out_of_head)
        let_in_with_target(search, memory);
    memory->target.plane = memory->plane;
}

static void load_target(const struct random_search *search, struct random_search_memory *memory,
                        const struct block *block)
{
    const struct groom_fit *fit = search->fit;
    const float *row[LANES];
    for (uint32_t l = 0; l < LANES; l++) {
        const float *from = fit->target[(size_t)block->strand[l] * fit->m], *root = fit->roots[block->strand[l]];
        float *to = memory->w.rows + (size_t)3 * fit->m * l;
        for (uint32_t j = 0; j < fit->m; j++)
            for (uint32_t c = 0; c < 3; c++)
                to[3 * j + c] = from[3 * j + c] * fit->scale + (fit->centre[c] - root[c]);
        row[l] = to;
    }
    block_from_rows(row, NULL, 3 * fit->m, memory->target.point);
    strand_error_measure(fit->m, &memory->target);
}

void random_block_advance(const struct random_search *search, struct random_search_memory *memory, uint32_t from,
                          uint32_t active)
{
    for (uint32_t a = from; a < active; a++) {
        struct bundle x = workspace_state(&memory->w, a), y = workspace_state(&memory->w, a + 1);
        if (is_left_out(search, a)) {
            memcpy(y.points, x.points, (size_t)3 * search->fit->m * sizeof *y.points);
            memcpy(y.at, x.at, search->fit->m * sizeof *y.at);
        } else {
            apply(search, memory, a, x, y);
        }
    }
}

void random_block_load(const struct random_search *search, struct random_search_memory *memory, const struct block *block,
                       uint32_t active)
{
    load_target(search, memory, block);
    load_planes(search, memory, block);
    plan_load(&search->plan, block, &memory->w);
    for (uint32_t a = 0; a < search->plan.n_active; a++)
        memory->in[a] = plan_inputs(&search->plan, block, &memory->w, a);
    random_block_advance(search, memory, 0, active);
}

struct bundle random_block_before(const struct random_search_memory *memory, uint32_t active)
{
    return workspace_state(&memory->w, active);
}

struct bundle random_block_start(const struct random_search_memory *memory) { return random_block_before(memory, 0); }

static const lanes *finish(const struct random_search *search, struct random_search_memory *memory, struct bundle x,
                           uint32_t active, uint32_t leave_out)
{
    uint32_t n = search->plan.n_active, spare = n + 1;
    for (uint32_t a = active; a < n; a++) {
        if (leave_out >> a & 1)
            continue;
        struct bundle y = workspace_state(&memory->w, spare);
        if (a + 1 == n)
            y.at = y.fallen = NULL;
        apply(search, memory, a, x, y);
        x = y;
        spare = spare == n + 1 ? n + 2 : n + 1;
    }
    return (const lanes *)x.points;
}

void random_block_lengths(const struct random_search *search, struct random_search_memory *memory, uint32_t active,
                          float *length)
{
    const lanes *x = finish(search, memory, random_block_before(memory, active), active, 0);
    memset(length, 0, sizeof(lanes));
    for (uint32_t j = 0; j + 1 < search->fit->m; j++, x += 3)
        FOR_LANES(l)
        {
            float ex = x[3][l] - x[0][l], ey = x[4][l] - x[1][l], ez = x[5][l] - x[2][l];
            length[l] += sqrtf(ex * ex + ey * ey + ez * ez);
        }
}

void random_block_evaluate(const struct random_search *search, struct random_search_memory *memory, struct bundle x,
                           uint32_t active, float *error)
{
    const lanes *y = finish(search, memory, x, active, search->leave_out);
    strand_error(search->plan.variant, search->fit->m, y, &memory->target, &search->weights, memory->scratch, error);
}

/* --- instancing weights ---------------------------------------------------------------------- */

/* The heaviest pays: it has most to give. The others in their order. */
static void order_weights(const float *weight, uint32_t k, uint32_t n, uint32_t *other)
{
    uint32_t heaviest = 0, at = 0;
    for (uint32_t a = 1; a < k; a++)
        if (weight[a] > weight[heaviest])
            heaviest = a;
    for (uint32_t a = 0; a < k && at < n; a++)
        if (a != heaviest)
            other[at++] = a;
    other[n] = heaviest;
}

static const float *shape_of(const struct groom *groom, uint32_t strand, uint32_t which)
{
    return groom->guides[(size_t)groom->instancing_guide[(size_t)strand * groom->n_instancing + which] * groom->n_vertices];
}

void random_block_load_weights(const struct random_search *search, struct random_search_memory *memory,
                               const struct block *block, uint32_t n)
{
    const struct groom *groom = search->plan.groom;
    uint32_t k = groom->n_instancing, points = 3 * groom->n_vertices;
    for (uint32_t l = 0; l < LANES; l++) {
        const float *weight = groom->instancing_weight + (size_t)block->strand[l] * k;
        order_weights(weight, k, n, memory->other[l]);
        for (uint32_t a = 0; a <= n; a++)
            memory->weight[a][l] = weight[memory->other[l][a]];
    }
    for (uint32_t a = 0; a <= n; a++) {
        const float *row[LANES];
        for (uint32_t l = 0; l < LANES; l++)
            row[l] = shape_of(groom, block->strand[l], memory->other[l][a]);
        block_from_rows(row, row, points, a < n ? memory->toward + (size_t)a * points : memory->blend);
    }
    for (uint32_t a = 0; a < n; a++)
        for (uint32_t i = 0; i < points; i++)
            FOR_LANES(l) memory->toward[(size_t)a * points + i][l] -= memory->blend[i][l];
}

struct bundle random_block_blend(const struct random_search *search, struct random_search_memory *memory, uint32_t n,
                                 lanes *more)
{
    uint32_t m = search->fit->m, points = 3 * m;
    const lanes *from = (const lanes *)random_block_start(memory).points;
    struct bundle blend = {.points = memory->blend, .at = memory->blend + points};
    for (uint32_t a = 0; a < n; a++, from = (const lanes *)memory->blend) {
        const lanes *toward = (const lanes *)memory->toward + (size_t)a * points;
        for (uint32_t i = 0; i < points; i++)
            FOR_LANES(l) memory->blend[i][l] = from[i][l] + more[a][l] * toward[i][l];
    }
    kernel_measures[search->plan.variant](m, (const lanes *)blend.points, blend.at);
    return blend;
}

void random_block_confine(const struct random_search_memory *memory, uint32_t n, lanes *more)
{
    for (int l = 0; l < LANES; l++) {
        float sum = 0, all = memory->weight[n][l], left = all;
        for (uint32_t a = 0; a < n; a++) {
            float weight = fmaxf(memory->weight[a][l] + more[a][l], 0);
            all += memory->weight[a][l];
            left -= weight - memory->weight[a][l];
            sum += weight;
            more[a][l] = weight - memory->weight[a][l];
        }
        for (uint32_t a = 0; left < 0 && sum > 0 && a < n; a++) /* the heaviest is spent: share what there is */
            more[a][l] = (memory->weight[a][l] + more[a][l]) * (all / sum) - memory->weight[a][l];
    }
}

void random_block_store_weights(const struct random_search *search, const struct random_search_memory *memory,
                                const struct block *block, uint32_t n, lanes *more)
{
    const struct groom *groom = search->plan.groom;
    uint32_t k = groom->n_instancing;
    for (uint32_t l = 0; l < block->n; l++) {
        float *weight = groom->instancing_weight + (size_t)block->strand[l] * k, given = 0;
        for (uint32_t a = 0; a < n; a++) {
            weight[memory->other[l][a]] = fmaxf(memory->weight[a][l] + more[a][l], 0);
            given += more[a][l];
        }
        weight[memory->other[l][n]] = fmaxf(memory->weight[n][l] - given, 0);
    }
}
