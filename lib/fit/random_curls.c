/* The numbers of curls, operator guide by operator guide. */
#include <math.h>

#include "base/parallel.h"
#include "fit/curl_search.h"
#include "groom/strands.h"

#define MOST_HALVED 64 /* curls that tell how far halves of their strands are apart: a median of so many is one of all */

/* --- what looks and steps share ------------------------------------------------------------------ */

static struct groom_operator *operator_of(const struct random_search *search, uint32_t active)
{
    return &search->fit->groom->operators[search->plan.active[active]];
}

const struct groom_operator *curl_operator(const struct curl_search *curl) { return operator_of(curl->search, curl->active); }

int curl_is_scaled(const struct curl_search *curl) { return curl->groups->scale != UINT32_MAX; }

double curl_guide_length(const struct curl_search *curl, uint32_t guide)
{
    const struct groom *groom = curl->search->plan.groom;
    const float (*x)[3] = (const float (*)[3])groom->guides + (size_t)groom->operator_guide[guide] * groom->n_vertices;
    return groom_polyline_length(x, groom->n_vertices);
}

/* Of which every n_parts-th is asked. */
static uint32_t most_asked(const struct curl_search *curl, uint32_t guide)
{
    uint32_t all = curl->groups->begin[guide + 1] - curl->groups->begin[guide];
    return all < curl->groups->n_strands ? all : curl->groups->n_strands;
}

uint32_t curl_asked(const struct curl_search *curl, uint32_t guide)
{
    uint32_t most = most_asked(curl, guide);
    return most > curl->part ? (most - curl->part - 1) / curl->n_parts + 1 : 0;
}

struct block curl_block(const struct curl_search *curl, uint32_t guide, uint32_t i)
{
    uint32_t begin = curl->groups->begin[guide], all = curl->groups->begin[guide + 1] - begin;
    uint32_t n = curl_asked(curl, guide), most = most_asked(curl, guide);
    uint32_t strand[LANES], n_here = n - i < LANES ? n - i : LANES;
    for (uint32_t l = 0; l < n_here; l++)
        strand[l] = curl->groups->member[begin + (uint32_t)((uint64_t)((i + l) * curl->n_parts + curl->part) * all / most)];
    return block_of(strand, n_here);
}

float curl_phase_in_range(float u)
{
    u += u < 0 ? ceilf(-u / CURL_PERIOD) * CURL_PERIOD : 0;
    u -= u > 1 ? ceilf((u - 1) / CURL_PERIOD) * CURL_PERIOD : 0;
    return fminf(fmaxf(u, 0), 1);
}

/* --- all that are wanted --------------------------------------------------------------------------- */

struct curls_job {
    struct random_search *search;
    const struct random_search_groups *groups;
    uint32_t active, first;
    float (*half)[2];
};

/* All strands of a guide are longer by this: their numbers in the scale. */
static void stretch_strands(const struct curl_search *curl, uint32_t guide, float stretch)
{
    struct groom_operator *scale = operator_of(curl->search, curl->groups->scale);
    float eta = scale->parameter[0], ratio = expf(stretch);
    for (uint32_t at = curl->groups->begin[guide]; at < curl->groups->begin[guide + 1]; at++) {
        float *u = &scale->random[0][curl->groups->member[at]];
        *u = fminf(fmaxf(((1 + eta * *u) * ratio - 1) / eta, -1), 1);
    }
}

static void curl_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct curls_job *job = user;
    const struct curl_search curl = {job->search, job->groups, job->active, 0, 1};
    struct random_search_memory *memory = &job->search->memory[thread];
    struct groom_operator *op = operator_of(job->search, job->active);
    uint32_t guide = job->first + piece;
    float u[2] = {op->random[0][guide], op->random[1][guide]}, stretch = 0;
    if (curl_asked(&curl, guide) == 0)
        return;
    if (job->groups->whole)
        curl_look(&curl, memory, guide, 1, u);
    else
        curl_steps(&curl, memory, guide, u, &stretch);
    if (stretch != 0)
        stretch_strands(&curl, guide, stretch);
    op->random[0][guide] = u[0];
    op->random[1][guide] = u[1];
}

void random_search_curls(struct random_search *search, uint32_t active, uint32_t first, uint32_t count,
                         const struct random_search_groups *groups, const struct groom_context *context)
{
    struct curls_job job = {search, groups, active, first, NULL};
    parallel_for(context, count, curl_piece, &job);
}

/* --- halves -------------------------------------------------------------------------------------------- */

/* Curls from one that is halved to the next. */
static uint32_t halved_every(const struct groom *groom) { return (groom->n_operator_guides + MOST_HALVED - 1) / MOST_HALVED; }

static void halves_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct curls_job *job = user;
    const struct groom_operator *op = operator_of(job->search, job->active);
    struct random_search_memory *memory = &job->search->memory[thread];
    uint32_t guide = piece * halved_every(job->search->plan.groom);
    for (uint32_t h = 0; h < 2; h++) {
        const struct curl_search half = {job->search, job->groups, job->active, h, 2};
        float u[2] = {op->random[0][guide], op->random[1][guide]};
        if (curl_asked(&half, guide) == 0)
            continue;
        if (job->groups->whole)
            curl_look(&half, memory, guide, 0, u);
        else
            curl_steps(&half, memory, guide, u, NULL);
        job->half[guide][h] = u[0];
    }
}

void random_search_halves(struct random_search *search, uint32_t active, const struct random_search_groups *groups,
                          float (*half)[2], const struct groom_context *context)
{
    struct curls_job job = {search, groups, active, 0, half};
    uint32_t n = search->plan.groom->n_operator_guides, every = halved_every(search->plan.groom);
    for (uint32_t o = 0; o < n; o++)
        half[o][0] = half[o][1] = NAN;
    parallel_for(context, (n + every - 1) / every, halves_piece, &job);
}
