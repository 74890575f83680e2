/* Stage `instance_weights`: Chang et al. 2025, Section 5.3.
 *
 * Each strand is blended from the guides near it with the weights that bring the clusters' mean
 * strands, not smoothed and without operators, closest to it (Eqs. 3 and 5). The paper takes 2 000
 * steps of Adam; for one strand it is a least-squares problem of a few weights, solved here at its
 * minimum. Weights are not negative and sum to 1, so that a strand stays among its guides however
 * they are edited; a pull towards the weights by distance decides where the strands do not. Guides
 * on the wrong side of a parting get no weight, near as they may be. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "fit/assign.h"
#include "fit/simplex.h"
#include "fit/state.h"

enum phase { SOLVE, ASSIGN, ENDED };

#define STRANDS_PER_PIECE 64
#define STEP_STRANDS 20000

struct solving {
    struct groom_fit *fit;
    uint32_t first, count;
    uint32_t n_candidates;
    const uint32_t *candidate; /* [count][n_candidates] guides, nearest first */
    double *scratch;           /* [threads][(n_candidates + 1) * 3 m] */
    double (*piece_loss)[2];   /* before, after: sums of squared distances */
};

static size_t scratch_size(const struct groom_fit *fit, uint32_t n_candidates)
{
    return ((size_t)n_candidates + 1) * 3 * fit->m;
}

/* The polyline from its root on. */
static void shape_of(const float (*points)[3], uint32_t m, double *out)
{
    for (uint32_t j = 0; j < m; j++)
        for (int c = 0; c < 3; c++)
            out[3 * j + c] = (double)points[j][c] - points[0][c];
}

static double dot(const double *restrict a, const double *restrict b, uint32_t n)
{
    double sum[4] = {0};
    uint32_t i = 0;
    for (; i + 4 <= n; i += 4)
        for (uint32_t l = 0; l < 4; l++)
            sum[l] += a[i + l] * b[i + l];
    for (; i < n; i++)
        sum[0] += a[i] * b[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* The squared distance that is left with these weights. */
static double objective(const double *gram, const double *b, double square, uint32_t n, const double *w)
{
    double value = square;
    for (uint32_t i = 0; i < n; i++) {
        value -= 2 * b[i] * w[i];
        for (uint32_t j = 0; j < n; j++)
            value += w[i] * gram[i * n + j] * w[j];
    }
    return fmax(value, 0);
}

/* The weights that the strand has by distance, for its candidates. */
static void present_weights(const struct groom *groom, uint32_t i, const uint32_t *candidate, uint32_t n, double *w)
{
    uint32_t k = groom->n_instancing;
    for (uint32_t a = 0; a < n; a++) {
        w[a] = 0;
        for (uint32_t s = 0; s < k; s++)
            if (groom->instancing_guide[(size_t)i * k + s] == candidate[a])
                w[a] += groom->instancing_weight[(size_t)i * k + s];
    }
}

/* The heaviest k; places that are left over go to the nearest guides, at no weight. */
static void store_weights(struct groom *groom, uint32_t i, const uint32_t *candidate, uint32_t n, double *w)
{
    uint32_t k = groom->n_instancing, at = 0;
    uint32_t *guide = groom->instancing_guide + (size_t)i * k;
    float *weight = groom->instancing_weight + (size_t)i * k;
    for (int weighty = 1; weighty >= 0; weighty--)
        for (uint32_t a = 0; a < n && at < k; a++)
            if ((w[a] > 0) == weighty) {
                guide[at] = candidate[a];
                weight[at++] = (float)w[a];
            }
}

static void solve_strand(const struct solving *job, uint32_t at, double *scratch, double loss[2])
{
    struct groom_fit *fit = job->fit;
    uint32_t n = job->n_candidates, d = 3 * fit->m, i = job->first + at;
    const uint32_t *candidate = job->candidate + (size_t)at * n;
    double gram[SIMPLEX_MOST * SIMPLEX_MOST] = {0}, b[SIMPLEX_MOST] = {0}, present[SIMPLEX_MOST], w[SIMPLEX_MOST];
    double *shape = scratch + (size_t)n * d, before;

    shape_of((const float (*)[3])(fit->target + (size_t)i * fit->m), fit->m, shape);
    for (uint32_t a = 0; a < n; a++) {
        shape_of((const float (*)[3])(fit->centroids + (size_t)candidate[a] * fit->m), fit->m, scratch + (size_t)a * d);
        b[a] = dot(scratch + (size_t)a * d, shape, d);
        for (uint32_t c = 0; c <= a; c++)
            gram[a * n + c] = gram[c * n + a] = dot(scratch + (size_t)a * d, scratch + (size_t)c * d, d);
    }
    double square = dot(shape, shape, d), pull = fit->options.stages.instance_weights.distance_pull * square;
    present_weights(fit->groom, i, candidate, n, present);
    before = objective(gram, b, square, n, present);
    loss[0] += before;
    if (square == 0) {
        loss[1] += before;
        return;
    }
    for (uint32_t a = 0; a < n; a++) {
        gram[a * n + a] += pull;
        b[a] += pull * present[a];
    }
    simplex_solve(gram, b, n, fit->groom->n_instancing, w);
    for (uint32_t a = 0; a < n; a++) {
        gram[a * n + a] -= pull;
        b[a] -= pull * present[a];
    }
    double after = objective(gram, b, square, n, w);
    if (after < before)
        store_weights(fit->groom, i, candidate, n, w);
    loss[1] += fmin(after, before);
}

static void solve_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct solving *job = user;
    uint32_t begin = piece * STRANDS_PER_PIECE;
    double *loss = job->piece_loss[piece];
    loss[0] = loss[1] = 0;
    for (uint32_t at = begin; at < job->count && at < begin + STRANDS_PER_PIECE; at++)
        solve_strand(job, at, job->scratch + (size_t)thread * scratch_size(job->fit, job->n_candidates), loss);
}

/* Sums over strands become Eq. 5, in square metres; over all steps so far. */
static void add_loss(struct groom_fit *fit, const struct solving *job, uint32_t n_pieces)
{
    double unit = (double)fit->scale * fit->scale / ((double)fit->n * fit->m), before = 0, after = 0;
    for (uint32_t p = 0; p < n_pieces; p++) {
        before += job->piece_loss[p][0];
        after += job->piece_loss[p][1];
    }
    if (fit->iteration == 0)
        report_loss(&fit->report, "instance_weights", "L_x", 0, 0);
    fit->report.losses[fit->report.n_losses - 1].before += unit * before;
    fit->report.losses[fit->report.n_losses - 1].after += unit * after;
}

static groom_status solve(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom *groom = fit->groom;
    uint32_t wanted = fit->options.stages.instance_weights.candidates, k = groom->n_instancing;
    uint32_t n = wanted > k ? wanted : k, count = fit->n - fit->iteration;
    n = n < groom->n_guides ? n : groom->n_guides;
    count = count < STEP_STRANDS ? count : STEP_STRANDS;
    uint32_t n_pieces = (count + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE;
    size_t n_scratch = parallel_threads(context) * scratch_size(fit, n);
    struct solving job = {.fit = fit, .first = fit->iteration, .count = count, .n_candidates = n};
    struct groom_neighbours *index = NULL;
    uint32_t *candidate = memory_array(allocator, (size_t)count * n, sizeof *candidate);
    groom_status st;

    job.candidate = candidate;
    job.scratch = memory_array(allocator, n_scratch, sizeof *job.scratch);
    job.piece_loss = memory_array(allocator, n_pieces, sizeof *job.piece_loss);
    if (!candidate || !job.scratch || !job.piece_loss) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to weigh the guides of %u strands", count);
        goto out;
    }
    if ((st = groom_neighbours_create(groom->guide_uv[0], groom->n_guides, 2, context, &index, diag)) != GROOM_OK ||
        (st = groom_neighbours_find(index, groom->root_uv[job.first], count, n, candidate, NULL, context, diag)) != GROOM_OK)
        goto out;
    parallel_for(context, n_pieces, solve_piece, &job);
    add_loss(fit, &job, n_pieces);
    fit->iteration += count;
    if (fit->iteration == fit->n) {
        progress_loss(context, "L_x", 0, fit->report.losses[fit->report.n_losses - 1].before);
        progress_loss(context, "L_x", 1, fit->report.losses[fit->report.n_losses - 1].after);
        fit->phase = ASSIGN;
        fit->iteration = 0;
    }
out:
    groom_neighbours_destroy(index);
    memory_release(allocator, candidate, (size_t)count * n, sizeof *candidate);
    memory_release(allocator, job.scratch, n_scratch, sizeof *job.scratch);
    memory_release(allocator, job.piece_loss, n_pieces, sizeof *job.piece_loss);
    return st;
}

groom_status instance_weights_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                                   struct groom_diag *diag)
{
    if (fit->phase == SOLVE)
        return solve(fit, context, diag);
    return assign_step(fit, ended, context, diag); /* strands have moved: ask again what is in the head */
}

double instance_weights_fraction(const struct groom_fit *fit)
{
    return 0.5 * fit->phase + 0.5 * fit->iteration / fit->n;
}

int instance_weights_sound(const struct groom_fit *fit)
{
    return fit->phase < ENDED && fit->iteration < fit->n &&
           (fit->phase == ASSIGN || fit->iteration == 0 || fit->report.n_losses > 0);
}
