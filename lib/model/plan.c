#include "model/plan.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "model/frames.h"
#include "model/model.h"
#include "model/noise.h"

#define GUIDES_A_PIECE 32

/* --- the plan ------------------------------------------------------------------ */

static void list_active(struct plan *plan)
{
    const struct groom *groom = plan->groom;
    for (uint32_t i = 0; i < groom->n_operators; i++) {
        if (!groom->operators[i].enabled)
            continue;
        plan->active[plan->n_active++] = i;
        plan->bends |= groom->operators[i].type == GROOM_OPERATOR_BEND;
        plan->curls |= groom->operators[i].type == GROOM_OPERATOR_CURL;
        plan->clumps |= groom->operators[i].type == GROOM_OPERATOR_CLUMP;
        plan->frizzes |= groom->operators[i].type == GROOM_OPERATOR_FRIZZ;
    }
}

struct framing {
    struct plan *plan;
    const uint8_t *used; /* [n_gop] */
};

static void frame_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    const struct framing *framing = user;
    struct plan *plan = framing->plan;
    const struct groom *groom = plan->groom;
    uint32_t m = groom->n_vertices, end = (piece + 1) * GUIDES_A_PIECE;
    for (uint32_t o = piece * GUIDES_A_PIECE; o < end && o < groom->n_operator_guides; o++) {
        const float(*guide)[3] = (const float(*)[3])groom->guides + (size_t)groom->operator_guide[o] * m;
        if (framing->used[o] && plan->curls)
            frames_curl(guide, m, plan->axes, plan->frame + (size_t)o * FRAME_WIDTH * m);
        if (framing->used[o] && plan->bends)
            frames_bend(guide, plan->axes, plan->axis + (size_t)o * AXIS_WIDTH);
    }
}

/* Frames of the operator guides that these strands use, and of no others: a large groom is often
 * evaluated in small ranges. */
static groom_status compute_frames(struct plan *plan, const uint32_t *strand, uint32_t first, uint32_t count,
                                   const struct groom_context *context)
{
    const struct groom *groom = plan->groom;
    uint32_t n = groom->n_operator_guides;
    size_t width = (size_t)FRAME_WIDTH * groom->n_vertices;
    if (plan->curls && !(plan->frame = memory_array(plan->allocator, n * width, sizeof(float))))
        return GROOM_ENOMEM;
    if (plan->bends && !(plan->axis = memory_array(plan->allocator, (size_t)n * AXIS_WIDTH, sizeof(float))))
        return GROOM_ENOMEM;
    uint8_t *used = memory_array_zero(plan->allocator, n, sizeof *used);
    if (!used)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < count; i++)
        used[groom->operator_guide_of[strand ? strand[i] : first + i]] = 1;
    struct framing framing = {plan, used};
    parallel_for(context, (n + GUIDES_A_PIECE - 1) / GUIDES_A_PIECE, frame_piece, &framing);
    memory_release(plan->allocator, used, n, sizeof *used);
    return GROOM_OK;
}

static void relate(struct plan *plan, uint32_t guide)
{
    uint32_t n = 3 * plan->groom->n_vertices;
    const float *from = plan->groom->guides[(size_t)guide * plan->groom->n_vertices];
    float *to = plan->relative + (size_t)guide * n;
    for (uint32_t j = 0; j < n; j += 3)
        for (uint32_t c = 0; c < 3; c++)
            to[j + c] = from[j + c] - from[c];
}

/* Guides relative to their roots: of these strands alone, too, but where it is all strands. */
static groom_status make_relative(struct plan *plan, const uint32_t *strand, uint32_t first, uint32_t count)
{
    const struct groom *groom = plan->groom;
    uint32_t n = 3 * groom->n_vertices, k = groom->n_instancing;
    int all = !strand && count == groom->n_strands;
    uint8_t *made = memory_array_zero(plan->allocator, groom->n_guides, sizeof *made);
    plan->relative = memory_array(plan->allocator, (size_t)groom->n_guides * n, sizeof *plan->relative);
    for (uint32_t g = 0; made && plan->relative && all && g < groom->n_guides; g++)
        relate(plan, g);
    for (uint32_t i = 0; made && plan->relative && !all && i < count; i++)
        for (uint32_t a = 0; a < k; a++) {
            uint32_t g = groom->instancing_guide[(size_t)(strand ? strand[i] : first + i) * k + a];
            if (!made[g])
                relate(plan, g);
            made[g] = 1;
        }
    memory_release(plan->allocator, made, groom->n_guides, sizeof *made);
    return made && plan->relative ? GROOM_OK : GROOM_ENOMEM;
}

groom_status plan_init(struct plan *plan, const struct groom *groom, const uint32_t *strand, uint32_t first,
                       uint32_t count, enum kernel_variant variant, const struct groom_context *context)
{
    groom_status status = GROOM_OK;
    *plan = (struct plan){.groom = groom, .axes = model_axes(groom), .variant = variant, .allocator = memory_allocator(context)};
    plan->active = memory_array(plan->allocator, groom->n_operators, sizeof *plan->active);
    if (!plan->active)
        return GROOM_ENOMEM;
    list_active(plan);
    if (!groom->base)
        status = make_relative(plan, strand, first, count);
    if (status == GROOM_OK && (plan->bends || plan->curls))
        status = compute_frames(plan, strand, first, count, context);
    if (plan->frizzes)
        plan->noise = noise_table();
    if (status != GROOM_OK)
        plan_finish(plan);
    return status;
}

void plan_finish(struct plan *plan)
{
    if (!plan->groom)
        return;
    size_t n = plan->groom->n_operator_guides, width = (size_t)FRAME_WIDTH * plan->groom->n_vertices;
    memory_release(plan->allocator, plan->active, plan->groom->n_operators, sizeof *plan->active);
    memory_release(plan->allocator, plan->relative, (size_t)plan->groom->n_guides * 3 * plan->groom->n_vertices,
                   sizeof *plan->relative);
    memory_release(plan->allocator, plan->frame, n * width, sizeof(float));
    memory_release(plan->allocator, plan->axis, n * AXIS_WIDTH, sizeof(float));
    *plan = (struct plan){0};
}

/* --- one block -------------------------------------------------------------------- */

groom_status workspace_init(struct workspace *w, uint32_t m, uint32_t n_states,
                            const struct groom_allocator *allocator)
{
    size_t points = (size_t)3 * m, n[6] = {points, n_states * (points + 2 * m), points, (size_t)FRAME_WIDTH * m, AXIS_WIDTH,
                                           KERNEL_SCRATCH(m)};
    *w = (struct workspace){.m = m, .n_states = n_states};
    for (int i = 0; i < 6; i++)
        w->n_memory += n[i];
    w->memory = memory_array(allocator, w->n_memory, sizeof *w->memory);
    if (!w->memory)
        return GROOM_ENOMEM;
    lanes *next = w->memory;
    w->rows = *next, next += n[0];
    w->state = next, next += n[1];
    w->guide = next, next += n[2];
    w->frame = next, next += n[3];
    w->axis = next, next += n[4];
    w->scratch = next;
    return GROOM_OK;
}

void workspace_finish(struct workspace *w, const struct groom_allocator *allocator)
{
    memory_release(allocator, w->memory, w->n_memory, sizeof *w->memory);
    *w = (struct workspace){0};
}

void plan_roots(const struct plan *plan, const struct block *block, const float *root[LANES])
{
    for (uint32_t l = 0; l < LANES; l++)
        root[l] = model_root(plan->groom, block->strand[l]);
}

/* Rows of a table of the operator guides, side by side. */
static void load_table(const struct plan *plan, const struct block *block, const float *table, uint32_t width,
                       lanes *x)
{
    const float *row[LANES];
    for (uint32_t l = 0; l < LANES; l++)
        row[l] = table + (size_t)plan->groom->operator_guide_of[block->strand[l]] * width;
    block_from_rows(row, NULL, width, x);
}

static void load_guides(const struct plan *plan, const struct block *block, lanes *x)
{
    const struct groom *groom = plan->groom;
    const float *row[LANES];
    for (uint32_t l = 0; l < LANES; l++) {
        uint32_t guide = groom->operator_guide[groom->operator_guide_of[block->strand[l]]];
        row[l] = groom->guides[(size_t)guide * groom->n_vertices];
    }
    block_from_rows(row, NULL, 3 * groom->n_vertices, x);
}

/* What the kernels see of the operator guides, where it is not that of the last block. */
static void load_operator_guides(const struct plan *plan, const struct block *block, struct workspace *w)
{
    uint32_t wanted[LANES];
    if (!plan->clumps && !plan->curls && !plan->bends)
        return;
    for (uint32_t l = 0; l < LANES; l++)
        wanted[l] = plan->groom->operator_guide_of[block->strand[l]] + 1;
    if (memcmp(wanted, w->loaded, sizeof wanted) == 0)
        return;
    memcpy(w->loaded, wanted, sizeof wanted);
    if (plan->clumps)
        load_guides(plan, block, w->guide);
    if (plan->curls)
        load_table(plan, block, plan->frame, FRAME_WIDTH * w->m, w->frame);
    if (plan->bends)
        load_table(plan, block, plan->axis, AXIS_WIDTH, w->axis);
}

/* A base's strands, relative to where they begin. */
static void load_base(const struct plan *plan, const struct block *block, struct workspace *w)
{
    uint32_t n = 3 * w->m;
    const float *row[LANES];
    for (uint32_t l = 0; l < LANES; l++) {
        const float *from = model_root(plan->groom, block->strand[l]);
        float *to = w->rows + (size_t)l * n;
        row[l] = to;
        for (uint32_t i = 0; i < n; i++)
            to[i] = from[i] - from[i % 3];
    }
    block_from_rows(row, NULL, n, w->state);
}

struct bundle workspace_state(const struct workspace *w, uint32_t i)
{
    lanes *points = w->state + (size_t)5 * w->m * i;
    return (struct bundle){.points = points, .at = points + (size_t)3 * w->m, .fallen = points + (size_t)4 * w->m};
}

struct kernel_inputs plan_inputs(const struct plan *plan, const struct block *block, const struct workspace *w,
                                 uint32_t a)
{
    const struct groom_operator *op = &plan->groom->operators[plan->active[a]];
    struct kernel_inputs in = {.m = w->m, .root = (const lanes *)w->root, .guide = w->guide, .frame = w->frame, .axis = w->axis,
                               .noise = plan->noise, .axes = plan->axes};
    memcpy(in.parameter, op->parameter, sizeof in.parameter);
    for (uint32_t r = 0; r < groom_operator_random_arrays(op->type); r++)
        for (uint32_t l = 0; l < LANES; l++) {
            uint32_t strand = block->strand[l];
            in.random[r][l] =
                op->random[r][groom_operator_random_per_guide(op->type) ? plan->groom->operator_guide_of[strand] : strand];
        }
    return in;
}

static groom_operator_type type_of(const struct plan *plan, uint32_t a)
{
    return plan->groom->operators[plan->active[a]].type;
}

/* What all begins with; factor: of block_instance. */
static void load_strands(const struct plan *plan, const struct block *block, const float *factor, struct workspace *w)
{
    if (plan->groom->base)
        load_base(plan, block, w);
    else
        block_instance(plan->groom, plan->relative, block, factor, w->state);
    for (uint32_t l = 0; l < LANES; l++)
        for (int c = 0; c < 3; c++)
            w->root[c][l] = model_root(plan->groom, block->strand[l])[c];
    load_operator_guides(plan, block, w);
}

static void measure(const struct plan *plan, struct workspace *w)
{
    kernel_measures[plan->variant](w->m, (const lanes *)w->state, workspace_state(w, 0).at);
}

void plan_load(const struct plan *plan, const struct block *block, struct workspace *w)
{
    load_strands(plan, block, NULL, w);
    if (plan->n_active > 0)
        measure(plan, w);
}

static int begins_with_scale(const struct plan *plan)
{
    return plan->n_active > 0 && type_of(plan, 0) == GROOM_OPERATOR_SCALE;
}

uint32_t plan_load_scaled(const struct plan *plan, const struct block *block, struct workspace *w)
{
    lanes factor;
    if (plan->groom->base || !begins_with_scale(plan)) {
        plan_load(plan, block, w);
        return 0;
    }
    struct kernel_inputs in = plan_inputs(plan, block, w, 0);
    scale_factor(&in, factor);
    load_strands(plan, block, factor, w);
    if (plan->n_active > 1)
        measure(plan, w);
    return 1;
}

void plan_apply(const struct plan *plan, const struct block *block, struct workspace *w, uint32_t a, struct bundle x,
                struct bundle y)
{
    struct kernel_inputs in = plan_inputs(plan, block, w, a);
    if (a == 0 || type_of(plan, a - 1) != GROOM_OPERATOR_BEND)
        x.fallen = NULL;
    if (a + 1 == plan->n_active)
        y.at = y.fallen = NULL;
    kernel_of(type_of(plan, a))->forward[plan->variant](&in, x, y, w->scratch);
}
