/* descent.c for one strand that pulls on no other: the fine scale. All of it stays in the cache. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "retarget/descent.h"

#define LAST_SHARE 1e-3 /* a step that lowers the energy by less than this share of what all did is the last */

int descent_strand_init(struct descent *s, struct coupled *strand, struct job *job, uint32_t longest)
{
    const struct groom_allocator *allocator = job->allocator;
    *s = (struct descent){.job = job, .hair = strand, .links = {.hair = strand}};
    int ready = descent_allocate(s, longest, 1);
    s->segments = memory_array(allocator, longest, sizeof *s->segments);
    s->links.diagonal = memory_array(allocator, longest, sizeof *s->links.diagonal);
    strand->p = memory_array(allocator, longest, sizeof *strand->p);
    strand->rest = memory_array(allocator, longest, sizeof *strand->rest);
    strand->hat = (const float(*)[3])strand->p;
    return ready && s->segments && s->links.diagonal && strand->p && strand->rest;
}

void descent_strand_finish(struct descent *s, struct coupled *strand, uint32_t longest)
{
    if (!s->job)
        return;
    const struct groom_allocator *allocator = s->job->allocator;
    memory_release(allocator, s->segments, longest, sizeof *s->segments);
    memory_release(allocator, s->links.diagonal, longest, sizeof *s->links.diagonal);
    memory_release(allocator, strand->p, longest, sizeof *strand->p);
    memory_release(allocator, (void *)strand->rest, longest, sizeof *strand->rest);
    descent_release(s, longest, 1);
}

static double curve(struct descent *s, uint32_t n)
{
    double sum = 0;
    for (uint32_t i = 1; i < n; i++) {
        quad d = point_load(s->d[i]), kd = quad_of(s->links.diagonal[i]) * d;
        point_store(s->kd[i], kd);
        sum += point_dot(kd, d) + descent_bend(s, i - 1);
    }
    return sum;
}

static void tell_q(struct descent *s, uint32_t n)
{
    for (uint32_t i = 1; i < n; i++)
        if (s->put_back[i])
            point_store(s->q[i], point_load(s->q[i]) - quad_of(s->links.diagonal[i]) * point_load(s->kd[i]));
}

static double turn_downhill(struct descent *s, uint32_t n)
{
    struct descent_sums sums = {0};
    descent_turn_strand(s, 0, n, 0, &sums);
    if (sums.product > 0 || s->turn == 0)
        return sums.product;
    s->turn = 0;
    sums.product = 0;
    descent_turn_strand(s, 0, n, 0, &sums);
    return sums.product;
}

uint32_t descent_strand_solve(struct descent *s, uint32_t n)
{
    const struct groom_retarget_options *options = s->job->options;
    struct descent_sums sums = {0};
    memset(s->r, 0, n * sizeof *s->r);
    memset(s->d, 0, n * sizeof *s->d);
    s->turn = 0;
    descent_rest_strand(s, 0, n);
    if (descent_place_strand(s, 0, n) > 0)
        tell_q(s, n);
    descent_force_strand(s, 0, n, 0, &sums);
    double fell = 0;
    for (uint32_t i = 0; i < options->iterations; i++) {
        double downhill = turn_downhill(s, n), curvature = curve(s, n), last = sums.product;
        s->along = downhill > 0 && curvature > 0 ? (float)(downhill / curvature) : 0;
        sums = (struct descent_sums){0};
        descent_move_strand(s, 0, n, 0, &sums);
        if (sums.n_put_back > 0)
            tell_q(s, n);
        fell += s->along * downhill;
        if (sums.movement < options->tolerance * n || s->along * downhill < LAST_SHARE * fell)
            return i + 1;
        sums.product = sums.change = 0;
        descent_force_strand(s, 0, n, 0, &sums);
        s->turn = last > 0 ? (float)fmin(fmax(0, sums.change / last), DESCENT_MOST_TURN) : 0;
    }
    return options->iterations;
}
