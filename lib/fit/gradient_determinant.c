#include "fit/gradient_determinant.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "fit/loss_determinant.h"
#include "fit/replay.h"
#include "groom/spatial.h"
#include "groom/strands.h"

#define UNIT 0.1                  /* metres on an ordinary head */
#define STREAM_BATCHES 0x66690040u /* one a kind */
#define LEAST_ROOT_DISTANCE 1e-4  /* units: as in the loss */

struct gradient_determinant {
    const struct groom_fit *fit;
    const struct groom_allocator *allocator;
    enum gradient_determinant_kind kind;
    struct groom_neighbours *neighbours;
    double unit, sigma;
    uint32_t n; /* strands of a batch */
};

uint32_t gradient_determinant_batch(const struct groom_fit *fit)
{
    double n = fit->n * fit->options.stages.operators.batch_fraction;
    n = fmin(fmax(n, 2), fit->options.stages.operators.batch_maximum);
    return n < fit->n ? (uint32_t)n : fit->n;
}

groom_status gradient_determinant_create(const struct groom_fit *fit, enum gradient_determinant_kind kind,
                                         const struct groom_context *context, struct gradient_determinant **out,
                                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct gradient_determinant *g = memory_array_zero(allocator, 1, sizeof *g);
    if (!g)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a gradient");
    *g = (struct gradient_determinant){.fit = fit, .allocator = allocator, .kind = kind, .unit = UNIT * fit->ordinary,
                                       .n = gradient_determinant_batch(fit)};
    g->sigma = kind == GRADIENT_SCALE ? fit->options.stages.operators.sigma_scale : fit->options.stages.operators.sigma_clump;
    groom_status st = groom_neighbours_create(fit->root_uv[0], fit->n, 2, context, &g->neighbours, diag);
    if (st != GROOM_OK) {
        gradient_determinant_destroy(g);
        return st;
    }
    *out = g;
    return st;
}

void gradient_determinant_destroy(struct gradient_determinant *g)
{
    if (!g)
        return;
    groom_neighbours_destroy(g->neighbours);
    memory_release(g->allocator, g, 1, sizeof *g);
}

/* --- one batch -------------------------------------------------------------------------------------- */

static double segment(const float *from, const float *to, double e[3])
{
    double square = 0;
    for (int c = 0; c < 3; c++) {
        e[c] = (double)to[c] - from[c];
        square += e[c] * e[c];
    }
    return sqrt(square);
}

/* Eqs. 14, 15. pull [n][n]: what the loss changes by with each entry of the kernel, both of its places.
 * d_points [n][m][3] out */
static void unfold_scale(const struct gradient_determinant *g, const float (*points)[3], const double *kernel,
                         const double *pull, double *slope, float (*d_points)[3])
{
    uint32_t n = g->n, m = g->fit->m;
    double *length = slope + n;
    for (uint32_t a = 0; a < n; a++) {
        slope[a] = 0;
        length[a] = groom_polyline_length(points + (size_t)a * m, m) / g->unit;
        for (uint32_t b = 0; b < a; b++) {
            double d = -2 * (length[a] - length[b]) / g->sigma * pull[(size_t)a * n + b] * kernel[(size_t)a * n + b];
            slope[a] += d;
            slope[b] -= d;
        }
    }
    for (uint32_t a = 0; a < n; a++)
        for (uint32_t j = 0; j + 1 < m; j++) {
            size_t v = (size_t)a * m + j;
            double e[3], size = segment(points[v], points[v + 1], e);
            for (int c = 0; c < 3 && size > 0; c++) {
                float d = (float)(slope[a] * e[c] / size / g->unit);
                d_points[v + 1][c] += d;
                d_points[v][c] -= d;
            }
        }
}

/* Eqs. 16, 17, likewise. */
static void unfold_clump(const struct gradient_determinant *g, const float (*points)[3], const double *kernel,
                         const double *pull, float (*d_points)[3])
{
    uint32_t n = g->n, m = g->fit->m;
    for (uint32_t a = 0; a < n; a++)
        for (uint32_t b = 0; b < a; b++) {
            size_t p = (size_t)a * m, q = (size_t)b * m;
            double e[3], roots = fmax(segment(points[q], points[p], e) / g->unit, LEAST_ROOT_DISTANCE);
            double slope = -pull[(size_t)a * n + b] * kernel[(size_t)a * n + b] / (g->sigma * m * roots * g->unit);
            for (uint32_t j = 1; j < m; j++) {
                double size = segment(points[q + j], points[p + j], e);
                for (int c = 0; c < 3 && size > 0; c++) {
                    float d = (float)(slope * e[c] / size);
                    d_points[p + j][c] += d;
                    d_points[q + j][c] -= d;
                }
            }
        }
}

struct comparing {
    const struct gradient_determinant *g;
    uint32_t n_batches;
    const uint32_t *strand;         /* [n_batches][n] */
    float (*points)[3];             /* [n_batches][n][m]; of the groom, then what the loss changes by with them */
    float (*target)[3];             /* [threads][n][m], and room for as much */
    double *scratch;                /* [threads][3 n n + 2 n] */
    double *loss;                   /* [n_batches] */
};

static void kernel_of(const struct gradient_determinant *g, const float (*points)[3], double *kernel)
{
    determinant_kernel *fill = g->kind == GRADIENT_SCALE ? determinant_scale_kernel : determinant_clump_kernel;
    fill(points, g->n, g->fit->m, g->unit, g->sigma, kernel);
}

static void compare_batch(void *user, uint32_t batch, uint32_t thread)
{
    const struct comparing *job = user;
    const struct gradient_determinant *g = job->g;
    const struct groom_fit *fit = g->fit;
    size_t n = g->n, n_points = n * fit->m;
    double *kernel = job->scratch + thread * (3 * n * n + 2 * n), *spoilt = kernel + n * n, *inverse = spoilt + n * n;
    float (*points)[3] = job->points + batch * n_points, (*target)[3] = job->target + 2 * thread * n_points;
    float (*slope)[3] = target + n_points;
    const uint32_t *strand = job->strand + batch * n;
    for (size_t v = 0; v < n_points; v++)
        for (int c = 0; c < 3; c++)
            target[v][c] = fit->target[(size_t)strand[v / fit->m] * fit->m + v % fit->m][c] * fit->scale + fit->centre[c];
    kernel_of(g, (const float (*)[3])target, spoilt);
    double wanted = determinant_log(spoilt, g->n);
    kernel_of(g, (const float (*)[3])points, kernel);
    memcpy(spoilt, kernel, n * n * sizeof *spoilt);
    double off = determinant_log_inverse(spoilt, g->n, inverse) - wanted;
    memset(slope, 0, n_points * sizeof *slope);
    job->loss[batch] = isfinite(off) ? off * off : 0;
    for (size_t i = 0; i < n * n; i++) /* d(log det) = sum of K^-1_ab dK_ab, and each stands there twice */
        inverse[i] *= 4 * off / job->n_batches;
    if (isfinite(off) && g->kind == GRADIENT_SCALE)
        unfold_scale(g, (const float (*)[3])points, kernel, inverse, inverse + n * n, slope);
    else if (isfinite(off))
        unfold_clump(g, (const float (*)[3])points, kernel, inverse, slope);
    memcpy(points, slope, n_points * sizeof *points);
}

/* --- all batches ---------------------------------------------------------------------------------------- */

/* Each batch through the chain and, `back`, its points' gradient the same way; parameters' are summed up. */
static groom_status visit(const struct gradient_determinant *g, const struct comparing *job, int back,
                          struct groom_gradient *out, double (*sum)[GROOM_OPERATOR_MAX_PARAMETERS],
                          const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    for (uint32_t batch = 0; st == GROOM_OK && batch < job->n_batches; batch++) {
        struct replay replay = {g->fit->m, job->points + (size_t)batch * g->n * g->fit->m};
        st = groom_evaluate_gradient(g->fit->groom, job->strand + (size_t)batch * g->n, g->n,
                                     back ? replay_play(&replay) : replay_record(&replay), out, context, diag);
        for (uint32_t o = 0; o < out->n_operators; o++)
            for (int k = 0; k < GROOM_OPERATOR_MAX_PARAMETERS; k++)
                sum[o][k] += out->operators[o].parameter[k];
    }
    return st;
}

groom_status gradient_determinant_evaluate(struct gradient_determinant *g, uint32_t iteration, uint32_t n_batches,
                                           struct groom_gradient *out, double *loss, const struct groom_context *context,
                                           struct groom_diag *diag)
{
    size_t n = g->n, n_points = n * g->fit->m, threads = parallel_threads(context), n_scratch = threads * (3 * n * n + 2 * n);
    double forward[GROOM_FIT_MAX_OPERATORS][GROOM_OPERATOR_MAX_PARAMETERS] = {{0}};
    double sum[GROOM_FIT_MAX_OPERATORS][GROOM_OPERATOR_MAX_PARAMETERS] = {{0}};
    uint32_t *strand = memory_array(g->allocator, n_batches * n, sizeof *strand);
    struct groom_random_key key = {g->fit->options.seed, STREAM_BATCHES + g->kind};
    struct comparing job = {.g = g, .n_batches = n_batches, .strand = strand};
    groom_status st = GROOM_ENOMEM;
    job.points = memory_array(g->allocator, n_batches * n_points, sizeof *job.points);
    job.target = memory_array(g->allocator, threads * 2 * n_points, sizeof *job.target);
    job.scratch = memory_array(g->allocator, n_scratch, sizeof *job.scratch);
    job.loss = memory_array(g->allocator, n_batches, sizeof *job.loss);
    if (!strand || !job.points || !job.target || !job.scratch || !job.loss) {
        groom_fail(diag, st, "no memory for %u batches of %u strands", n_batches, g->n);
        goto out;
    }
    if ((st = determinant_draw(g->neighbours, (const float (*)[2])g->fit->root_uv, g->fit->n, iteration * n_batches,
                               n_batches, g->n, key, context, strand, diag)) != GROOM_OK ||
        (st = visit(g, &job, 0, out, forward, context, diag)) != GROOM_OK)
        goto out;
    parallel_for(context, n_batches, compare_batch, &job);
    if ((st = visit(g, &job, 1, out, sum, context, diag)) != GROOM_OK)
        goto out;
    *loss = 0;
    for (uint32_t batch = 0; batch < n_batches; batch++)
        *loss += job.loss[batch] / n_batches;
    for (uint32_t o = 0; o < out->n_operators; o++)
        memcpy(out->operators[o].parameter, sum[o], sizeof sum[o]);
out:
    memory_release(g->allocator, strand, n_batches * n, sizeof *strand);
    memory_release(g->allocator, job.points, n_batches * n_points, sizeof *job.points);
    memory_release(g->allocator, job.target, threads * 2 * n_points, sizeof *job.target);
    memory_release(g->allocator, job.scratch, n_scratch, sizeof *job.scratch);
    memory_release(g->allocator, job.loss, n_batches, sizeof *job.loss);
    return st;
}
