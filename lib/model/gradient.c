/* Reverse mode through the chain, exact: d(loss)/d(strands) to d(loss)/d(all that a fit moves).
 *
 * Each thread keeps the block before and after every operator, asks the caller for the adjoint of the
 * result, and walks the chain back; kernels recompute what is cheap (arc lengths, exponentials). What
 * belongs to one strand alone is written at once; what strands share goes through model/scatter.h, or
 * is added up in the order of the visit. */
#include "model/gradient.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "model/evaluate.h"
#include "model/model.h"
#include "model/plan.h"
#include "model/scatter.h"

#define PIECE GROOM_GRADIENT_PIECE
#define BLOCKS (PIECE / LANES)
#define WAVE_BLOCKS (WAVE / LANES)

/* What a strand gives to each active operator's shared numbers. */
struct share {
    double parameter[GROOM_OPERATOR_MAX_PARAMETERS];        /* summed over a block's lanes */
    float random[GROOM_OPERATOR_MAX_RANDOM][LANES];         /* one for each lane */
};

/* One thread's memory for one piece. */
struct bench {
    struct workspace block[BLOCKS];
    float *points, *d_points;                     /* [PIECE][3m] */
    lanes *d, *d_guide, *d_frame, *d_axis;        /* [3m], [3m], [FRAME_WIDTH * m], [AXIS_WIDTH] */
    lanes *memory;                                /* the six of them */
    size_t n_memory;
};

struct reverse {
    struct plan plan;
    struct scatter scatter;
    struct groom_adjoint adjoint;
    struct groom_gradient *gradient;
    struct bench *bench;    /* [n_threads] */
    uint32_t n_threads;
    struct share *share;    /* [WAVE_BLOCKS][n_active] */
    float *zero;            /* [3m] the adjoint of a lane that stands empty */
    uint32_t *visit;        /* [WAVE] strands of the present wave */
    uint32_t wave_first, wave_n;
    const struct groom_allocator *allocator;
};

/* --- memory -------------------------------------------------------------------------- */

static groom_status bench_init(struct bench *b, uint32_t m, uint32_t n_states, const struct groom_allocator *allocator)
{
    size_t points = (size_t)3 * m, rows = BLOCKS * points; /* PIECE rows of floats, in lanes */
    groom_status status = GROOM_OK;
    *b = (struct bench){.n_memory = 2 * rows + 2 * points + (size_t)FRAME_WIDTH * m + AXIS_WIDTH};
    b->memory = memory_array(allocator, b->n_memory, sizeof *b->memory);
    if (!b->memory)
        return GROOM_ENOMEM;
    lanes *next = b->memory;
    b->points = *next, next += rows;
    b->d_points = *next, next += rows;
    b->d = next, next += points;
    b->d_guide = next, next += points;
    b->d_frame = next, next += (size_t)FRAME_WIDTH * m;
    b->d_axis = next;
    for (int i = 0; i < BLOCKS && status == GROOM_OK; i++)
        status = workspace_init(&b->block[i], m, n_states, allocator);
    return status;
}

static void bench_finish(struct bench *b, const struct groom_allocator *allocator)
{
    for (int i = 0; i < BLOCKS; i++)
        workspace_finish(&b->block[i], allocator);
    memory_release(allocator, b->memory, b->n_memory, sizeof *b->memory);
}

static groom_status reverse_init(struct reverse *r, const struct groom *groom, const uint32_t *strand, uint32_t count,
                                 enum kernel_variant variant, const struct groom_context *context)
{
    groom_status status = plan_init(&r->plan, groom, strand, 0, count, variant, context);
    if (status == GROOM_OK)
        status = scatter_init(&r->scatter, &r->plan, context);
    if (status != GROOM_OK)
        return status;
    r->share = memory_array(r->allocator, (size_t)WAVE_BLOCKS * r->plan.n_active, sizeof *r->share);
    r->zero = memory_array_zero(r->allocator, (size_t)3 * groom->n_vertices, sizeof *r->zero);
    r->visit = memory_array(r->allocator, WAVE, sizeof *r->visit);
    r->bench = memory_array_zero(r->allocator, r->n_threads, sizeof *r->bench);
    if (!r->share || !r->zero || !r->visit || !r->bench)
        return GROOM_ENOMEM;
    for (uint32_t t = 0; t < r->n_threads && status == GROOM_OK; t++)
        status = bench_init(&r->bench[t], groom->n_vertices, r->plan.n_active + 1, r->allocator);
    return status;
}

static void reverse_finish(struct reverse *r, uint32_t m)
{
    for (uint32_t t = 0; r->bench && t < r->n_threads; t++)
        bench_finish(&r->bench[t], r->allocator);
    memory_release(r->allocator, r->bench, r->n_threads, sizeof *r->bench);
    memory_release(r->allocator, r->visit, WAVE, sizeof *r->visit);
    memory_release(r->allocator, r->zero, (size_t)3 * m, sizeof *r->zero);
    memory_release(r->allocator, r->share, (size_t)WAVE_BLOCKS * r->plan.n_active, sizeof *r->share);
    scatter_finish(&r->scatter);
    plan_finish(&r->plan);
}

/* --- one block --------------------------------------------------------------------------- */

static void forward_block(const struct reverse *r, const struct block *block, struct workspace *w, float *points)
{
    size_t size = (size_t)3 * w->m;
    const float *root[LANES];
    float *row[LANES];
    plan_load(&r->plan, block, w);
    for (uint32_t a = 0; a < r->plan.n_active; a++)
        plan_apply(&r->plan, block, w, a, workspace_state(w, a), workspace_state(w, a + 1));
    plan_roots(&r->plan, block, root);
    for (uint32_t l = 0; l < LANES; l++)
        row[l] = points + l * size;
    block_to_rows((const lanes *)workspace_state(w, r->plan.n_active).points, root, 3 * w->m, row, block->n);
}

static void load_adjoint(const struct reverse *r, const struct block *block, const float *d_points, lanes *d)
{
    size_t size = (size_t)3 * r->plan.groom->n_vertices;
    const float *row[LANES];
    for (uint32_t l = 0; l < LANES; l++)
        row[l] = l < block->n ? d_points + l * size : r->zero;
    block_from_rows(row, NULL, (uint32_t)size, d);
}

static void keep_share(const struct kernel_adjoints *adjoints, groom_operator_type type, struct share *share)
{
    uint32_t n_parameters;
    groom_operator_parameters(type, &n_parameters);
    for (uint32_t p = 0; p < n_parameters; p++) {
        share->parameter[p] = 0.0;
        for (int l = 0; l < LANES; l++)
            share->parameter[p] += adjoints->parameter[p][l];
    }
    for (uint32_t a = 0; a < groom_operator_random_arrays(type); a++)
        memcpy(share->random[a], adjoints->random[a], sizeof share->random[a]);
}

/* The root's row gets minus the sum of the others: x_j takes guide_j - guide_1 (Eq. 3). */
static void close_instance(uint32_t m, lanes *restrict d)
{
    for (int c = 0; c < 3; c++) {
        lanes sum = {0};
        for (uint32_t j = 1; j < m; j++)
            FOR_LANES(l) sum[l] += d[3 * j + c][l];
        FOR_LANES(l) d[c][l] = -sum[l];
    }
}

static void rows_of(const struct block *block, const lanes *x, float *table, uint32_t at, uint32_t width)
{
    float *row[LANES];
    for (uint32_t l = 0; l < block->n; l++)
        row[l] = table + (size_t)(at + l) * width;
    block_to_rows(x, NULL, width, row, block->n);
}

/* sum over vertices of d_j . (guide_j - guide_1), for each guide of the strand. */
static void weight_gradient(const struct groom *groom, uint32_t strand, const float *row, float *d_weight)
{
    uint32_t k = groom->n_instancing, m = groom->n_vertices;
    for (uint32_t a = 0; a < k; a++) {
        const float(*guide)[3] = (const float(*)[3])groom->guides + (size_t)groom->instancing_guide[(size_t)strand * k + a] * m;
        float sum[LANES] = {0}, total = 0.0f;
        uint32_t j = 1;
        for (; j + LANES <= m; j += LANES)
            for (int l = 0; l < LANES; l++)
                for (int c = 0; c < 3; c++)
                    sum[l] += row[3 * (j + (uint32_t)l) + (uint32_t)c] * (guide[j + (uint32_t)l][c] - guide[0][c]);
        for (; j < m; j++)
            for (int c = 0; c < 3; c++)
                total += row[3 * j + (uint32_t)c] * (guide[j][c] - guide[0][c]);
        for (int l = 0; l < LANES; l++)
            total += sum[l];
        d_weight[(size_t)strand * k + a] = total;
    }
}

/* `at`: the block's first strand in the wave. */
static void store_adjoints(const struct reverse *r, const struct block *block, struct bench *b, uint32_t at)
{
    const struct groom *groom = r->plan.groom;
    const struct scatter *s = &r->scatter;
    uint32_t m = groom->n_vertices;
    if (!r->gradient->guides && !r->gradient->instancing_weight)
        return;
    close_instance(m, b->d);
    rows_of(block, b->d, s->instance, at, 3 * m);
    if (r->gradient->instancing_weight)
        for (uint32_t l = 0; l < block->n; l++)
            weight_gradient(groom, block->strand[l], s->instance + (size_t)(at + l) * 3 * m,
                            r->gradient->instancing_weight);
    if (s->guide)
        rows_of(block, b->d_guide, s->guide, at, 3 * m);
    if (s->frame)
        rows_of(block, b->d_frame, s->frame, at, FRAME_WIDTH * m);
    if (s->axis)
        rows_of(block, b->d_axis, s->axis, at, AXIS_WIDTH);
}

static void backward_block(const struct reverse *r, const struct block *block, struct workspace *w, struct bench *b,
                           const float *d_points, uint32_t at)
{
    size_t size = (size_t)3 * w->m;
    struct kernel_adjoints adjoints = {.guide = b->d_guide, .frame = b->d_frame, .axis = b->d_axis};
    struct share *share = r->share + (size_t)(at / LANES) * r->plan.n_active;
    load_adjoint(r, block, d_points, b->d);
    if (r->plan.clumps)
        memset(b->d_guide, 0, size * sizeof(lanes));
    if (r->plan.curls)
        memset(b->d_frame, 0, (size_t)FRAME_WIDTH * w->m * sizeof(lanes));
    memset(b->d_axis, 0, AXIS_WIDTH * sizeof(lanes));
    for (uint32_t a = r->plan.n_active; a-- > 0;) {
        struct kernel_inputs in = plan_inputs(&r->plan, block, w, a);
        groom_operator_type type = r->plan.groom->operators[r->plan.active[a]].type;
        kernel_of(type)->backward[r->plan.variant](&in, (const lanes *)workspace_state(w, a).points, b->d, &adjoints,
                                                      w->scratch);
        keep_share(&adjoints, type, &share[a]);
    }
    store_adjoints(r, block, b, at);
}

static void reverse_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct reverse *r = user;
    struct bench *b = &r->bench[thread];
    uint32_t first = piece * PIECE, n = r->wave_n - first < PIECE ? r->wave_n - first : PIECE;
    size_t row = (size_t)3 * r->plan.groom->n_vertices;
    struct block block[BLOCKS];
    for (uint32_t i = 0; i < n; i += LANES) {
        block[i / LANES] = block_of(r->visit + first + i, n - i < LANES ? n - i : LANES);
        forward_block(r, &block[i / LANES], &b->block[i / LANES], b->points + i * row);
    }
    r->adjoint.evaluate(r->adjoint.user, r->wave_first + first, n, (const float(*)[3])b->points,
                        (float(*)[3])b->d_points);
    for (uint32_t i = 0; i < n; i += LANES)
        backward_block(r, &block[i / LANES], &b->block[i / LANES], b, b->d_points + i * row, first + i);
}

/* --- the waves ------------------------------------------------------------------------------ */

/* Shares of the wave's strands, in the order of the visit. */
static void add_shares(const struct reverse *r)
{
    const struct groom *groom = r->plan.groom;
    for (uint32_t a = 0; r->gradient->operators && a < r->plan.n_active; a++) {
        struct groom_operator_gradient *sum = &r->gradient->operators[r->plan.active[a]];
        int per_guide = groom_operator_random_per_guide(sum->type);
        uint32_t n_parameters, n_random = groom_operator_random_arrays(sum->type);
        groom_operator_parameters(sum->type, &n_parameters);
        for (uint32_t v = 0; v < r->wave_n; v++) {
            const struct share *share = &r->share[(size_t)(v / LANES) * r->plan.n_active + a];
            for (uint32_t p = 0; p < n_parameters && v % LANES == 0; p++)
                sum->parameter[p] += share->parameter[p];
            uint32_t i = per_guide ? groom->operator_guide_of[r->visit[v]] : r->visit[v];
            for (uint32_t u = 0; u < n_random; u++)
                if (sum->random[u])
                    sum->random[u][i] += share->random[u][v % LANES];
        }
    }
}

static void run_waves(struct reverse *r, const uint32_t *strand, uint32_t count, const struct groom_context *context)
{
    for (r->wave_first = 0; r->wave_first < count; r->wave_first += r->wave_n) {
        r->wave_n = count - r->wave_first < WAVE ? count - r->wave_first : WAVE;
        for (uint32_t v = 0; v < r->wave_n; v++)
            r->visit[v] = strand ? strand[r->wave_first + v] : r->wave_first + v;
        parallel_for(context, (r->wave_n + PIECE - 1) / PIECE, reverse_piece, r);
        add_shares(r);
        if (r->gradient->guides)
            scatter_wave(&r->scatter, r->visit, r->wave_n, r->gradient->guides, context);
    }
    if (r->gradient->guides)
        scatter_frames(&r->scatter, r->gradient->guides, context);
}

static groom_status check_visit(const struct groom *groom, const uint32_t *strand, uint32_t count,
                                const struct groom_gradient *gradient, struct groom_diag *diag)
{
    if (groom->base || model_first_layer(groom) < groom->n_operators)
        return groom_fail(diag, GROOM_EINVAL, "a groom made of strands has no gradient, and neither has a layer");
    if (!gradient_matches(gradient, groom))
        return groom_fail(diag, GROOM_EINVAL, "the gradient was made for another groom or chain; create it anew");
    if (!strand && count != groom->n_strands)
        return groom_fail(diag, GROOM_EINVAL, "all %u strands are to be visited, but the count is %u",
                          groom->n_strands, count);
    for (uint32_t i = 0; strand && i < count; i++)
        if (strand[i] >= groom->n_strands)
            return groom_fail(diag, GROOM_EINVAL, "strand %u is to be visited; there are %u", strand[i],
                              groom->n_strands);
    return GROOM_OK;
}

groom_status gradient_with(enum kernel_variant variant, const struct groom *groom, const uint32_t *strand,
                           uint32_t count, struct groom_adjoint adjoint, struct groom_gradient *gradient,
                           const struct groom_context *context, struct groom_diag *diag)
{
    struct reverse r = {.adjoint = adjoint, .gradient = gradient, .allocator = memory_allocator(context),
                        .n_threads = parallel_threads(context)};
    groom_status status = check_visit(groom, strand, count, gradient, diag);
    if (status != GROOM_OK)
        return status;
    gradient_zero(gradient);
    status = reverse_init(&r, groom, strand, count, variant, context);
    if (status == GROOM_OK)
        run_waves(&r, strand, count, context);
    reverse_finish(&r, groom->n_vertices);
    if (status != GROOM_OK)
        return groom_fail(diag, status, "no memory for the gradient of %u strands", count);
    return GROOM_OK;
}

groom_status groom_evaluate_gradient(const struct groom *groom, const uint32_t *strand, uint32_t count,
                                     struct groom_adjoint adjoint, struct groom_gradient *gradient,
                                     const struct groom_context *context, struct groom_diag *diag)
{
    return gradient_with(kernel_best_variant(), groom, strand, count, adjoint, gradient, context, diag);
}
