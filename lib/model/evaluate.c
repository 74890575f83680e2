/* Forward evaluation: x = P(instance(g)), Chang et al. 2025, Eq. 1. */
#include "model/evaluate.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "model/plan.h"

#define SMALLEST_PIECE 64 /* strands */
#define LARGEST_PIECE 2048 /* whose small arrays stay in the second cache */
#define PIECES 64

struct evaluation {
    struct plan plan;
    struct workspace *workspace; /* [threads] */
    uint32_t first, count, piece_size;
    uint32_t *order; /* [count] strands, in each piece those of one operator guide together */
    uint32_t *next;  /* [threads][n_gop] for sorting */
    float (*out)[3];
};

static void store_block(const struct evaluation *job, const struct block *block, const lanes *x)
{
    const float *root[LANES];
    float *row[LANES];
    uint32_t m = job->plan.groom->n_vertices;
    plan_roots(&job->plan, block, root);
    for (uint32_t l = 0; l < block->n; l++)
        row[l] = job->out[(size_t)(block->strand[l] - job->first) * m];
    block_to_rows(x, root, 3 * m, row, block->n);
}

static void evaluate_block(const struct evaluation *job, const struct block *block, struct workspace *w)
{
    lanes *x = w->state, *y = w->state + 3 * (size_t)w->m;
    plan_load(&job->plan, block, w);
    for (uint32_t a = 0; a < job->plan.n_active; a++) {
        plan_apply(&job->plan, block, w, a, x, y);
        lanes *swap = x;
        x = y, y = swap;
    }
    store_block(job, block, x);
}

/* Counting sort of a piece's strands by operator guide: the lanes of a block then mostly share their
 * guides, which stay in the cache. It changes no bit, for no lane looks at another. */
static void sort_piece(const struct evaluation *job, uint32_t begin, uint32_t end, uint32_t *next)
{
    uint32_t n = job->plan.groom->n_operator_guides, sum = 0;
    const uint32_t *key = job->plan.groom->operator_guide_of + job->first;
    memset(next, 0, n * sizeof *next);
    for (uint32_t i = begin; i < end; i++)
        next[key[i]]++;
    for (uint32_t o = 0; o < n; o++) {
        uint32_t size = next[o];
        next[o] = sum;
        sum += size;
    }
    for (uint32_t i = begin; i < end; i++)
        job->order[begin + next[key[i]]++] = job->first + i;
}

static void evaluate_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct evaluation *job = user;
    uint32_t begin = piece * job->piece_size;
    uint32_t end = job->count - begin < job->piece_size ? job->count : begin + job->piece_size;
    sort_piece(job, begin, end, job->next + (size_t)thread * job->plan.groom->n_operator_guides);
    for (uint32_t i = begin; i < end; i += LANES) {
        struct block block = block_of(job->order + i, end - i < LANES ? end - i : LANES);
        evaluate_block(job, &block, &job->workspace[thread]);
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
    groom_status status = GROOM_OK;
    job->order = memory_array(allocator, job->count, sizeof *job->order);
    job->next = memory_array(allocator, (size_t)n_threads * groom->n_operator_guides, sizeof *job->next);
    job->workspace = memory_array_zero(allocator, n_threads, sizeof *job->workspace);
    if (!job->order || !job->next || !job->workspace)
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
    if (job->next)
        memory_release(allocator, job->next, (size_t)n_threads * job->plan.groom->n_operator_guides, sizeof *job->next);
    memory_release(allocator, job->order, job->count, sizeof *job->order);
    plan_finish(&job->plan);
}

groom_status evaluate_with(enum kernel_variant variant, const struct groom *groom, uint32_t first, uint32_t count,
                           float (*out)[3], const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_threads = parallel_threads(context);
    struct evaluation job = {.first = first, .count = count, .piece_size = piece_size(count), .out = out};
    if (first > groom->n_strands || count > groom->n_strands - first)
        return groom_fail(diag, GROOM_EINVAL, "strands %u to %llu are asked for; there are %u", first,
                          (unsigned long long)first + count, groom->n_strands);
    groom_status status = plan_init(&job.plan, groom, NULL, first, count, variant, context);
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
