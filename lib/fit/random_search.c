#include "fit/random_search.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "fit/random_block.h"
#include "groom/strands.h"

#define MOST_RATES 33          /* frequencies of a curl that are tried */
#define PHASES 6               /* in a turn */
#define MOST_INSTANCES 8       /* guides of a strand */
#define MOST_RANKED (MOST_INSTANCES + RANDOM_SEARCH_SKIP)
#define LOCAL 5                /* both, around what there is */
#define LOCAL_PASSES 2
#define MOST_HALVED 64         /* curls that tell how far halves of their strands are apart: a median of so many is one of all */
#define TURNS_PER_RATE 0.3     /* at a strand's tip from one frequency to the next */
#define PERIOD (1.0f / 3.9f)   /* of u2: a whole turn */

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
};

/* Keeps what is better. */
static void try_values(const struct strands_job *job, struct random_search_memory *memory, const lanes value, lanes best,
                       lanes least)
{
    lanes error;
    memcpy(memory->in[job->active].random[0], value, sizeof(lanes));
    random_block_evaluate(job->search, memory, random_block_before(memory, job->active), job->active, error);
    for (int l = 0; l < LANES; l++)
        if (error[l] < least[l]) {
            least[l] = error[l];
            best[l] = value[l];
        }
}

static void search_block(const struct strands_job *job, struct random_search_memory *memory, const struct block *block)
{
    float range = job->maximum - job->minimum, step = range / (float)job->n_grid;
    lanes value, best, least;
    random_block_load(job->search, memory, block, job->active);
    memcpy(best, memory->in[job->active].random[0], sizeof best);
    for (int l = 0; l < LANES; l++)
        least[l] = INFINITY;
    try_values(job, memory, best, best, least);
    for (uint32_t k = 0; k < job->n_grid; k++) {
        for (int l = 0; l < LANES; l++)
            value[l] = job->minimum + ((float)k + 0.5f) * step;
        try_values(job, memory, value, best, least);
    }
    for (uint32_t h = 0; h < job->n_halvings; h++) {
        lanes centre;
        memcpy(centre, best, sizeof centre);
        step *= 0.5f;
        for (int side = -1; side <= 1; side += 2) {
            for (int l = 0; l < LANES; l++)
                value[l] = fminf(fmaxf(centre[l] + (float)side * step, job->minimum), job->maximum);
            try_values(job, memory, value, best, least);
        }
    }
    for (uint32_t l = 0; l < block->n; l++)
        job->u[block->strand[l]] = best[l];
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

void random_search_strands(struct random_search *search, uint32_t active, uint32_t first, uint32_t count,
                           uint32_t n_grid, uint32_t n_halvings, const struct groom_context *context)
{
    const struct groom_operator *op = operator_of(search, active);
    uint32_t n_randoms;
    const struct groom_operator_random *random = groom_operator_randoms(op->type, &n_randoms);
    struct strands_job job = {search, active, first, count, n_grid, n_halvings, random[0].minimum, random[0].maximum,
                              op->random[0]};
    parallel_for(context, (count + RANDOM_BLOCK_PIECE - 1) / RANDOM_BLOCK_PIECE, search_piece, &job);
}

/* --- two numbers an operator guide --------------------------------------------------------------- */

struct curls_job {
    struct random_search *search;
    const struct random_search_groups *groups;
    uint32_t active, first;
    uint32_t part, n_parts; /* of a guide's strands, every n_parts-th is asked; all: 0 of 1 */
    float (*half)[2];
};

/* Values of (u1, u2) that are tried: u1 = rate_first + i rate_step, u2 = phase_first + k phase_step. */
struct curl_grid {
    float rate_first, rate_step, phase_first, phase_step;
    uint32_t n_rates, n_phases;
};

static float rate_at(const struct curl_grid *grid, uint32_t i)
{
    return fminf(fmaxf(grid->rate_first + (float)i * grid->rate_step, -1), 1);
}

/* Phases are turned back into the range by whole turns. */
static float phase_in_range(float u) { return u < 0 ? u + PERIOD : u > 1 ? u - PERIOD : u; }

static float phase_at(const struct curl_grid *grid, uint32_t k)
{
    return phase_in_range(grid->phase_first + (float)k * grid->phase_step);
}

/* Scales strands to the lengths of their targets: lengths are all but linear in the number. */
static void match_lengths(const struct curls_job *job, struct random_search_memory *memory)
{
    const struct random_search *search = job->search;
    uint32_t scale = job->groups->scale;
    float *u = memory->in[scale].random[0], length[2][LANES];
    for (int side = 0; side < 2; side++) {
        for (int l = 0; l < LANES; l++)
            u[l] = side ? 0.5f : -0.5f;
        random_block_lengths(search, memory, scale, length[side]);
    }
    for (int l = 0; l < LANES; l++) {
        float slope = length[1][l] - length[0][l], missing = memory->target.length[l] - length[0][l];
        u[l] = slope > 0 ? fminf(fmaxf(missing / slope - 0.5f, -1), 1) : 0;
    }
    random_block_advance(search, memory, scale, job->active);
}

static void add_costs(const struct curls_job *job, struct random_search_memory *memory, const struct block *block,
                      const struct curl_grid *grid, double *cost)
{
    struct kernel_inputs *in = &memory->in[job->active];
    random_block_load(job->search, memory, block, job->active);
    for (uint32_t i = 0; i < grid->n_rates; i++) {
        for (int l = 0; l < LANES; l++)
            in->random[0][l] = rate_at(grid, i);
        if (job->groups->whole && job->groups->scale != UINT32_MAX)
            match_lengths(job, memory);
        for (uint32_t k = 0; k < grid->n_phases; k++) {
            lanes error;
            for (int l = 0; l < LANES; l++)
                in->random[1][l] = phase_at(grid, k);
            random_block_evaluate(job->search, memory, random_block_before(memory, job->active), job->active, error);
            for (uint32_t l = 0; l < block->n; l++)
                cost[i * grid->n_phases + k] += (double)error[l];
        }
    }
}

/* How many strands of a guide are asked, */
static uint32_t asked(const struct curls_job *job, uint32_t guide)
{
    uint32_t all = job->groups->begin[guide + 1] - job->groups->begin[guide];
    uint32_t most = all < job->groups->n_strands ? all : job->groups->n_strands;
    return most > job->part ? (most - job->part - 1) / job->n_parts + 1 : 0;
}

/* and which, from the i-th on. */
static struct block asked_block(const struct curls_job *job, uint32_t guide, uint32_t i)
{
    uint32_t begin = job->groups->begin[guide], all = job->groups->begin[guide + 1] - begin, n = asked(job, guide);
    uint32_t most = all < job->groups->n_strands ? all : job->groups->n_strands;
    uint32_t strand[LANES], n_here = n - i < LANES ? n - i : LANES;
    for (uint32_t l = 0; l < n_here; l++)
        strand[l] = job->groups->member[begin + (uint32_t)((uint64_t)((i + l) * job->n_parts + job->part) * all / most)];
    return block_of(strand, n_here);
}

/* Where the paraboloid through the best value of a grid and the eight around it is least. Between two values that are as
 * good rounding would choose, and a phase would be 7 degrees off. */
static void settle(const struct curl_grid *grid, const double *cost, uint32_t best, float u[2])
{
    uint32_t row = grid->n_phases, i = best / row, k = best % row;
    if (i == 0 || i + 1 >= grid->n_rates || k == 0 || k + 1 >= row)
        return;
    const double *c = cost + best, *less = c - row, *more = c + row;
    double rate = 0.5 * (more[0] - less[0]), phase = 0.5 * (c[1] - c[-1]);
    double rates = more[0] - 2 * c[0] + less[0], phases = c[1] - 2 * c[0] + c[-1];
    double both = 0.25 * ((more[1] - more[-1]) - (less[1] - less[-1])), determinant = rates * phases - both * both;
    if (!(rates > 0 && determinant > 0))
        return;
    double along_rate = (both * phase - phases * rate) / determinant, along_phase = (both * rate - rates * phase) / determinant;
    u[0] = fminf(fmaxf(u[0] + grid->rate_step * (float)fmin(fmax(along_rate, -1), 1), -1), 1);
    u[1] = phase_in_range(u[1] + grid->phase_step * (float)fmin(fmax(along_phase, -1), 1));
}

/* The best of a grid for all strands of an operator guide that are asked. */
static void search_grid(const struct curls_job *job, struct random_search_memory *memory, uint32_t guide,
                        const struct curl_grid *grid, float u[2])
{
    double cost[MOST_RATES * PHASES] = {0};
    uint32_t best = 0;
    for (uint32_t i = 0; i < asked(job, guide); i += LANES) {
        struct block block = asked_block(job, guide, i);
        add_costs(job, memory, &block, grid, cost);
    }
    for (uint32_t at = 1; at < grid->n_rates * grid->n_phases; at++)
        if (cost[at] < cost[best])
            best = at;
    u[0] = rate_at(grid, best / grid->n_phases);
    u[1] = phase_at(grid, best % grid->n_phases);
    settle(grid, (const double *)cost, best, u);
}

static struct curl_grid grid_around(const float u[2], float rate_step, float phase_step)
{
    return (struct curl_grid){u[0] - LOCAL / 2 * rate_step, rate_step, u[1] - LOCAL / 2 * phase_step, phase_step,
                              LOCAL, LOCAL};
}

/* The longest of a guide's strands decides how finely frequencies must be tried. */
static uint32_t rates_of(const struct curls_job *job, uint32_t guide)
{
    const struct groom *groom = job->search->plan.groom;
    const struct groom_operator *op = operator_of(job->search, job->active);
    const float (*x)[3] = (const float (*)[3])groom->guides + (size_t)groom->operator_guide[guide] * groom->n_vertices;
    double turns = 2 * (double)op->parameter[2] * groom_polyline_length(x, groom->n_vertices);
    double n = 1 + ceil(turns / TURNS_PER_RATE);
    return n < MOST_RATES ? (uint32_t)n : MOST_RATES;
}

/* --- frequency against scale --------------------------------------------------------------------- */

#define TRADES 13           /* frequencies that are tried */
#define TRADE_STEP 0.02f    /* from one to the next, of the frequency */
#define TRADE_PASSES 2

/* The turns a metre that a number makes. */
static float rate_of(const struct groom_operator *op, float u) { return op->parameter[1] + op->parameter[2] * u; }

/* The number of a strand that is scaled by `ratio` times what it was. */
static float scale_number(const struct groom_operator *op, float u, float ratio)
{
    float eta = op->parameter[0];
    return fminf(fmaxf(((1 + eta * u) * ratio - 1) / eta, -1), 1);
}

static void add_trades(const struct curls_job *job, struct random_search_memory *memory, const struct block *block,
                       const float rate[TRADES], float present, double cost[TRADES])
{
    const struct groom_operator *curl = operator_of(job->search, job->active);
    const struct groom_operator *scale = operator_of(job->search, job->groups->scale);
    lanes own, error;
    random_block_load(job->search, memory, block, job->active);
    memcpy(own, memory->in[job->groups->scale].random[0], sizeof own);
    for (uint32_t t = 0; t < TRADES; t++) {
        for (int l = 0; l < LANES; l++) {
            memory->in[job->active].random[0][l] = rate[t];
            memory->in[job->groups->scale].random[0][l] =
                scale_number(scale, own[l], rate_of(curl, present) / rate_of(curl, rate[t]));
        }
        random_block_advance(job->search, memory, job->groups->scale, job->active);
        random_block_evaluate(job->search, memory, random_block_before(memory, job->active), job->active, error);
        for (uint32_t l = 0; l < block->n; l++)
            cost[t] += (double)error[l];
    }
}

/* Where the parabola through the best of these costs and those beside it is least, in steps from there. */
static float vertex_of(const double cost[TRADES], uint32_t best)
{
    if (best == 0 || best + 1 == TRADES)
        return 0;
    double slope = 0.5 * (cost[best + 1] - cost[best - 1]), bend = cost[best + 1] - 2 * cost[best] + cost[best - 1];
    return bend > 0 ? (float)fmin(fmax(-slope / bend, -1), 1) : 0;
}

/* Another frequency for a guide, and scales of all its strands with it. */
static void trade(const struct curls_job *job, struct random_search_memory *memory, uint32_t guide)
{
    const struct groom_operator *curl = operator_of(job->search, job->active);
    const struct groom_operator *scale = operator_of(job->search, job->groups->scale);
    float present = curl->random[0][guide], chosen = present, step = TRADE_STEP * curl->parameter[1] / curl->parameter[2];
    for (int pass = 0; pass < TRADE_PASSES; pass++, step *= 0.3f) {
        float rate[TRADES];
        double cost[TRADES] = {0};
        uint32_t best = TRADES / 2;
        for (uint32_t t = 0; t < TRADES; t++)
            rate[t] = fminf(fmaxf(chosen + ((float)t - TRADES / 2) * step, -1), 1);
        for (uint32_t i = 0; i < asked(job, guide); i += LANES) {
            struct block block = asked_block(job, guide, i);
            add_trades(job, memory, &block, (const float *)rate, present, cost);
        }
        for (uint32_t t = 0; t < TRADES; t++)
            best = cost[t] < cost[best] ? t : best;
        chosen = fminf(fmaxf(rate[best] + step * vertex_of((const double *)cost, best), -1), 1);
    }
    for (uint32_t at = job->groups->begin[guide]; at < job->groups->begin[guide + 1]; at++) {
        float *u = &scale->random[0][job->groups->member[at]];
        *u = scale_number(scale, *u, rate_of(curl, present) / rate_of(curl, chosen));
    }
    curl->random[0][guide] = chosen;
}

static void curl_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct curls_job *job = user;
    struct random_search_memory *memory = &job->search->memory[thread];
    const struct groom_operator *op = operator_of(job->search, job->active);
    uint32_t guide = job->first + piece, n_rates = rates_of(job, guide);
    if (asked(job, guide) == 0)
        return;
    if (!job->groups->whole && job->groups->scale != UINT32_MAX && op->parameter[2] > 0)
        trade(job, memory, guide);
    float u[2] = {op->random[0][guide], op->random[1][guide]};
    float rate_step = n_rates > 1 ? 2.0f / (float)(n_rates - 1) : 2.0f, phase_step = PERIOD / PHASES;
    if (job->groups->whole) {
        float turn = floorf(u[1] / PERIOD) * PERIOD; /* of those in the range, the one that was drawn */
        turn = turn + PERIOD > 1 ? turn - PERIOD : turn;
        struct curl_grid grid = {n_rates > 1 ? -1 : 0, rate_step, turn, phase_step, n_rates, PHASES};
        search_grid(job, memory, guide, &grid, u);
    }
    for (int pass = 0; pass < LOCAL_PASSES; pass++) {
        rate_step *= 0.35f, phase_step *= 0.35f;
        struct curl_grid grid = grid_around(u, rate_step, phase_step);
        search_grid(job, memory, guide, &grid, u);
    }
    op->random[0][guide] = u[0];
    op->random[1][guide] = u[1];
}

void random_search_curls(struct random_search *search, uint32_t active, uint32_t first, uint32_t count,
                         const struct random_search_groups *groups, const struct groom_context *context)
{
    struct curls_job job = {search, groups, active, first, 0, 1, NULL};
    parallel_for(context, count, curl_piece, &job);
}

/* Curls from one that is halved to the next. */
static uint32_t halved_every(const struct groom *groom) { return (groom->n_operator_guides + MOST_HALVED - 1) / MOST_HALVED; }

static void halves_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct curls_job *job = user;
    const struct groom_operator *op = operator_of(job->search, job->active);
    uint32_t guide = piece * halved_every(job->search->plan.groom), n_rates = rates_of(job, guide);
    for (uint32_t h = 0; h < 2; h++) {
        struct curls_job half = *job;
        float u[2] = {op->random[0][guide], op->random[1][guide]};
        float rate_step = n_rates > 1 ? 2.0f / (float)(n_rates - 1) : 2.0f, phase_step = PERIOD / PHASES;
        half.part = h;
        half.n_parts = 2;
        for (int pass = 0; pass < LOCAL_PASSES; pass++) {
            rate_step *= 0.35f, phase_step *= 0.35f;
            struct curl_grid grid = grid_around(u, rate_step, phase_step);
            search_grid(&half, &job->search->memory[thread], guide, &grid, u);
        }
        job->half[guide][h] = asked(&half, guide) > 0 ? u[0] : NAN;
    }
}

void random_search_halves(struct random_search *search, uint32_t active, const struct random_search_groups *groups,
                          float (*half)[2], const struct groom_context *context)
{
    struct curls_job job = {search, groups, active, 0, 0, 1, half};
    uint32_t n = search->plan.groom->n_operator_guides, every = halved_every(search->plan.groom);
    for (uint32_t o = 0; o < n; o++)
        half[o][0] = half[o][1] = NAN;
    parallel_for(context, (n + every - 1) / every, halves_piece, &job);
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
