#include "retarget/descent.h"

#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"

#define QUIET 2 /* steps in a row that move less than the tolerance end it */

static int scratch_init(struct descent_scratch *scratch, uint32_t longest, const struct groom_allocator *allocator)
{
    int ready = strand_init(&scratch->sliding, longest, allocator);
    scratch->w = memory_array(allocator, longest, sizeof *scratch->w);
    scratch->pivot = memory_array(allocator, longest, sizeof *scratch->pivot);
    return ready && scratch->w && scratch->pivot;
}

static void scratch_finish(struct descent_scratch *scratch, uint32_t longest, const struct groom_allocator *allocator)
{
    strand_finish(&scratch->sliding, longest, allocator);
    memory_release(allocator, scratch->w, longest, sizeof *scratch->w);
    memory_release(allocator, scratch->pivot, longest, sizeof *scratch->pivot);
}

int descent_allocate(struct descent *s, uint32_t n, uint32_t n_threads)
{
    const struct groom_allocator *allocator = s->job->allocator;
    s->q = memory_array(allocator, n, sizeof *s->q);
    s->r = memory_array(allocator, n, sizeof *s->r);
    s->z = memory_array_zero(allocator, n, sizeof *s->z);
    s->d = memory_array(allocator, n, sizeof *s->d);
    s->kd = memory_array(allocator, n, sizeof *s->kd);
    s->away = memory_array(allocator, n, sizeof *s->away);
    s->contact = memory_array(allocator, n, 1);
    s->put_back = memory_array(allocator, n, 1);
    s->plane = memory_array(allocator, n, sizeof *s->plane);
    s->sums = memory_array(allocator, s->n_pieces, sizeof *s->sums);
    s->scratch = memory_array_zero(allocator, n_threads, sizeof *s->scratch);
    int ready = s->q && s->r && s->z && s->d && s->kd && s->away && s->contact && s->put_back && s->plane && s->sums && s->scratch;
    for (uint32_t i = 0; ready && i < n_threads; i++)
        ready = scratch_init(&s->scratch[i], s->job->source->longest, allocator);
    return ready;
}

void descent_release(struct descent *s, uint32_t n, uint32_t n_threads)
{
    const struct groom_allocator *allocator = s->job->allocator;
    memory_release(allocator, s->q, n, sizeof *s->q);
    memory_release(allocator, s->r, n, sizeof *s->r);
    memory_release(allocator, s->z, n, sizeof *s->z);
    memory_release(allocator, s->d, n, sizeof *s->d);
    memory_release(allocator, s->kd, n, sizeof *s->kd);
    memory_release(allocator, s->away, n, sizeof *s->away);
    memory_release(allocator, s->contact, n, 1);
    memory_release(allocator, s->put_back, n, 1);
    memory_release(allocator, s->plane, n, sizeof *s->plane);
    memory_release(allocator, s->sums, s->n_pieces, sizeof *s->sums);
    for (uint32_t i = 0; s->scratch && i < n_threads; i++)
        scratch_finish(&s->scratch[i], s->job->source->longest, allocator);
    memory_release(allocator, s->scratch, n_threads, sizeof *s->scratch);
}

/* The next direction: one that does not lead down is given up for the preconditioner's own. */
static double turn_downhill(struct descent *s)
{
    descent_turn(s);
    double downhill = descent_total(s).product;
    if (downhill > 0 || s->turn == 0)
        return downhill;
    s->turn = 0;
    descent_turn(s);
    return descent_total(s).product;
}

/* One step. rz: of the last one, and then of this. quadratic: that part of the energy. */
static struct groom_retarget_step step_on(struct descent *s, double *rz, double *quadratic)
{
    const struct groom_retarget_options *options = s->job->options;
    struct groom_retarget_step step;
    struct descent_sums moved, after;
    double downhill = turn_downhill(s);
    descent_curve(s);
    double curvature = descent_total(s).product;
    s->along = downhill > 0 && curvature > 0 ? (float)(downhill / curvature) : 0;
    descent_move(s);
    moved = descent_total(s);
    descent_force(s);
    after = descent_total(s);
    *quadratic -= moved.linear;
    s->turn = s->along > 0 && *rz > 0 ? (float)fmin(fmax(0, after.change / *rz), DESCENT_MOST_TURN) : 0;
    *rz = after.product;
    step.energy = (struct groom_retarget_energy){.shape = after.shape, .body = after.body, .total = after.shape + *quadratic};
    step.energy.inter = options->alpha > 0 ? (*quadratic - options->beta * after.body) / options->alpha : 0;
    step.mean_movement = moved.movement / s->hair->n;
    return step;
}

static groom_status descend(struct descent *s, uint32_t iterations, uint32_t *n_iterations, struct groom_retarget_step *history,
                            struct groom_diag *diag)
{
    struct job *job = s->job;
    struct groom_retarget_energy start;
    double rz, last = INFINITY;
    uint32_t i = 0, n_quiet = 0;
    descent_begin(s);
    rz = descent_total(s).product;
    groom_status st = coupled_energy(job, s->hair, (const float(*)[3])s->hair->p, &start, diag);
    double quadratic = start.total - start.shape;
    while (st == GROOM_OK && i < iterations && n_quiet < QUIET) {
        if (progress_cancelled(job->context))
            return groom_fail(diag, GROOM_ECANCELLED, "cancelled while strands were adapted together");
        struct groom_retarget_step step = step_on(s, &rz, &quadratic);
        if (step.energy.total > last)
            s->turn = 0;
        last = step.energy.total;
        if (history && i < GROOM_RETARGET_MAX_HISTORY)
            history[i] = step;
        progress_loss(job->context, "energy", i, step.energy.total);
        i++;
        progress_report(job->context, job->progress_from + (job->progress_to - job->progress_from) * i / iterations);
        n_quiet = step.mean_movement < job->options->tolerance ? n_quiet + 1 : 0;
    }
    *n_iterations = i;
    return st;
}

groom_status descent_solve(struct job *job, const struct coupled *hair, uint32_t iterations, uint32_t *n_iterations,
                           struct groom_retarget_step *history, struct groom_diag *diag)
{
    uint32_t n_threads = parallel_threads(job->context);
    struct descent s = {.job = job, .hair = hair, .n_pieces = hair->n_strands / DESCENT_PIECE + 1};
    groom_status st = links_init(&s.links, job, hair, diag);
    if (st == GROOM_OK && !descent_allocate(&s, hair->n, n_threads))
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to adapt %u particles together", hair->n);
    if (st == GROOM_OK)
        st = descend(&s, iterations, n_iterations, history, diag);
    descent_release(&s, hair->n, n_threads);
    links_finish(&s.links, job->allocator);
    return st;
}
