#include "fit/weights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "fit/dense.h"
#include "fit/simplex.h"
#include "fit/strand_model.h"

#define STRANDS_PER_PIECE 64
#define SIGMA_IN_SPACINGS 1.5  /* of Eq. 3: model/instancing.c */
#define SAMPLE 1000            /* strands of which the usual misfit is taken */
#define LEAST_PULL 1e-9        /* of a strand's square: keeps the problem definite */
#define ALIKE 1.5              /* times as far from the strand as near guides are: surely like it, and */
#define UNLIKE 3.0             /* surely not */
#define PULL_NAMED 100.0       /* automatic pulls: operators named, */
#define PULL_FREE 10.0         /* not named: guides as near to the truth as with 100, real strands as well explained as with 1 */
#define FREEDOMS 4.0           /* of what a strand does that neither weights nor ways explain */

struct weighing {
    struct groom_fit *fit;
    const struct strand_model *model;
    uint32_t count, n;          /* strands, candidates of each */
    const uint32_t *strand;     /* [count] */
    uint32_t *candidate;        /* [count][n] guides, nearest first */
    float *squared;             /* [count][n] their distances on the scalp */
    double sigma, noise, usual; /* of Eq. 3; energy a freedom; square distance to guides that are alike */
    double (*scratch)[3];       /* [threads][scratch_size] */
    double (*piece_loss)[2];
    double *left, *alike;       /* [count] of a sample: misfit of free weights, distance to near guides */
};

struct workspace {
    double (*shape)[3];         /* [m] of the strand, from its root */
    double (*blend)[3], (*ways)[3];
};

static size_t scratch_size(uint32_t m) { return (2 + (size_t)STRAND_WAYS) * m; } /* of [3] */

static struct workspace workspace_of(double (*scratch)[3], uint32_t m)
{
    return (struct workspace){scratch, scratch + m, scratch + 2 * (size_t)m};
}

/* A candidate's mean strand. */
static const double (*candidate_of(const struct weighing *job, uint32_t at, uint32_t a))[3]
{
    return job->model->shape + (size_t)job->candidate[(size_t)at * job->n + a] * job->model->m;
}

static double dot(const double (*restrict x)[3], const double (*restrict y)[3], uint32_t m)
{
    const double *a = x[0], *b = y[0];
    double sum[4] = {0};
    uint32_t i = 0, n = 3 * m;
    for (; i + 4 <= n; i += 4)
        for (uint32_t l = 0; l < 4; l++)
            sum[l] += a[i + l] * b[i + l];
    for (; i < n; i++)
        sum[0] += a[i] * b[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

static const double (*as_const(double (*x)[3]))[3] { return (const double (*)[3])x; }

/* --- one strand ------------------------------------------------------------------------- */

/* Least squares in the weights: gram [n][n], b [n], and the square of t. */
struct problem { double gram[SIMPLEX_MOST * SIMPLEX_MOST], b[SIMPLEX_MOST], square; };

static double misfit(const struct problem *p, uint32_t n, const double *w)
{
    double value = p->square;
    for (uint32_t i = 0; i < n; i++) {
        value -= 2 * p->b[i] * w[i];
        for (uint32_t j = 0; j < n; j++)
            value += w[i] * p->gram[i * n + j] * w[j];
    }
    return fmax(value, 0);
}

static void fill_problem(const struct weighing *job, uint32_t at, struct workspace *w, struct problem *p)
{
    uint32_t n = job->n, m = job->model->m;
    const float (*x)[3] = (const float (*)[3])(job->fit->target + (size_t)job->strand[at] * m);
    for (uint32_t j = 0; j < m; j++)
        for (int c = 0; c < 3; c++)
            w->shape[j][c] = (double)x[j][c] - x[0][c];
    p->square = dot(as_const(w->shape), as_const(w->shape), m);
    for (uint32_t a = 0; a < n; a++) {
        p->b[a] = dot(candidate_of(job, at, a), as_const(w->shape), m);
        for (uint32_t c = 0; c <= a; c++)
            p->gram[a * n + c] = p->gram[c * n + a] = dot(candidate_of(job, at, a), candidate_of(job, at, c), m);
    }
}

/* The k-th smallest squared distance of the strand from a candidate: from guides that are like it. */
static double alike_of(const double *distance, uint32_t n, uint32_t k)
{
    double sorted[SIMPLEX_MOST];
    memcpy(sorted, distance, n * sizeof *sorted);
    sort_doubles(sorted, n);
    return sorted[(k < n ? k : n) - 1];
}

/* Weights by distance among the nearest k that are like the strand. */
static void weigh_by_distance(const struct weighing *job, uint32_t at, const struct problem *p, double *w0)
{
    uint32_t n = job->n, k = job->fit->groom->n_instancing, taken = 0;
    const float *squared = job->squared + (size_t)at * n;
    double distance[SIMPLEX_MOST] = {0}, sum = 0, nearest = -1;
    for (uint32_t a = 0; a < n; a++)
        distance[a] = fmax(p->square - 2 * p->b[a] + p->gram[a * n + a], 0);
    double alike = fmax(alike_of(distance, n, k), job->usual);
    if (job->alike)
        job->alike[at] = alike_of(distance, n, (n + 1) / 2);
    for (uint32_t a = 0; a < n; a++) {
        double ratio = alike > 0 ? sqrt(distance[a] / alike) : 0;
        double like = taken < k ? fmin(fmax((UNLIKE - ratio) / (UNLIKE - ALIKE), 0), 1) : 0;
        if (like > 0 && nearest < 0)
            nearest = squared[a];
        taken += like > 0;
        w0[a] = like > 0 ? like * exp((nearest - squared[a]) / (job->sigma * job->sigma)) : 0;
        sum += w0[a];
    }
    for (uint32_t a = 0; a < n; a++)
        w0[a] /= sum;
}

static void blend_candidates(const struct weighing *job, uint32_t at, const double *w0, double (*blend)[3])
{
    uint32_t m = job->model->m;
    memset(blend, 0, m * sizeof *blend);
    for (uint32_t a = 0; a < job->n; a++)
        for (uint32_t j = 0; w0[a] > 0 && j < m; j++)
            for (int c = 0; c < 3; c++)
                blend[j][c] += w0[a] * candidate_of(job, at, a)[j][c];
}

/* Takes what lies along the strand's ways out of the problem. */
static void leave_ways(const struct weighing *job, uint32_t at, const double *w0, struct workspace *w, struct problem *p)
{
    uint32_t n = job->n, m = job->model->m;
    double inner[STRAND_WAYS * STRAND_WAYS] = {0}, along[SIMPLEX_MOST + 1][STRAND_WAYS];
    blend_candidates(job, at, w0, w->blend);
    uint32_t n_ways = strand_ways(job->model, job->strand[at], as_const(w->blend), w->ways);
    for (uint32_t v = 0; v < n_ways; v++) {
        const double (*way)[3] = as_const(w->ways + (size_t)v * m);
        for (uint32_t u = 0; u <= v; u++)
            inner[v * n_ways + u] = inner[u * n_ways + v] = dot(way, as_const(w->ways + (size_t)u * m), m);
        inner[v * n_ways + v] += job->noise + LEAST_PULL * inner[v * n_ways + v];
        for (uint32_t a = 0; a < n; a++)
            along[a][v] = dot(way, candidate_of(job, at, a), m);
        along[n][v] = dot(way, as_const(w->shape), m);
    }
    if (n_ways == 0 || !dense_cholesky(inner, n_ways))
        return;
    for (uint32_t a = 0; a <= n; a++)
        dense_forward(inner, n_ways, along[a]);
    for (uint32_t v = 0; v < n_ways; v++) {
        p->square -= along[n][v] * along[n][v];
        for (uint32_t a = 0; a < n; a++) {
            p->b[a] -= along[a][v] * along[n][v];
            for (uint32_t c = 0; c < n; c++)
                p->gram[a * n + c] -= along[a][v] * along[c][v];
        }
    }
}

static void solve_pulled(const struct problem *p, uint32_t n, uint32_t support, double pull, const double *w0, double *w)
{
    struct problem pulled = *p;
    for (uint32_t a = 0; a < n; a++) {
        pulled.gram[a * n + a] += pull;
        pulled.b[a] += pull * w0[a];
    }
    simplex_solve(pulled.gram, pulled.b, n, support, w);
}

/* The weights that the strand has in the groom, for its candidates. */
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
static void store_weights(struct groom *groom, uint32_t i, const uint32_t *candidate, uint32_t n, const double *w)
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

/* Named operators have made the strands: what they can explain is theirs. Otherwise guides explain what they can. */
static double pull_of(const struct groom_fit *fit)
{
    double asked = fit->options.stages.instance_weights.distance_pull;
    if (asked != GROOM_FIT_AUTO)
        return asked;
    return fit->options.operators_auto ? PULL_FREE : PULL_NAMED;
}

static void solve_strand(const struct weighing *job, uint32_t at, double (*scratch)[3], double loss[2])
{
    uint32_t n = job->n, k = job->fit->groom->n_instancing;
    struct workspace space = workspace_of(scratch, job->model->m);
    struct problem p;
    double w0[SIMPLEX_MOST], w[SIMPLEX_MOST] = {0};
    fill_problem(job, at, &space, &p);
    weigh_by_distance(job, at, &p, w0);
    if (!(p.square > 0)) {
        store_weights(job->fit->groom, job->strand[at], job->candidate + (size_t)at * n, n, w0);
        return;
    }
    double all = p.square;
    struct problem whole = p;
    if (!job->fit->options.operators_auto)
        leave_ways(job, at, w0, &space, &p);
    if (job->left) {
        solve_pulled(&p, n, k, LEAST_PULL * all, w0, w);
        job->left[at] = misfit(&p, n, w);
        return;
    }
    double pull = pull_of(job->fit) * job->noise * FREEDOMS;
    solve_pulled(&p, n, k, pull + LEAST_PULL * all, w0, w);
    present_weights(job->fit->groom, job->strand[at], job->candidate + (size_t)at * n, n, w0);
    loss[0] += misfit(&whole, n, w0);
    loss[1] += misfit(&whole, n, w);
    store_weights(job->fit->groom, job->strand[at], job->candidate + (size_t)at * n, n, w);
}

static void solve_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct weighing *job = user;
    uint32_t begin = piece * STRANDS_PER_PIECE;
    double *loss = job->piece_loss[piece];
    loss[0] = loss[1] = 0;
    for (uint32_t at = begin; at < job->count && at < begin + STRANDS_PER_PIECE; at++)
        solve_strand(job, at, job->scratch + (size_t)thread * scratch_size(job->model->m), loss);
}

/* --- many ---------------------------------------------------------------------------------- */

/* Of these strands; job's strand, sigma, noise, usual, left and alike are the caller's. */
static groom_status weigh(struct weighing *job, const struct groom_neighbours *index, const struct groom_context *context,
                          struct weights_loss *loss, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_pieces = (job->count + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE;
    size_t n_entries = (size_t)job->count * job->n;
    size_t n_scratch = parallel_threads(context) * scratch_size(job->model->m);
    float (*query)[2] = memory_array(allocator, job->count, sizeof *query);
    groom_status st = GROOM_ENOMEM;
    job->candidate = memory_array(allocator, n_entries, sizeof *job->candidate);
    job->squared = memory_array(allocator, n_entries, sizeof *job->squared);
    job->scratch = memory_array(allocator, n_scratch, sizeof *job->scratch);
    job->piece_loss = memory_array(allocator, n_pieces, sizeof *job->piece_loss);
    if (!query || !job->candidate || !job->squared || !job->scratch || !job->piece_loss) {
        groom_fail(diag, st, "no memory to weigh the guides of %u strands", job->count);
        goto out;
    }
    for (uint32_t at = 0; at < job->count; at++)
        memcpy(query[at], job->fit->root_uv[job->strand[at]], sizeof *query);
    st = groom_neighbours_find(index, query[0], job->count, job->n, job->candidate, job->squared, context, diag);
    if (st != GROOM_OK)
        goto out;
    parallel_for(context, n_pieces, solve_piece, job);
    for (uint32_t p = 0; p < n_pieces; p++) {
        loss->before += job->piece_loss[p][0];
        loss->after += job->piece_loss[p][1];
    }
out:
    memory_release(allocator, query, job->count, sizeof *query);
    memory_release(allocator, job->candidate, n_entries, sizeof *job->candidate);
    memory_release(allocator, job->squared, n_entries, sizeof *job->squared);
    memory_release(allocator, job->scratch, n_scratch, sizeof *job->scratch);
    memory_release(allocator, job->piece_loss, n_pieces, sizeof *job->piece_loss);
    return st;
}

/* The width of Eq. 3: what the options say, else 1.5 times the median distance of a guide to the next. */
static groom_status find_sigma(struct weighing *job, const struct groom_neighbours *index,
                               const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom *groom = job->fit->groom;
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = groom->n_guides, *id = memory_array(allocator, n, 2 * sizeof *id);
    float *squared = memory_array(allocator, n, 2 * sizeof *squared);
    double *spacing = memory_array(allocator, n, sizeof *spacing);
    groom_status st = id && squared && spacing ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to space guides");
    job->sigma = job->fit->options.stages.initialize.sigma_instance;
    if (st == GROOM_OK && n > 1)
        st = groom_neighbours_find(index, groom->guide_uv[0], n, 2, id, squared, context, diag);
    if (st == GROOM_OK && !(job->sigma > 0)) {
        for (uint32_t g = 0; g < n; g++)
            spacing[g] = n > 1 ? sqrt(squared[2 * g + 1]) : 1;
        job->sigma = SIGMA_IN_SPACINGS * median_of_doubles(spacing, n);
    }
    job->sigma = fmax(job->sigma, 1e-9);
    memory_release(allocator, id, n, 2 * sizeof *id);
    memory_release(allocator, squared, n, 2 * sizeof *squared);
    memory_release(allocator, spacing, n, sizeof *spacing);
    return st;
}

/* The usual distance to guides that are alike, and what free weights leave of the usual strand. */
static groom_status find_noise(struct weighing *job, const struct groom_neighbours *index, const uint32_t *order,
                               const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t count = job->fit->n < SAMPLE ? job->fit->n : SAMPLE;
    struct weighing sample = *job;
    struct weights_loss loss = {0};
    groom_status st = GROOM_OK;
    sample.strand = order;
    sample.count = count;
    sample.left = memory_array_zero(allocator, count, sizeof *sample.left);
    sample.alike = memory_array_zero(allocator, count, sizeof *sample.alike);
    if (!sample.left || !sample.alike)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to weigh the guides of %u strands", count);
    for (int round = 0; st == GROOM_OK && round < 2; round++) /* the ways' own strength needs the noise */
        if ((st = weigh(&sample, index, context, &loss, diag)) == GROOM_OK) {
            sample.noise = job->noise = median_of_doubles(sample.left, count) / FREEDOMS;
            sample.usual = job->usual = median_of_doubles(sample.alike, count);
        }
    memory_release(allocator, sample.left, count, sizeof *sample.left);
    memory_release(allocator, sample.alike, count, sizeof *sample.alike);
    return st;
}

/* The clusters' mean strands from their roots on. */
static void centroid_shapes(const struct groom_fit *fit, double (*out)[3])
{
    for (uint32_t g = 0; g < fit->n_guides; g++)
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++)
                out[(size_t)g * fit->m + j][c] =
                    (double)fit->centroids[(size_t)g * fit->m + j][c] - fit->centroids[(size_t)g * fit->m][c];
}

/* order [n] is the fair order of strands first, then those that are wanted. */
static groom_status solve(struct weighing *job, uint32_t first, uint32_t *order, const struct groom_context *context,
                          struct weights_loss *loss, struct groom_diag *diag)
{
    const struct groom *groom = job->fit->groom;
    struct groom_neighbours *index = NULL;
    groom_status st = groom_neighbours_create(groom->guide_uv[0], groom->n_guides, 2, context, &index, diag);
    if (st != GROOM_OK)
        return st;
    groom_fair_order(job->fit->n, order);
    if ((st = find_sigma(job, index, context, diag)) == GROOM_OK)
        st = find_noise(job, index, order, context, diag);
    for (uint32_t at = 0; at < job->count; at++)
        order[at] = first + at;
    job->strand = order;
    if (st == GROOM_OK)
        st = weigh(job, index, context, loss, diag);
    groom_neighbours_destroy(index);
    return st;
}

groom_status weights_solve(struct groom_fit *fit, uint32_t first, uint32_t count, const struct groom_context *context,
                           struct weights_loss *loss, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t wanted = fit->options.stages.instance_weights.candidates, k = fit->groom->n_instancing;
    struct strand_model model;
    struct weighing job = {.fit = fit, .model = &model, .count = count, .n = wanted > k ? wanted : k};
    size_t size = (size_t)fit->n_guides * fit->m;
    double (*shape)[3] = memory_array(allocator, size, sizeof *shape);
    uint32_t *order = memory_array(allocator, fit->n, sizeof *order);
    groom_status st = GROOM_ENOMEM;
    job.n = job.n < fit->n_guides ? job.n : fit->n_guides;
    if (shape && order) {
        centroid_shapes(fit, shape);
        strand_model_init(&model, fit, (const double (*)[3])shape);
        st = solve(&job, first, order, context, loss, diag);
    } else
        groom_fail(diag, st, "no memory to weigh the guides of %u strands", count);
    memory_release(allocator, shape, size, sizeof *shape);
    memory_release(allocator, order, fit->n, sizeof *order);
    return st;
}
