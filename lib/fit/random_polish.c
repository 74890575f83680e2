/* Newton's steps on all that a strand has of its own: differences of errors, lane by lane. */
#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "fit/dense.h"
#include "fit/random_block.h"
#include "fit/random_search.h"

#define MOST RANDOM_BLOCK_MOVED      /* numbers of a strand that are moved at once */
#define WEIGHT_STEP 0.05f  /* of a difference, in an instancing weight */
#define SCALE_STEP 0.1f    /* in random numbers: over less, rounding tells more of how an error bends than the strand does */
#define BEND_STEP 0.05f
#define FRIZZ_STEP 0.004f  /* noise is rugged */
#define FARTHEST_STEP 4.0  /* times those: differences tell nothing of what is farther, and rounding decides where steps go */
#define FLAT 1e-4          /* of an error that differs by no more over a step nothing is known: numbers stay where they are */

struct polish_job {
    struct random_search *search;
    uint32_t first, count, n_steps;
    float hold;
    int weights;
};

/* Coordinate i of a block: a random number of an active operator, or the weight that guide `weight` takes
 * from the heaviest one. */
struct coordinate { int is_weight; uint32_t active, weight; float step, minimum, maximum; };

struct polish {
    const struct polish_job *job;
    struct random_search_memory *memory;
    struct coordinate at[MOST];
    uint32_t n, n_weights;
    lanes value[MOST], error;
};

static float step_of(groom_operator_type type)
{
    return type == GROOM_OPERATOR_SCALE ? SCALE_STEP : type == GROOM_OPERATOR_BEND ? BEND_STEP : FRIZZ_STEP;
}

static int shows(const struct groom_operator *op)
{
    return op->type == GROOM_OPERATOR_FRIZZ ? op->parameter[1] != 0
                                            : op->parameter[0] != 0 && (op->type == GROOM_OPERATOR_SCALE || op->type == GROOM_OPERATOR_BEND);
}

static void list_coordinates(struct polish *polish)
{
    const struct plan *plan = &polish->job->search->plan;
    for (uint32_t a = 0; a < plan->n_active && polish->n < MOST; a++) {
        const struct groom_operator *op = &plan->groom->operators[plan->active[a]];
        uint32_t n_randoms;
        const struct groom_operator_random *random = groom_operator_randoms(op->type, &n_randoms);
        if (shows(op))
            polish->at[polish->n++] = (struct coordinate){0, a, 0, step_of(op->type), random[0].minimum, random[0].maximum};
    }
    uint32_t most = polish->job->weights ? RANDOM_BLOCK_WEIGHTS : 0;
    for (uint32_t w = 0; w + 1 < plan->groom->n_instancing && w < most && polish->n < MOST; w++, polish->n_weights++)
        polish->at[polish->n++] = (struct coordinate){1, 0, w, WEIGHT_STEP, -1, 1};
}

/* The error with the coordinates at these values; weights that leave the simplex cost as if they had not. */
static void error_at(struct polish *polish, lanes value[MOST], lanes error)
{
    const struct random_search *search = polish->job->search;
    struct random_search_memory *memory = polish->memory;
    struct bundle start = random_block_start(memory);
    for (uint32_t i = 0; i < polish->n; i++)
        if (!polish->at[i].is_weight)
            memcpy(memory->in[polish->at[i].active].random[0], value[i], sizeof(lanes));
    if (polish->n_weights)
        start = random_block_blend(search, memory, polish->n_weights, value + (polish->n - polish->n_weights));
    random_block_evaluate(search, memory, start, 0, error);
    for (uint32_t i = polish->n - polish->n_weights; i < polish->n; i++)
        for (int l = 0; l < LANES; l++)
            error[l] += polish->job->hold * value[i][l] * value[i][l];
}

/* Differences: gradient and Hessian of each lane. */
static void differentiate(struct polish *polish, lanes gradient[MOST], lanes hessian[MOST][MOST])
{
    lanes value[MOST], up[MOST], error;
    memcpy(value, polish->value, sizeof value);
    for (uint32_t i = 0; i < polish->n; i++) {
        float h = polish->at[i].step;
        for (int l = 0; l < LANES; l++)
            value[i][l] = polish->value[i][l] + h;
        error_at(polish, value, up[i]);
        for (int l = 0; l < LANES; l++)
            value[i][l] = polish->value[i][l] - h;
        error_at(polish, value, error);
        for (int l = 0; l < LANES; l++) {
            gradient[i][l] = (up[i][l] - error[l]) / (2 * h);
            hessian[i][i][l] = (up[i][l] - 2 * polish->error[l] + error[l]) / (h * h);
        }
        memcpy(value[i], polish->value[i], sizeof value[i]);
    }
    for (uint32_t i = 0; i < polish->n; i++)
        for (uint32_t j = 0; j < i; j++) {
            float h = polish->at[i].step, k = polish->at[j].step;
            for (int l = 0; l < LANES; l++) {
                value[i][l] = polish->value[i][l] + h;
                value[j][l] = polish->value[j][l] + k;
            }
            error_at(polish, value, error);
            for (int l = 0; l < LANES; l++)
                hessian[i][j][l] = (error[l] - up[i][l] - up[j][l] + polish->error[l]) / (h * k);
            memcpy(value[i], polish->value[i], sizeof value[i]);
            memcpy(value[j], polish->value[j], sizeof value[j]);
        }
}

/* As a whole as short as no number moves farther than it may; weights have a range of their own. */
static void shorten(const struct polish *polish, double step[MOST])
{
    double over = 1;
    for (uint32_t i = 0; i < polish->n; i++)
        if (!polish->at[i].is_weight)
            over = fmax(over, fabs(step[i]) / (FARTHEST_STEP * (double)polish->at[i].step));
    for (uint32_t i = 0; i < polish->n; i++)
        step[i] /= over;
}

/* (H + damping) step = -g of one lane, with as much damping as makes it positive definite. */
static void solve_lane(const struct polish *polish, lanes gradient[MOST], lanes hessian[MOST][MOST], int l,
                       double damping, double step[MOST])
{
    double a[MOST * MOST];
    uint32_t n = polish->n;
    for (int tries = 0; tries < 6; tries++, damping = 10 * damping + 0.1) {
        for (uint32_t i = 0; i < n; i++) {
            double h = polish->at[i].step;
            for (uint32_t j = 0; j <= i; j++)
                a[i * n + j] = (double)hessian[i][j][l];
            a[i * n + i] += damping * fabs(a[i * n + i]) + FLAT / (h * h);
            step[i] = -(double)gradient[i][l];
        }
        if (dense_cholesky(a, n)) {
            dense_forward(a, n, step);
            dense_backward(a, n, step);
            shorten(polish, step);
            return;
        }
    }
    memset(step, 0, MOST * sizeof *step);
}

/* Numbers into their ranges; weights back among those that are at least 0 and sum to 1. */
static void confine(const struct polish *polish, lanes value[MOST])
{
    for (uint32_t i = 0; i + polish->n_weights < polish->n; i++)
        for (int l = 0; l < LANES; l++)
            value[i][l] = fminf(fmaxf(value[i][l], polish->at[i].minimum), polish->at[i].maximum);
    if (polish->n_weights)
        random_block_confine(polish->memory, polish->n_weights, value + (polish->n - polish->n_weights));
}

static void take_steps(struct polish *polish)
{
    static const double dampings[] = {1e-3, 0.5, 20};
    lanes gradient[MOST], hessian[MOST][MOST], value[MOST], best[MOST], error, least;
    differentiate(polish, gradient, hessian);
    memcpy(best, polish->value, sizeof best);
    memcpy(least, polish->error, sizeof least);
    for (int d = 0; d < 3; d++) {
        memset(value, 0, sizeof value);
        for (int l = 0; l < LANES; l++) {
            double step[MOST];
            solve_lane(polish, gradient, hessian, l, dampings[d], step);
            for (uint32_t i = 0; i < polish->n; i++)
                value[i][l] = polish->value[i][l] + (float)step[i];
        }
        confine(polish, value);
        error_at(polish, value, error);
        for (int l = 0; l < LANES; l++)
            if (error[l] < least[l]) {
                least[l] = error[l];
                for (uint32_t i = 0; i < polish->n; i++)
                    best[i][l] = value[i][l];
            }
    }
    memcpy(polish->value, best, sizeof best);
    memcpy(polish->error, least, sizeof least);
}

static void store(struct polish *polish, const struct block *block)
{
    const struct plan *plan = &polish->job->search->plan;
    for (uint32_t i = 0; i + polish->n_weights < polish->n; i++)
        for (uint32_t l = 0; l < block->n; l++)
            plan->groom->operators[plan->active[polish->at[i].active]].random[0][block->strand[l]] = polish->value[i][l];
    if (polish->n_weights)
        random_block_store_weights(polish->job->search, polish->memory, block, polish->n_weights,
                                   polish->value + (polish->n - polish->n_weights));
}

static void polish_block(const struct polish_job *job, struct random_search_memory *memory, const struct block *block)
{
    struct polish polish = {.job = job, .memory = memory};
    random_block_load(job->search, memory, block, 0);
    list_coordinates(&polish);
    if (polish.n_weights)
        random_block_load_weights(job->search, memory, block, polish.n_weights);
    for (uint32_t i = 0; i + polish.n_weights < polish.n; i++)
        memcpy(polish.value[i], memory->in[polish.at[i].active].random[0], sizeof(lanes));
    error_at(&polish, polish.value, polish.error);
    for (uint32_t step = 0; step < job->n_steps; step++)
        take_steps(&polish);
    store(&polish, block);
}

static void polish_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct polish_job *job = user;
    uint32_t begin = piece * RANDOM_BLOCK_PIECE, end = begin + RANDOM_BLOCK_PIECE;
    end = end < job->count ? end : job->count;
    for (uint32_t i = begin; i < end; i += LANES) {
        struct block block = random_block_range(job->search, job->first + i, end - i);
        polish_block(job, &job->search->memory[thread], &block);
    }
}

void random_search_polish(struct random_search *search, uint32_t first, uint32_t count, uint32_t n_steps, float hold,
                          int weights, const struct groom_context *context)
{
    struct polish_job job = {search, first, count, n_steps, hold, weights};
    parallel_for(context, (count + RANDOM_BLOCK_PIECE - 1) / RANDOM_BLOCK_PIECE, polish_piece, &job);
}
