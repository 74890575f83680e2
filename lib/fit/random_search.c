#include "fit/random_search.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "fit/random_block.h"
#include "fit/strand_state.h"
#include "groom/strands.h"

#define MOST_INSTANCES 8       /* guides of a strand */
#define MOST_RANKED (MOST_INSTANCES + RANDOM_SEARCH_SKIP)
#define VALLEYS 4              /* of a rugged error that are followed to their floors */

/* --- life ------------------------------------------------------------------------------- */

groom_status random_search_init(struct random_search *search, struct groom_fit *fit,
                                const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    groom_status st;
    *search = (struct random_search){.fit = fit, .n_threads = parallel_threads(context), .allocator = allocator};
    st = plan_init(&search->plan, fit->groom, NULL, 0, fit->n, kernel_best_variant(), context);
    if (st == GROOM_OK && !(search->memory = memory_array_zero(allocator, search->n_threads, sizeof *search->memory)))
        st = GROOM_ENOMEM;
    for (uint32_t t = 0; st == GROOM_OK && t < search->n_threads; t++)
        st = random_block_memory_init(&search->memory[t], fit->m, search->plan.n_active, allocator);
    return st == GROOM_OK ? st : groom_fail(diag, st, "no memory to search for random numbers");
}

void random_search_finish(struct random_search *search)
{
    for (uint32_t t = 0; search->memory && t < search->n_threads; t++)
        random_block_memory_finish(&search->memory[t], search->fit->m, search->allocator);
    memory_release(search->allocator, search->memory, search->n_threads, sizeof *search->memory);
    plan_finish(&search->plan);
}

/* --- one number a strand ---------------------------------------------------------------------- */

struct strands_job {
    struct random_search *search;
    uint32_t active, first, count, n_grid, n_halvings;
    float minimum, maximum;
    float *u;
    int n_valleys; /* VALLEYS at most */
};

/* The deepest valleys of a strand's error that were met, the best first. */
struct valleys { lanes value[VALLEYS], least[VALLEYS]; };

static void evaluate_values(const struct strands_job *job, struct random_search_memory *memory, const lanes value, lanes error)
{
    memcpy(memory->in[job->active].random[0], value, sizeof(lanes));
    random_block_evaluate(job->search, memory, random_block_before(memory, job->active), job->active, error);
}

/* A new valley of lane l, where it is among the deepest. */
static void add_valley(struct valleys *valleys, int l, float value, float error)
{
    int at = VALLEYS;
    for (; at > 0 && error < valleys->least[at - 1][l]; at--)
        if (at < VALLEYS) {
            valleys->value[at][l] = valleys->value[at - 1][l];
            valleys->least[at][l] = valleys->least[at - 1][l];
        }
    if (at < VALLEYS) {
        valleys->value[at][l] = value;
        valleys->least[at][l] = error;
    }
}

/* Over the whole range, values that are better than both of their neighbours; and the present one. */
static void look_around(const struct strands_job *job, struct random_search_memory *memory, float step, struct valleys *valleys)
{
    lanes value, error = {0}, last = {0}, falls = {0};
    memcpy(value, memory->in[job->active].random[0], sizeof value);
    for (int v = 0; v < VALLEYS; v++)
        for (int l = 0; l < LANES; l++)
            valleys->value[v][l] = value[l], valleys->least[v][l] = INFINITY;
    evaluate_values(job, memory, value, valleys->least[0]);
    for (uint32_t k = 0; k <= job->n_grid; k++) {
        float here = job->minimum + ((float)k + 0.5f) * step;
        for (int l = 0; l < LANES; l++)
            value[l] = here;
        if (k < job->n_grid)
            evaluate_values(job, memory, value, error);
        for (int l = 0; l < LANES; l++) {
            int rises = k == job->n_grid || !(error[l] < last[l]);
            if (falls[l] != 0 && rises)
                add_valley(valleys, l, here - step, last[l]);
            falls[l] = k == 0 || !rises;
            last[l] = error[l];
        }
    }
}

/* Down to the floor of one of them. */
static void descend(const struct strands_job *job, struct random_search_memory *memory, float step, lanes best, lanes least)
{
    for (uint32_t h = 0; h < job->n_halvings; h++) {
        lanes centre, value, error;
        memcpy(centre, best, sizeof centre);
        step *= 0.5f;
        for (int side = -1; side <= 1; side += 2) {
            for (int l = 0; l < LANES; l++)
                value[l] = fminf(fmaxf(centre[l] + (float)side * step, job->minimum), job->maximum);
            evaluate_values(job, memory, value, error);
            for (int l = 0; l < LANES; l++)
                if (error[l] < least[l]) {
                    least[l] = error[l];
                    best[l] = value[l];
                }
        }
    }
}

static void search_block(const struct strands_job *job, struct random_search_memory *memory, const struct block *block)
{
    float step = (job->maximum - job->minimum) / (float)job->n_grid;
    struct valleys valleys;
    random_block_load(job->search, memory, block, job->active);
    look_around(job, memory, step, &valleys);
    for (int v = 0; v < job->n_valleys; v++)
        descend(job, memory, step, valleys.value[v], valleys.least[v]);
    for (uint32_t l = 0; l < block->n; l++) {
        int best = 0;
        for (int v = 1; v < job->n_valleys; v++)
            if (valleys.least[v][l] < valleys.least[best][l])
                best = v;
        job->u[block->strand[l]] = valleys.value[best][l];
    }
}

static void search_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct strands_job *job = user;
    uint32_t begin = piece * RANDOM_BLOCK_PIECE, end = begin + RANDOM_BLOCK_PIECE;
    end = end < job->count ? end : job->count;
    for (uint32_t i = begin; i < end; i += LANES) {
        struct block block = random_block_range(job->search, job->first + i, end - i);
        search_block(job, &job->search->memory[thread], &block);
    }
}

static const struct groom_operator *operator_of(const struct random_search *search, uint32_t active)
{
    return &search->plan.groom->operators[search->plan.active[active]];
}

/* Noise has hills and valleys all over its range. */
static int is_rugged(const struct groom_operator *op) { return op->type == GROOM_OPERATOR_FRIZZ; }

void random_search_strands(struct random_search *search, uint32_t active, uint32_t first, uint32_t count,
                           uint32_t n_grid, uint32_t n_halvings, const struct groom_context *context)
{
    const struct groom_operator *op = operator_of(search, active);
    uint32_t n_randoms;
    const struct groom_operator_random *random = groom_operator_randoms(op->type, &n_randoms);
    struct strands_job job = {search, active, first, count, n_grid, n_halvings, random[0].minimum, random[0].maximum,
                              op->random[0], is_rugged(op) ? VALLEYS : 1};
    parallel_for(context, (count + RANDOM_BLOCK_PIECE - 1) / RANDOM_BLOCK_PIECE, search_piece, &job);
}

void random_search_numbers(struct random_search *search, uint32_t first, uint32_t count, uint32_t n_grid, uint32_t n_rugged,
                           uint32_t n_halvings, const struct groom_context *context)
{
    for (uint32_t a = 0; a < search->plan.n_active; a++) {
        const struct groom_operator *op = operator_of(search, a);
        uint32_t n = is_rugged(op) ? n_rugged : n_grid;
        if (strand_state_draws(op))
            random_search_strands(search, a, first, count, n, n_halvings, context);
    }
}

/* --- the operator guide of a strand ----------------------------------------------------------------- */

struct guides_job {
    struct random_search *search;
    const uint32_t *candidate;
    uint32_t first, count, n_candidates;
    float gain;    /* of operator guides */
    uint32_t skip; /* of guides */
};

static void follow_block(const struct guides_job *job, struct random_search_memory *memory, const struct block *block,
                         const uint32_t *candidate)
{
    uint32_t *follows = job->search->fit->groom->operator_guide_of, best[LANES];
    lanes error, least;
    for (uint32_t l = 0; l < block->n; l++)
        best[l] = follows[block->strand[l]];
    random_block_load(job->search, memory, block, 0);
    random_block_evaluate(job->search, memory, random_block_start(memory), 0, least);
    for (int l = 0; l < LANES; l++)
        least[l] *= 1 - job->gain;
    for (uint32_t c = 0; c < job->n_candidates; c++) {
        for (uint32_t l = 0; l < block->n; l++) {
            uint32_t guide = candidate[(size_t)l * job->n_candidates + c];
            if (guide != UINT32_MAX)
                follows[block->strand[l]] = guide;
        }
        random_block_load(job->search, memory, block, 0);
        random_block_evaluate(job->search, memory, random_block_start(memory), 0, error);
        for (uint32_t l = 0; l < block->n; l++)
            if (error[l] < least[l]) {
                least[l] = error[l];
                best[l] = follows[block->strand[l]];
            }
    }
    for (uint32_t l = 0; l < block->n; l++)
        follows[block->strand[l]] = best[l];
}

static void follow_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct guides_job *job = user;
    uint32_t begin = piece * RANDOM_BLOCK_PIECE, end = begin + RANDOM_BLOCK_PIECE;
    end = end < job->count ? end : job->count;
    for (uint32_t i = begin; i < end; i += LANES) {
        struct block block = random_block_range(job->search, job->first + i, end - i);
        follow_block(job, &job->search->memory[thread], &block, job->candidate + (size_t)i * job->n_candidates);
    }
}

void random_search_guides(struct random_search *search, uint32_t first, uint32_t count, const uint32_t *candidate,
                          uint32_t n_candidates, float gain, const struct groom_context *context)
{
    struct guides_job job = {search, candidate, first, count, n_candidates, gain, 0};
    parallel_for(context, (count + RANDOM_BLOCK_PIECE - 1) / RANDOM_BLOCK_PIECE, follow_piece, &job);
}

/* --- errors ------------------------------------------------------------------------------------------ */

struct errors_job { struct random_search *search; uint32_t count; float *error; };

static void errors_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct errors_job *job = user;
    struct random_search_memory *memory = &job->search->memory[thread];
    uint32_t begin = piece * RANDOM_BLOCK_PIECE, end = begin + RANDOM_BLOCK_PIECE;
    end = end < job->count ? end : job->count;
    for (uint32_t i = begin; i < end; i += LANES) {
        struct block block = random_block_range(job->search, i, end - i);
        lanes error;
        random_block_load(job->search, memory, &block, 0);
        random_block_evaluate(job->search, memory, random_block_start(memory), 0, error);
        memcpy(job->error + i, error, block.n * sizeof *error);
    }
}

void random_search_errors(struct random_search *search, uint32_t count, float *error, const struct groom_context *context)
{
    struct errors_job job = {search, count, error};
    parallel_for(context, (count + RANDOM_BLOCK_PIECE - 1) / RANDOM_BLOCK_PIECE, errors_piece, &job);
}

/* --- the guides of a strand ------------------------------------------------------------------------- */

static void set_guides(struct groom *groom, uint32_t strand, const uint32_t guide[MOST_INSTANCES])
{
    uint32_t k = groom->n_instancing;
    for (uint32_t a = 0; a < k; a++) {
        groom->instancing_guide[(size_t)strand * k + a] = guide[a < MOST_INSTANCES ? a : 0];
        groom->instancing_weight[(size_t)strand * k + a] = a == 0;
    }
}

/* Among the k best so far. */
static void rank(uint32_t guide, float error, uint32_t k, uint32_t *best, float *least)
{
    uint32_t at = k;
    for (; at > 0 && error < least[at - 1]; at--)
        if (at < k) {
            best[at] = best[at - 1];
            least[at] = least[at - 1];
        }
    if (at < k) {
        best[at] = guide;
        least[at] = error;
    }
}

static void instance_block(const struct guides_job *job, struct random_search_memory *memory, const struct block *block,
                           const uint32_t *candidate)
{
    struct groom *groom = job->search->fit->groom;
    uint32_t k = groom->n_instancing < MOST_INSTANCES ? groom->n_instancing : MOST_INSTANCES, n = k + job->skip;
    uint32_t best[LANES][MOST_RANKED];
    float least[LANES][MOST_RANKED];
    for (uint32_t l = 0; l < LANES; l++)
        for (uint32_t a = 0; a < MOST_RANKED; a++)
            best[l][a] = candidate[(size_t)(l < block->n ? l : 0) * job->n_candidates], least[l][a] = INFINITY;
    for (uint32_t c = 0; c < job->n_candidates; c++) {
        lanes error;
        for (uint32_t l = 0; l < block->n; l++) {
            uint32_t guide[MOST_INSTANCES];
            for (uint32_t a = 0; a < MOST_INSTANCES; a++)
                guide[a] = candidate[(size_t)l * job->n_candidates + c];
            if (guide[0] != UINT32_MAX)
                set_guides(groom, block->strand[l], guide);
        }
        random_block_load(job->search, memory, block, 0);
        random_block_evaluate(job->search, memory, random_block_start(memory), 0, error);
        for (uint32_t l = 0; l < block->n; l++)
            if (candidate[(size_t)l * job->n_candidates + c] != UINT32_MAX)
                rank(candidate[(size_t)l * job->n_candidates + c], error[l], n, best[l], least[l]);
    }
    for (uint32_t l = 0; l < block->n; l++)
        set_guides(groom, block->strand[l], best[l] + job->skip);
}

static void instance_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct guides_job *job = user;
    uint32_t begin = piece * RANDOM_BLOCK_PIECE, end = begin + RANDOM_BLOCK_PIECE;
    end = end < job->count ? end : job->count;
    for (uint32_t i = begin; i < end; i += LANES) {
        struct block block = random_block_range(job->search, job->first + i, end - i);
        instance_block(job, &job->search->memory[thread], &block, job->candidate + (size_t)i * job->n_candidates);
    }
}

void random_search_instances(struct random_search *search, uint32_t count, const uint32_t *candidate, uint32_t n_candidates,
                             uint32_t skip, const struct groom_context *context)
{
    struct guides_job job = {search, candidate, 0, count, n_candidates, 0, skip};
    parallel_for(context, (count + RANDOM_BLOCK_PIECE - 1) / RANDOM_BLOCK_PIECE, instance_piece, &job);
}
