/* A look at all that a curl's two numbers may be, for one operator guide. */
#include <math.h>

#include "fit/curl_search.h"

#define MOST_RATES 33          /* frequencies of a curl that are tried */
#define PHASES 6               /* in a turn */
#define LOCAL 5                /* both, around what there is */
#define LOCAL_PASSES 2
#define CLOSER 0.35f           /* from one pass to the next */
#define TURNS_PER_RATE 0.3     /* at a strand's tip from one frequency to the next */

/* Values of (u1, u2) that are tried: u1 = rate_first + i rate_step, u2 = phase_first + k phase_step. */
struct curl_grid {
    float rate_first, rate_step, phase_first, phase_step;
    uint32_t n_rates, n_phases;
};

static float rate_at(const struct curl_grid *grid, uint32_t i)
{
    return fminf(fmaxf(grid->rate_first + (float)i * grid->rate_step, -1), 1);
}

static float phase_at(const struct curl_grid *grid, uint32_t k)
{
    return curl_phase_in_range(grid->phase_first + (float)k * grid->phase_step);
}

/* Scales strands to the lengths of their targets: lengths are all but linear in the number. */
static void match_lengths(const struct curl_search *curl, struct random_search_memory *memory)
{
    const struct random_search *search = curl->search;
    uint32_t scale = curl->groups->scale;
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
    random_block_advance(search, memory, scale, curl->active);
}

static void add_costs(const struct curl_search *curl, struct random_search_memory *memory, const struct block *block,
                      const struct curl_grid *grid, double *cost)
{
    struct kernel_inputs *in = &memory->in[curl->active];
    random_block_load(curl->search, memory, block, curl->active);
    for (uint32_t i = 0; i < grid->n_rates; i++) {
        for (int l = 0; l < LANES; l++)
            in->random[0][l] = rate_at(grid, i);
        if (curl_is_scaled(curl))
            match_lengths(curl, memory);
        for (uint32_t k = 0; k < grid->n_phases; k++) {
            lanes error;
            for (int l = 0; l < LANES; l++)
                in->random[1][l] = phase_at(grid, k);
            random_block_evaluate(curl->search, memory, random_block_before(memory, curl->active), curl->active, error);
            for (uint32_t l = 0; l < block->n; l++)
                cost[i * grid->n_phases + k] += (double)error[l];
        }
    }
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
    u[1] = curl_phase_in_range(u[1] + grid->phase_step * (float)fmin(fmax(along_phase, -1), 1));
}

/* The best of a grid for all strands of an operator guide that are asked. */
static void search_grid(const struct curl_search *curl, struct random_search_memory *memory, uint32_t guide,
                        const struct curl_grid *grid, float u[2])
{
    double cost[MOST_RATES * PHASES] = {0};
    uint32_t best = 0;
    for (uint32_t i = 0; i < curl_asked(curl, guide); i += LANES) {
        struct block block = curl_block(curl, guide, i);
        add_costs(curl, memory, &block, grid, cost);
    }
    for (uint32_t at = 1; at < grid->n_rates * grid->n_phases; at++)
        if (cost[at] < cost[best])
            best = at;
    u[0] = rate_at(grid, best / grid->n_phases);
    u[1] = phase_at(grid, best % grid->n_phases);
    settle(grid, (const double *)cost, best, u);
}

static struct curl_grid whole_range(uint32_t n_rates, float rate_step, float phase_step, float phase)
{
    float turn = floorf(phase / CURL_PERIOD) * CURL_PERIOD; /* of those in the range, the one that was drawn */
    turn = turn + CURL_PERIOD > 1 ? turn - CURL_PERIOD : turn;
    return (struct curl_grid){n_rates > 1 ? -1 : 0, rate_step, turn, phase_step, n_rates, PHASES};
}

static struct curl_grid grid_around(const float u[2], float rate_step, float phase_step)
{
    return (struct curl_grid){u[0] - LOCAL / 2 * rate_step, rate_step, u[1] - LOCAL / 2 * phase_step, phase_step,
                              LOCAL, LOCAL};
}

/* The longest of a guide's strands decides how finely frequencies must be tried. */
static uint32_t rates_of(const struct curl_search *curl, uint32_t guide)
{
    double turns = 2 * (double)curl_operator(curl)->parameter[2] * curl_guide_length(curl, guide);
    double n = 1 + ceil(turns / TURNS_PER_RATE);
    return n < MOST_RATES ? (uint32_t)n : MOST_RATES;
}

void curl_look(const struct curl_search *curl, struct random_search_memory *memory, uint32_t guide, int whole, float u[2])
{
    uint32_t n_rates = rates_of(curl, guide);
    float rate_step = n_rates > 1 ? 2.0f / (float)(n_rates - 1) : 2.0f, phase_step = CURL_PERIOD / PHASES;
    if (whole) {
        struct curl_grid grid = whole_range(n_rates, rate_step, phase_step, u[1]);
        search_grid(curl, memory, guide, &grid, u);
    }
    for (int pass = 0; pass < LOCAL_PASSES; pass++) {
        rate_step *= CLOSER, phase_step *= CLOSER;
        struct curl_grid grid = grid_around(u, rate_step, phase_step);
        search_grid(curl, memory, guide, &grid, u);
    }
}
