/* Forward evaluation: x = P(instance(g)), Chang et al. 2025, Eq. 1. */
#include "model/evaluate.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "model/model.h"
#include "model/plan.h"

#define SMALLEST_PIECE 64 /* strands */
#define LARGEST_PIECE 2048
#define PIECES 64
#define CACHE_LINE 64

struct evaluation {
    struct plan plan;
    struct workspace *workspace; /* [threads] */
    uint32_t first, count, piece_size;
    size_t first_vertex;
    int uneven;      /* strands have different numbers of vertices */
    uint32_t *order; /* [count] strands, those of one key together */
    float (*out)[3];
};

/* Ask for the memory that a row will be written to: all strands are more than a cache holds, and neighbours in a
 * block are none in memory. WebAssembly has no instruction for it; a store does the same, for nobody waits for it. */
static void fetch_row(float *row, uint32_t n)
{
    for (uint32_t i = 0; i < n; i += CACHE_LINE / sizeof *row) {
#ifdef __wasm__
        *(volatile float *)(row + i) = 0.0f;
#else
        __builtin_prefetch(row + i, 1);
#endif
    }
}

/* Rows of the lanes `step`, step + n_steps, ... */
static void fetch_rows(float *const row[LANES], uint32_t n_rows, uint32_t m, uint32_t step, uint32_t n_steps)
{
    for (uint32_t l = step; l < n_rows; l += n_steps)
        fetch_row(row[l], 3 * m);
}

static void evaluate_block(const struct evaluation *job, const struct block *block, struct workspace *w)
{
    const struct plan *plan = &job->plan;
    const float *root[LANES];
    float *row[LANES];
    plan_roots(plan, block, root);
    for (uint32_t l = 0; l < LANES; l++)
        row[l] = job->out[groom_first_vertex(plan->groom, block->strand[l]) - job->first_vertex];
    uint32_t first = plan_load_scaled(plan, block, w), n = plan->n_active - first;
    for (uint32_t a = 0; a < n; a++) {
        fetch_rows(row, block->n, w->m, a, n);
        plan_apply(plan, block, w, first + a, workspace_state(w, a % 2), workspace_state(w, (a + 1) % 2));
    }
    block_to_rows((const lanes *)workspace_state(w, n % 2).points, root, 3 * w->m, row, block->n);
}

/* Strands of one block must have as many vertices; and it is well that they share their operator guide. */
static uint32_t key_of(const struct evaluation *job, uint32_t strand)
{
    const struct groom *groom = job->plan.groom;
    if (job->uneven)
        return groom->first[strand + 1] - groom->first[strand];
    return groom->n_operator_guides ? groom->operator_guide_of[strand] : 0;
}

/* Counting sort of the strands by operator guide: the lanes of a block, and neighbouring blocks, then mostly
 * share their guides. It changes no bit, for no lane looks at another. */
static void sort_strands(struct evaluation *job, uint32_t n_keys, uint32_t *next)
{
    uint32_t sum = 0;
    for (uint32_t i = 0; i < job->count; i++)
        next[key_of(job, job->first + i)]++;
    for (uint32_t o = 0; o < n_keys; o++) {
        uint32_t size = next[o];
        next[o] = sum;
        sum += size;
    }
    for (uint32_t i = 0; i < job->count; i++)
        job->order[next[key_of(job, job->first + i)]++] = job->first + i;
}

static groom_status make_order(struct evaluation *job, const struct groom_allocator *allocator)
{
    const struct groom *groom = job->plan.groom;
    uint32_t n_keys = job->uneven ? groom->n_vertices + 1 : groom->n_operator_guides ? groom->n_operator_guides : 1;
    uint32_t *next = memory_array_zero(allocator, n_keys, sizeof *next);
    job->order = memory_array(allocator, job->count, sizeof *job->order);
    if (next && job->order)
        sort_strands(job, n_keys, next);
    memory_release(allocator, next, n_keys, sizeof *next);
    return next && job->order ? GROOM_OK : GROOM_ENOMEM;
}

/* How many of the strands from i on make one block. */
static uint32_t block_size(const struct evaluation *job, uint32_t i, uint32_t end)
{
    uint32_t n = end - i < LANES ? end - i : LANES, same = 1;
    if (!job->uneven)
        return n;
    while (same < n && key_of(job, job->order[i + same]) == key_of(job, job->order[i]))
        same++;
    return same;
}

static void evaluate_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct evaluation *job = user;
    uint32_t begin = piece * job->piece_size;
    uint32_t end = job->count - begin < job->piece_size ? job->count : begin + job->piece_size;
    struct workspace *w = &job->workspace[thread];
    for (uint32_t i = begin, n; i < end; i += n) {
        n = block_size(job, i, end);
        struct block block = block_of(job->order + i, n);
        if (job->uneven)
            w->m = key_of(job, job->order[i]);
        evaluate_block(job, &block, w);
    }
}

static uint32_t piece_size(uint32_t count)
{
    uint32_t size = count / PIECES / LANES * LANES;
    return size < SMALLEST_PIECE ? SMALLEST_PIECE : size > LARGEST_PIECE ? LARGEST_PIECE : size;
}

/* The memory of all threads. */
static groom_status evaluation_allocate(struct evaluation *job, uint32_t n_threads,
                                        const struct groom_allocator *allocator)
{
    const struct groom *groom = job->plan.groom;
    groom_status status = make_order(job, allocator);
    job->workspace = memory_array_zero(allocator, n_threads, sizeof *job->workspace);
    if (!job->workspace)
        return GROOM_ENOMEM;
    for (uint32_t t = 0; t < n_threads && status == GROOM_OK; t++)
        status = workspace_init(&job->workspace[t], groom->n_vertices, 2, allocator);
    return status;
}

static void evaluation_release(struct evaluation *job, uint32_t n_threads, const struct groom_allocator *allocator)
{
    for (uint32_t t = 0; job->workspace && t < n_threads; t++)
        workspace_finish(&job->workspace[t], allocator);
    memory_release(allocator, job->workspace, n_threads, sizeof *job->workspace);
    memory_release(allocator, job->order, job->count, sizeof *job->order);
    plan_finish(&job->plan);
}

static int is_uneven(const struct groom *groom)
{
    for (uint32_t i = 0; groom->base && i < groom->n_strands; i++)
        if (groom->first[i + 1] - groom->first[i] != groom->n_vertices)
            return 1;
    return 0;
}

static groom_status check_range(const struct groom *groom, uint32_t first, uint32_t count, struct groom_diag *diag)
{
    uint32_t layer = model_first_layer(groom);
    if (first > groom->n_strands || count > groom->n_strands - first)
        return groom_fail(diag, GROOM_EINVAL, "strands %u to %llu are asked for; there are %u", first,
                          (unsigned long long)first + count, groom->n_strands);
    if (layer < groom->n_operators)
        return groom_fail(diag, GROOM_EINVAL, "operator %u is a layer: the chain must be evaluated with groom_layers_evaluate",
                          layer);
    return GROOM_OK;
}

groom_status evaluate_with(enum kernel_variant variant, const struct groom *groom, uint32_t first, uint32_t count,
                           float (*out)[3], const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_threads = parallel_threads(context);
    struct evaluation job = {.first = first, .count = count, .piece_size = piece_size(count), .out = out};
    groom_status status = check_range(groom, first, count, diag);
    if (status != GROOM_OK)
        return status;
    job.first_vertex = groom_first_vertex(groom, first);
    job.uneven = is_uneven(groom);
    status = plan_init(&job.plan, groom, NULL, first, count, variant, context);
    if (status == GROOM_OK && groom->base && job.plan.n_active == 0) { /* as they are: root and back would round */
        memcpy(out, groom->base + job.first_vertex,
               (groom_first_vertex(groom, first + count) - job.first_vertex) * sizeof *out);
        plan_finish(&job.plan);
        return GROOM_OK;
    }
    if (status == GROOM_OK)
        status = evaluation_allocate(&job, n_threads, allocator);
    if (status == GROOM_OK)
        parallel_for(context, count / job.piece_size + (count % job.piece_size != 0), evaluate_piece, &job);
    evaluation_release(&job, n_threads, allocator);
    if (status != GROOM_OK)
        return groom_fail(diag, status, "no memory to evaluate %u strands", count);
    return GROOM_OK;
}

groom_status groom_evaluate(const struct groom *groom, uint32_t first, uint32_t count, float (*out)[3],
                            const struct groom_context *context, struct groom_diag *diag)
{
    return evaluate_with(kernel_best_variant(), groom, first, count, out, context, diag);
}
