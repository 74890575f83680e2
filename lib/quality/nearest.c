#include "quality/nearest.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/radix.h"

#define PLACES_PER_PIECE 1024u
#define DEGREE (3.14159265358979323846 / 180)

const double quality_tolerances[GROOM_QUALITY_TOLERANCES][2] = {
    {0.001, 10 * DEGREE}, {0.002, 20 * DEGREE}, {0.003, 30 * DEGREE}};

struct counts { uint32_t any[GROOM_QUALITY_TOLERANCES], strict[GROOM_QUALITY_TOLERANCES]; };

struct asking {
    const struct quality_set *from;
    const struct segment_grid *to;
    uint32_t n_places;
    float tolerance[GROOM_QUALITY_TOLERANCES], cosine[GROOM_QUALITY_TOLERANCES];
    float *distance;       /* [n_places] */
    struct counts *counts; /* [pieces] */
};

/* Hair of 3 cm in all is none, or its unit is wrong: everything would be near everything, and take hours. */
#define LEAST_WIDTH 0.03

static void ask(const struct asking *job, const struct quality_place *place, float *distance, struct counts *counts)
{
    int found[GROOM_QUALITY_TOLERANCES] = {0};
    float squared, cosine;
    segment_grid_nearest(job->to, place, &squared, &cosine);
    *distance = sqrtf(squared);
    int all = *distance <= job->tolerance[0] && cosine >= job->cosine[0];
    if (!all && *distance <= job->tolerance[GROOM_QUALITY_TOLERANCES - 1] && job->to->widest >= LEAST_WIDTH)
        segment_grid_matches(job->to, place, job->tolerance, job->cosine, GROOM_QUALITY_TOLERANCES, found);
    for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++) {
        int strict = *distance <= job->tolerance[k] && cosine >= job->cosine[k];
        counts->any[k] += strict || found[k];
        counts->strict[k] += (uint32_t)strict;
    }
}

static void ask_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct asking *job = user;
    uint32_t first = piece * PLACES_PER_PIECE;
    double step = quality_set_length(job->from) / job->n_places;
    (void)thread;
    for (uint32_t k = first; k < job->n_places && k < first + PLACES_PER_PIECE; k++) {
        struct quality_place place;
        quality_set_place(job->from, (k + 0.5) * step, &place);
        ask(job, &place, &job->distance[k], &job->counts[piece]);
    }
}

static void summarize(const struct asking *job, uint32_t n_pieces, float *spare, struct nearest_result *result)
{
    struct counts all = {0};
    double sum = 0;
    uint32_t n = job->n_places;
    for (uint32_t p = 0; p < n_pieces; p++)
        for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++) {
            all.any[k] += job->counts[p].any[k];
            all.strict[k] += job->counts[p].strict[k];
        }
    for (uint32_t k = 0; k < n; k++)
        sum += job->distance[k];
    radix_sort_floats(job->distance, spare, n);
    result->nearest.mean = sum / n;
    result->nearest.p95 = job->distance[(uint32_t)(0.95 * (n - 1) + 0.5)];
    for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++) {
        result->any[k] = (double)all.any[k] / n;
        result->strict[k] = (double)all.strict[k] / n;
    }
}

groom_status quality_nearest(const struct quality_set *from, const struct segment_grid *to, uint32_t n_places,
                             const struct groom_context *context, struct nearest_result *result, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_pieces = n_places / PLACES_PER_PIECE + (n_places % PLACES_PER_PIECE != 0);
    struct asking job = {.from = from, .to = to, .n_places = n_places};
    float *spare = memory_array(allocator, n_places, sizeof *spare);
    job.distance = memory_array(allocator, n_places, sizeof *job.distance);
    job.counts = memory_array_zero(allocator, n_pieces, sizeof *job.counts);
    groom_status st = spare && job.distance && job.counts ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to look at %u places", n_places);
    for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++) {
        job.tolerance[k] = (float)quality_tolerances[k][0];
        job.cosine[k] = (float)cos(quality_tolerances[k][1]);
    }
    if (st == GROOM_OK) {
        parallel_for(context, n_pieces, ask_piece, &job);
        summarize(&job, n_pieces, spare, result);
    }
    memory_release(allocator, spare, n_places, sizeof *spare);
    memory_release(allocator, job.distance, n_places, sizeof *job.distance);
    memory_release(allocator, job.counts, n_pieces, sizeof *job.counts);
    return st;
}
