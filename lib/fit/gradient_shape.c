#include "base/radix.h"
#include "fit/gradient_shape.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#include "base/blas.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "fit/replay.h"
#include "quality/loss_wasserstein.h"
#include "quality/waves.h"

#define UNIT 0.1                   /* metres on an ordinary head */
#define STREAM_SLICES 0x66690030u  /* and the one after it */
#define DIRECTIONS_PER_PIECE 8
#define STRANDS_PER_PIECE 64
#define LEAST_MAGNITUDE 1e-6f

/* A set of features of all strands: of the target, of the groom, and what the loss says about the latter. */
struct features { uint32_t d; float *target, *fitted, *slope; }; /* [n][d] */

struct gradient_shape {
    const struct groom_fit *fit;
    const struct groom_allocator *allocator;
    double unit;
    uint32_t n, m, n_waves;
    struct features segments, spectra;
    float *waves;            /* [2 n_waves][m-1] */
    float *directions;       /* [d][d] of the larger set */
    float *push;             /* [d][n] how far each projection is to go, likewise */
    double *sums;            /* [d] */
    float (*points)[3];      /* [n * m] */
};

static uint32_t pieces_of(uint32_t n, uint32_t per_piece) { return n / per_piece + (n % per_piece != 0); }
static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }

/* --- Eq. 11 ------------------------------------------------------------------------------------- */

struct slicing {
    struct gradient_shape *g;
    const struct features *features;
    struct groom_random_key key;
    uint32_t first_direction; /* index of this iteration's first one */
    float weight;
    float *scratch;           /* [threads][per_thread] projections of both sets, room to sort */
    size_t per_thread;        /* floats */
};

static size_t slice_floats(uint32_t n) { return (size_t)2 * DIRECTIONS_PER_PIECE * n + n + 4 * (size_t)n; }

/* Where each projection of the groom would have to go to stand where the target's of its rank does. */
static double push_of(float *target, const float *fitted, uint32_t n, float *spare, uint64_t *order, float scale, float *push)
{
    double sum = 0;
    radix_sort_floats(target, spare, n);
    radix_sort_order(fitted, order, order + n, n);
    for (uint32_t rank = 0; rank < n; rank++) {
        uint32_t i = (uint32_t)order[rank];
        float off = fitted[i] - target[rank];
        sum += (double)off * off;
        push[i] = scale * off;
    }
    return sum;
}

static void slice_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct slicing *job = user;
    struct gradient_shape *g = job->g;
    uint32_t n = g->n, d = job->features->d, first = piece * DIRECTIONS_PER_PIECE, count = least(d - first, DIRECTIONS_PER_PIECE);
    float *directions = g->directions + (size_t)first * d;
    uint64_t *order = (uint64_t *)(void *)(job->scratch + thread * job->per_thread);
    float *of_target = (float *)(void *)(order + 2 * (size_t)n), *of_fitted = of_target + (size_t)DIRECTIONS_PER_PIECE * n;
    float *spare = of_fitted + (size_t)DIRECTIONS_PER_PIECE * n, scale = 2 * job->weight / ((float)d * (float)n);
    for (uint32_t k = 0; k < count; k++)
        loss_wasserstein_direction(job->key, job->first_direction + first + k, d, directions + (size_t)k * d);
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)count, (int)n, (int)d, 1, directions, (int)d,
                job->features->target, (int)d, 0, of_target, (int)n);
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)count, (int)n, (int)d, 1, directions, (int)d,
                job->features->fitted, (int)d, 0, of_fitted, (int)n);
    for (uint32_t k = 0; k < count; k++)
        g->sums[first + k] = push_of(of_target + (size_t)k * n, of_fitted + (size_t)k * n, n, spare, order, scale,
                                     g->push + (size_t)(first + k) * n);
}

static void gather_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct slicing *job = user;
    const struct gradient_shape *g = job->g;
    uint32_t d = job->features->d, first = piece * STRANDS_PER_PIECE, count = least(g->n - first, STRANDS_PER_PIECE);
    (void)thread;
    cblas_sgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)count, (int)d, (int)d, 1, g->push + first, (int)g->n,
                g->directions, (int)d, 0, job->features->slope + (size_t)first * d, (int)d);
}

/* The loss of a set and, times `weight`, its slope. */
static groom_status slice(struct gradient_shape *g, const struct features *features, uint32_t stream, uint32_t iteration,
                          double weight, double *loss, const struct groom_context *context)
{
    struct slicing job = {.g = g, .features = features, .key = {g->fit->options.seed, stream},
                          .first_direction = iteration * features->d, .weight = (float)weight,
                          .per_thread = (slice_floats(g->n) + 15) / 16 * 16};
    size_t n_scratch = job.per_thread * parallel_threads(context);
    double sum = 0;
    job.scratch = memory_array(g->allocator, n_scratch, sizeof *job.scratch);
    if (!job.scratch)
        return GROOM_ENOMEM;
    parallel_for(context, pieces_of(features->d, DIRECTIONS_PER_PIECE), slice_piece, &job);
    parallel_for(context, pieces_of(g->n, STRANDS_PER_PIECE), gather_piece, &job);
    for (uint32_t k = 0; k < features->d; k++)
        sum += g->sums[k];
    *loss = sum / features->d / g->n;
    memory_release(g->allocator, job.scratch, n_scratch, sizeof *job.scratch);
    return GROOM_OK;
}

/* --- from features back to points ------------------------------------------------------------------- */

struct unfolding { struct gradient_shape *g; float *scratch; size_t per_thread; };

/* Slopes of magnitudes become slopes of segments, added to theirs. */
static void unfold_spectra(struct gradient_shape *g, uint32_t first, uint32_t count, float *transform)
{
    uint32_t h = g->n_waves;
    int n = (int)g->m - 1, rows = (int)(3 * count), h2 = 2 * (int)h;
    const float *segments = g->segments.fitted + (size_t)first * g->segments.d;
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, rows, h2, n, 1, segments, n, g->waves, n, 0, transform, h2);
    for (uint32_t row = 0; row < 3 * count; row++) {
        float *t = transform + (size_t)row * 2 * h;
        const float *slope = g->spectra.slope + ((size_t)3 * first + row) * h;
        for (uint32_t k = 0; k < h; k++) {
            float size = sqrtf(t[k] * t[k] + t[h + k] * t[h + k]), scale = size > LEAST_MAGNITUDE ? slope[k] / size : 0;
            t[k] *= scale;
            t[h + k] *= scale;
        }
    }
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, rows, n, h2, 1, transform, h2, g->waves, n, 1,
                g->segments.slope + (size_t)first * g->segments.d, n);
}

static void unfold_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct unfolding *job = user;
    struct gradient_shape *g = job->g;
    uint32_t first = piece * STRANDS_PER_PIECE, count = least(g->n - first, STRANDS_PER_PIECE), n = g->m - 1;
    unfold_spectra(g, first, count, job->scratch + thread * job->per_thread);
    for (uint32_t i = first; i < first + count; i++) {
        float (*x)[3] = g->points + (size_t)i * g->m;
        const float *slope = g->segments.slope + (size_t)i * g->segments.d;
        memset(x, 0, g->m * sizeof *x);
        for (int c = 0; c < 3; c++)
            for (uint32_t j = 0; j < n; j++) {
                float de = slope[(size_t)c * n + j] / (float)g->unit;
                x[j + 1][c] += de;
                x[j][c] -= de;
            }
    }
}

static groom_status unfold(struct gradient_shape *g, const struct groom_context *context)
{
    struct unfolding job = {.g = g, .per_thread = (size_t)3 * STRANDS_PER_PIECE * 2 * g->n_waves};
    size_t n_scratch = job.per_thread * parallel_threads(context);
    job.scratch = memory_array(g->allocator, n_scratch, sizeof *job.scratch);
    if (!job.scratch)
        return GROOM_ENOMEM;
    parallel_for(context, pieces_of(g->n, STRANDS_PER_PIECE), unfold_piece, &job);
    memory_release(g->allocator, job.scratch, n_scratch, sizeof *job.scratch);
    return GROOM_OK;
}

/* --- life --------------------------------------------------------------------------------------------- */

static int features_init(struct features *features, uint32_t n, uint32_t d, const struct groom_allocator *allocator)
{
    features->d = d;
    features->target = memory_array(allocator, (size_t)n * d, sizeof(float));
    features->fitted = memory_array(allocator, (size_t)n * d, sizeof(float));
    features->slope = memory_array(allocator, (size_t)n * d, sizeof(float));
    return features->target && features->fitted && features->slope;
}

static void features_finish(struct features *features, uint32_t n, const struct groom_allocator *allocator)
{
    memory_release(allocator, features->target, (size_t)n * features->d, sizeof(float));
    memory_release(allocator, features->fitted, (size_t)n * features->d, sizeof(float));
    memory_release(allocator, features->slope, (size_t)n * features->d, sizeof(float));
}

/* The target's features; `points` holds the target for it. */
static groom_status measure_target(struct gradient_shape *g, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_fit *fit = g->fit;
    for (size_t v = 0; v < (size_t)g->n * g->m; v++)
        for (int c = 0; c < 3; c++)
            g->points[v][c] = fit->target[v][c] * fit->scale + fit->centre[c];
    waves_fill(g->m - 1, g->n_waves, g->waves);
    return loss_shape_features((const float (*)[3])g->points, g->n, g->m, g->unit, g->segments.target, g->spectra.target,
                               context, diag);
}

groom_status gradient_shape_create(const struct groom_fit *fit, const struct groom_context *context,
                                   struct gradient_shape **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct gradient_shape *g = memory_array_zero(allocator, 1, sizeof *g);
    groom_status st = GROOM_ENOMEM;
    if (!g)
        return groom_fail(diag, st, "no memory for a gradient");
    *g = (struct gradient_shape){.fit = fit, .allocator = allocator, .unit = UNIT * fit->ordinary, .n = fit->n, .m = fit->m,
                                 .n_waves = waves_count(fit->m - 1)};
    uint32_t d_segments = 3 * (fit->m - 1), d_spectra = 3 * g->n_waves, d = d_segments > d_spectra ? d_segments : d_spectra;
    int fine = features_init(&g->segments, g->n, d_segments, allocator);
    fine &= features_init(&g->spectra, g->n, d_spectra, allocator);
    g->waves = memory_array(allocator, (size_t)2 * g->n_waves * (g->m - 1), sizeof *g->waves);
    g->directions = memory_array(allocator, (size_t)d * d, sizeof *g->directions);
    g->push = memory_array(allocator, (size_t)d * g->n, sizeof *g->push);
    g->sums = memory_array(allocator, d, sizeof *g->sums);
    g->points = memory_array(allocator, (size_t)g->n * g->m, sizeof *g->points);
    if (fine && g->waves && g->directions && g->push && g->sums && g->points) {
        if ((st = blas_prepare(context, diag)) == GROOM_OK)
            st = measure_target(g, context, diag);
    }
    if (st != GROOM_OK) {
        gradient_shape_destroy(g);
        return groom_fail(diag, st, "no memory for the shapes of %u strands", fit->n);
    }
    *out = g;
    return st;
}

void gradient_shape_destroy(struct gradient_shape *g)
{
    if (!g)
        return;
    size_t d = g->segments.d > g->spectra.d ? g->segments.d : g->spectra.d;
    features_finish(&g->segments, g->n, g->allocator);
    features_finish(&g->spectra, g->n, g->allocator);
    memory_release(g->allocator, g->waves, (size_t)2 * g->n_waves * (g->m - 1), sizeof *g->waves);
    memory_release(g->allocator, g->directions, d * d, sizeof *g->directions);
    memory_release(g->allocator, g->push, d * g->n, sizeof *g->push);
    memory_release(g->allocator, g->sums, d, sizeof *g->sums);
    memory_release(g->allocator, g->points, (size_t)g->n * g->m, sizeof *g->points);
    memory_release(g->allocator, g, 1, sizeof *g);
}

groom_status gradient_shape_evaluate(struct gradient_shape *g, uint32_t iteration, struct groom_gradient *out,
                                     double *loss, const struct groom_context *context, struct groom_diag *diag)
{
    double spectra = 0, segments = 0, lambda_e = g->fit->options.stages.operators.lambda_e;
    struct replay replay = {g->m, g->points};
    groom_status st;
    if ((st = groom_evaluate(g->fit->groom, 0, g->n, g->points, context, diag)) != GROOM_OK ||
        (st = loss_shape_features((const float (*)[3])g->points, g->n, g->m, g->unit, g->segments.fitted,
                                  g->spectra.fitted, context, diag)) != GROOM_OK)
        return st;
    if ((st = slice(g, &g->spectra, STREAM_SLICES, iteration, 1, &spectra, context)) != GROOM_OK ||
        (st = slice(g, &g->segments, STREAM_SLICES + 1, iteration, lambda_e, &segments, context)) != GROOM_OK ||
        (st = unfold(g, context)) != GROOM_OK)
        return groom_fail(diag, st, "no memory to compare the shapes of %u strands", g->n);
    *loss = spectra + lambda_e * segments;
    return groom_evaluate_gradient(g->fit->groom, NULL, g->n, replay_play(&replay), out, context, diag);
}
