/* Newton's steps on what the strands of an operator guide share in a curl.
 *
 * Frequency, phase and the common length of these strands are known together only: along a valley in which strands
 * wind as often, and one in which the middles of their turns stay where they are. One number after the other crosses
 * these valleys ever more slowly; steps on all three go along them. */
#include <math.h>
#include <string.h>

#include "fit/curl_search.h"
#include "fit/dense.h"

enum { TURNS, PHASE, STRETCH, ALL }; /* turns over the guide's length, with the phase kept at PIVOT; turns all along; log of length */
#define POINTS (1 + 2 * ALL + ALL * (ALL - 1) / 2)

#define PIVOT 0.6          /* of the length: past the middle, as curls set in late and grow */
#define MOST_STEPS 5
#define HALVINGS 3
#define MOST_DAMPINGS 6
#define LEAST_TURNS 1e-3   /* turns from one end to the other: less is no curl to step in */

static const double width[ALL] = {0.05, 0.03, 0.01};  /* of a difference */
static const double most[ALL] = {0.3, 0.15, 0.05};    /* of a step */
static const double least[ALL] = {2e-3, 1e-3, 5e-4};  /* that is worth another */

struct point { double at[ALL]; };

/* Where points are off. */
struct origin { float u[2]; double frequency, turns; };

struct stepping {
    const struct curl_search *curl;
    struct random_search_memory *memory;
    uint32_t guide, n; /* coordinates that are moved */
    struct origin from;
};

static struct origin origin_of(const struct curl_search *curl, uint32_t guide, const float u[2])
{
    const struct groom_operator *op = curl_operator(curl);
    double frequency = op->parameter[1] + (double)op->parameter[2] * u[0];
    return (struct origin){{u[0], u[1]}, frequency, frequency * curl_guide_length(curl, guide)};
}

/* The numbers at a point; in their range. */
static void numbers_at(const struct stepping *job, const struct point *p, float u[2])
{
    const struct groom_operator *op = curl_operator(job->curl);
    double more = (1 + p->at[TURNS] / job->from.turns) * exp(-p->at[STRETCH]);
    double number = job->from.u[0] + job->from.frequency * (more - 1) / op->parameter[2];
    u[0] = (float)fmin(fmax(number, -1), 1);
    u[1] = curl_phase_in_range(job->from.u[1] + CURL_PERIOD * (float)(p->at[PHASE] - PIVOT * p->at[TURNS]));
}

/* --- errors ------------------------------------------------------------------------------- */

/* Strands of the block, longer by this than they are in the groom. */
static void stretch_block(const struct stepping *job, const lanes own, double stretch)
{
    const struct random_search *search = job->curl->search;
    uint32_t scale = job->curl->groups->scale;
    float eta = search->plan.groom->operators[search->plan.active[scale]].parameter[0], ratio = (float)exp(stretch);
    for (int l = 0; l < LANES; l++)
        job->memory->in[scale].random[0][l] = ((1 + eta * own[l]) * ratio - 1) / eta;
    random_block_advance(search, job->memory, scale, job->curl->active);
}

static void add_errors(const struct stepping *job, const struct block *block, const struct point *p, uint32_t n, double *cost)
{
    struct random_search_memory *memory = job->memory;
    uint32_t active = job->curl->active;
    double stretched = 0;
    lanes own;
    random_block_load(job->curl->search, memory, block, active);
    if (job->n > STRETCH)
        memcpy(own, memory->in[job->curl->groups->scale].random[0], sizeof own);
    for (uint32_t k = 0; k < n; k++) {
        float u[2];
        lanes error;
        numbers_at(job, &p[k], u);
        for (int l = 0; l < LANES; l++) {
            memory->in[active].random[0][l] = u[0];
            memory->in[active].random[1][l] = u[1];
        }
        if (p[k].at[STRETCH] != stretched)
            stretch_block(job, own, stretched = p[k].at[STRETCH]);
        random_block_evaluate(job->curl->search, memory, random_block_before(memory, active), active, error);
        for (uint32_t l = 0; l < block->n; l++)
            cost[k] += (double)error[l];
    }
}

static void errors_at(const struct stepping *job, const struct point *p, uint32_t n, double *cost)
{
    memset(cost, 0, n * sizeof *cost);
    for (uint32_t i = 0; i < curl_asked(job->curl, job->guide); i += LANES) {
        struct block block = curl_block(job->curl, job->guide, i);
        add_errors(job, &block, p, n, cost);
    }
}

/* --- steps ------------------------------------------------------------------------------------ */

/* The point, and those that its differences are taken from: both ways along each coordinate, and along two at once. */
static uint32_t list_points(const struct point *p, uint32_t n, struct point *out)
{
    uint32_t count = 0;
    out[count++] = *p;
    for (uint32_t i = 0; i < n; i++)
        for (int way = -1; way <= 1; way += 2) {
            out[count] = *p;
            out[count++].at[i] += way * width[i];
        }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < i; j++) {
            out[count] = *p;
            out[count].at[i] += width[i];
            out[count++].at[j] += width[j];
        }
    return count;
}

/* Gradient and Hessian in units of the widths. */
static void differentiate(const double *cost, uint32_t n, double *gradient, double *hessian)
{
    const double *both = cost + 1 + 2 * n;
    for (uint32_t i = 0; i < n; i++) {
        double less = cost[1 + 2 * i], more = cost[2 + 2 * i];
        gradient[i] = 0.5 * (more - less);
        hessian[i * n + i] = more - 2 * cost[0] + less;
    }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < i; j++)
            hessian[i * n + j] = hessian[j * n + i] = *both++ - cost[2 + 2 * i] - cost[2 + 2 * j] + cost[0];
}

/* (H + damping) step = -g, with as much damping as makes it positive definite; 0: it never is. */
static int solve(const double *gradient, const double *hessian, uint32_t n, double *step)
{
    double damping = 0, a[ALL * ALL];
    for (int tries = 0; tries < MOST_DAMPINGS; tries++, damping = 4 * damping + 0.05) {
        memcpy(a, hessian, n * n * sizeof *a);
        for (uint32_t i = 0; i < n; i++) {
            a[i * n + i] += damping * fabs(hessian[i * n + i]);
            step[i] = -gradient[i];
        }
        if (dense_cholesky(a, n)) {
            dense_forward(a, n, step);
            dense_backward(a, n, step);
            return 1;
        }
    }
    return 0;
}

/* As a whole as short as no coordinate moves by more than it may. */
static void confine(uint32_t n, double *step)
{
    double over = 1;
    for (uint32_t i = 0; i < n; i++) {
        step[i] *= width[i];
        over = fmax(over, fabs(step[i]) / most[i]);
    }
    for (uint32_t i = 0; i < n; i++)
        step[i] /= over;
}

/* From p on to where the error is less; 0: there is no such place along the step. */
static int advance(const struct stepping *job, struct point *p, double *step, double present)
{
    for (int h = 0; h < HALVINGS; h++) {
        struct point next = *p;
        double cost;
        for (uint32_t i = 0; i < job->n; i++)
            next.at[i] += step[i];
        errors_at(job, &next, 1, &cost);
        if (cost < present) {
            *p = next;
            return 1;
        }
        for (uint32_t i = 0; i < job->n; i++)
            step[i] *= 0.5;
    }
    return 0;
}

static int is_worth_another(const double *step, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if (fabs(step[i]) > least[i])
            return 1;
    return 0;
}

void curl_steps(const struct curl_search *curl, struct random_search_memory *memory, uint32_t guide, float u[2], float *stretch)
{
    struct stepping job = {curl, memory, guide, stretch && curl_is_scaled(curl) ? ALL : STRETCH, origin_of(curl, guide, u)};
    struct point p = {{0}}, around[POINTS];
    if (stretch)
        *stretch = 0;
    if (!(job.from.turns > LEAST_TURNS) || !(curl_operator(curl)->parameter[2] > 0))
        return;
    for (int k = 0; k < MOST_STEPS; k++) {
        double cost[POINTS], gradient[ALL], hessian[ALL * ALL], step[ALL];
        errors_at(&job, around, list_points(&p, job.n, around), cost);
        differentiate(cost, job.n, gradient, hessian);
        if (!solve(gradient, hessian, job.n, step))
            break;
        confine(job.n, step);
        if (!advance(&job, &p, step, cost[0]) || !is_worth_another(step, job.n))
            break;
    }
    numbers_at(&job, &p, u);
    if (stretch)
        *stretch = (float)p.at[STRETCH];
}
