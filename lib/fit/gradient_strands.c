#include "fit/gradient_strands.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#include "base/blas.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "quality/waves.h"

#define UNIT 0.1 /* metres on an ordinary head */
#define LEAST_LENGTH 1e-12
#define LEAST_MAGNITUDE 1e-6f

enum { ROWS = 3 * GROOM_GRADIENT_PIECE };

struct gradient_strands {
    const struct groom_fit *fit;
    const struct groom_allocator *allocator;
    uint32_t n_segments, n_waves, n_pieces;
    float *waves;      /* [2 n_waves][n_segments] cosines, then sines */
    float *direction;  /* [n][3][n_segments] of the target */
    float *magnitude;  /* [n][3][n_waves] of their transforms */
    float *length;     /* [n] metres */
    double *loss;      /* [n_pieces] */
    int out_of_memory; /* set by a piece */
};

/* --- directions and their transforms ------------------------------------------------------- */

/* Unit directions [3][n] of a polyline; its segments' lengths [n], and their sum. */
static double directions_of(const float (*x)[3], uint32_t n, double scale, float *direction, float *length)
{
    double sum = 0;
    for (uint32_t j = 0; j < n; j++) {
        double e[3], square = 0;
        for (int c = 0; c < 3; c++) {
            e[c] = scale * ((double)x[j + 1][c] - x[j][c]);
            square += e[c] * e[c];
        }
        length[j] = (float)sqrt(square);
        sum += sqrt(square);
        for (int c = 0; c < 3; c++)
            direction[(size_t)c * n + j] = square > LEAST_LENGTH * LEAST_LENGTH ? (float)(e[c] / sqrt(square)) : 0;
    }
    return sum;
}

static float magnitude_of(const float *transform, uint32_t h, uint32_t k)
{
    return sqrtf(transform[k] * transform[k] + transform[h + k] * transform[h + k]);
}

static void transform_rows(const struct gradient_strands *g, const float *rows, uint32_t n_rows, float *out)
{
    int n = (int)g->n_segments, h2 = 2 * (int)g->n_waves;
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)n_rows, h2, n, 1, rows, n, g->waves, n, 0, out, h2);
}

/* --- the loss of a piece ---------------------------------------------------------------------- */

struct scratch { float *direction, *length, *transform, *d_direction; };

static size_t scratch_floats(const struct gradient_strands *g)
{
    return (size_t)ROWS * (2 * (size_t)g->n_segments + 2 * g->n_waves) + (size_t)GROOM_GRADIENT_PIECE * g->n_segments;
}

/* Spectra of n strands: their loss; the adjoint of their directions. */
static double add_spectra(const struct gradient_strands *g, uint32_t first, uint32_t n, const struct scratch *s)
{
    uint32_t h = g->n_waves;
    double loss = 0;
    transform_rows(g, s->direction, 3 * n, s->transform);
    for (uint32_t row = 0; row < 3 * n; row++) {
        float *t = s->transform + (size_t)row * 2 * h;
        const float *wanted = g->magnitude + ((size_t)3 * first + row) * h;
        for (uint32_t k = 0; k < h; k++) {
            float size = magnitude_of(t, h, k), off = size - wanted[k];
            float scale = size > LEAST_MAGNITUDE ? 2 * off / size : 0;
            loss += (double)off * off;
            t[k] *= scale;
            t[h + k] *= scale;
        }
    }
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)(3 * n), (int)g->n_segments, 2 * (int)h, 1, s->transform,
                2 * (int)h, g->waves, (int)g->n_segments, 0, s->d_direction, (int)g->n_segments);
    return loss;
}

/* Direction and length of one strand; the adjoint of its points, over the number of strands. */
static double add_strand(const struct gradient_strands *g, uint32_t strand, const float *direction, const float *length,
                         float *d_direction, double sum, float (*d_points)[3])
{
    const struct groom_fit *fit = g->fit;
    uint32_t n = g->n_segments;
    double unit = UNIT * fit->ordinary, lambda_d = fit->options.stages.randoms.lambda_d, dot = 0;
    double lambda_l = fit->options.stages.randoms.lambda_l, longer = (sum - g->length[strand]) / unit;
    const float *wanted = g->direction + (size_t)3 * n * strand;
    for (uint32_t i = 0; i < 3 * n; i++) {
        dot += (double)direction[i] * wanted[i];
        d_direction[i] -= (float)(lambda_d / n) * wanted[i];
    }
    memset(d_points, 0, ((size_t)n + 1) * sizeof *d_points);
    for (uint32_t j = 0; j < n; j++) {
        double along = 0;
        for (int c = 0; c < 3; c++)
            along += (double)direction[(size_t)c * n + j] * d_direction[(size_t)c * n + j];
        for (int c = 0; c < 3 && (double)length[j] > LEAST_LENGTH; c++) {
            double d = direction[(size_t)c * n + j];
            double de = (d_direction[(size_t)c * n + j] - along * d) / length[j] + 2 * lambda_l * longer / unit * d;
            d_points[j + 1][c] += (float)(de / fit->n);
            d_points[j][c] -= (float)(de / fit->n);
        }
    }
    return lambda_d * (1 - dot / n) + lambda_l * longer * longer;
}

static void evaluate_piece(void *user, uint32_t first, uint32_t n, const float (*points)[3], float (*d_points)[3])
{
    struct gradient_strands *g = user;
    uint32_t m = g->fit->m, n_segments = g->n_segments;
    double sum[GROOM_GRADIENT_PIECE], loss;
    size_t n_floats = scratch_floats(g);
    float *memory = memory_array(g->allocator, n_floats, sizeof *memory);
    if (!memory) {
        __atomic_store_n(&g->out_of_memory, 1, __ATOMIC_RELAXED);
        memset(d_points, 0, (size_t)n * m * sizeof *d_points);
        return;
    }
    struct scratch s = {.direction = memory};
    s.d_direction = s.direction + (size_t)ROWS * n_segments;
    s.transform = s.d_direction + (size_t)ROWS * n_segments;
    s.length = s.transform + (size_t)ROWS * 2 * g->n_waves;
    for (uint32_t i = 0; i < n; i++)
        sum[i] = directions_of(points + (size_t)i * m, n_segments, 1, s.direction + (size_t)3 * n_segments * i,
                               s.length + (size_t)n_segments * i);
    loss = add_spectra(g, first, n, &s);
    for (uint32_t i = 0; i < n; i++)
        loss += add_strand(g, first + i, s.direction + (size_t)3 * n_segments * i, s.length + (size_t)n_segments * i,
                           s.d_direction + (size_t)3 * n_segments * i, sum[i], d_points + (size_t)i * m);
    g->loss[first / GROOM_GRADIENT_PIECE] = loss;
    memory_release(g->allocator, memory, n_floats, sizeof *memory);
}

/* --- life --------------------------------------------------------------------------------------- */

struct measuring { struct gradient_strands *g; float *scratch; size_t per_thread; };

static void measure_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct measuring *job = user;
    struct gradient_strands *g = job->g;
    uint32_t first = piece * GROOM_GRADIENT_PIECE, n = g->n_segments, h = g->n_waves;
    float *transform = job->scratch + thread * job->per_thread, *length = transform + (size_t)6 * h;
    for (uint32_t i = first; i < g->fit->n && i < first + GROOM_GRADIENT_PIECE; i++) {
        float *direction = g->direction + (size_t)3 * n * i;
        g->length[i] = (float)directions_of((const float (*)[3])g->fit->target + (size_t)i * g->fit->m, n,
                                            g->fit->scale, direction, length);
        transform_rows(g, direction, 3, transform);
        for (uint32_t c = 0; c < 3; c++)
            for (uint32_t k = 0; k < h; k++)
                g->magnitude[((size_t)3 * i + c) * h + k] = magnitude_of(transform + (size_t)2 * h * c, h, k);
    }
}

static groom_status measure_target(struct gradient_strands *g, const struct groom_context *context)
{
    struct measuring job = {.g = g, .per_thread = (size_t)6 * g->n_waves + g->n_segments};
    size_t n_scratch = job.per_thread * parallel_threads(context);
    job.scratch = memory_array(g->allocator, n_scratch, sizeof *job.scratch);
    if (!job.scratch || blas_prepare(context, NULL) != GROOM_OK) {
        memory_release(g->allocator, job.scratch, n_scratch, sizeof *job.scratch);
        return GROOM_ENOMEM;
    }
    waves_fill(g->n_segments, g->n_waves, g->waves);
    parallel_for(context, g->n_pieces, measure_piece, &job);
    memory_release(g->allocator, job.scratch, n_scratch, sizeof *job.scratch);
    return GROOM_OK;
}

groom_status gradient_strands_create(const struct groom_fit *fit, const struct groom_context *context,
                                     struct gradient_strands **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct gradient_strands *g = memory_array_zero(allocator, 1, sizeof *g);
    uint32_t n = fit->m - 1, h = waves_count(n);
    groom_status st = GROOM_ENOMEM;
    if (!g)
        return groom_fail(diag, st, "no memory for a gradient");
    *g = (struct gradient_strands){.fit = fit, .allocator = allocator, .n_segments = n, .n_waves = h};
    g->n_pieces = (fit->n + GROOM_GRADIENT_PIECE - 1) / GROOM_GRADIENT_PIECE;
    g->waves = memory_array(allocator, (size_t)2 * h * n, sizeof *g->waves);
    g->direction = memory_array(allocator, (size_t)3 * n * fit->n, sizeof *g->direction);
    g->magnitude = memory_array(allocator, (size_t)3 * h * fit->n, sizeof *g->magnitude);
    g->length = memory_array(allocator, fit->n, sizeof *g->length);
    g->loss = memory_array(allocator, g->n_pieces, sizeof *g->loss);
    if (g->waves && g->direction && g->magnitude && g->length && g->loss)
        st = measure_target(g, context);
    if (st != GROOM_OK) {
        gradient_strands_destroy(g);
        return groom_fail(diag, st, "no memory for the gradient of %u strands", fit->n);
    }
    *out = g;
    return st;
}

void gradient_strands_destroy(struct gradient_strands *g)
{
    if (!g)
        return;
    memory_release(g->allocator, g->waves, (size_t)2 * g->n_waves * g->n_segments, sizeof *g->waves);
    memory_release(g->allocator, g->direction, (size_t)3 * g->n_segments * g->fit->n, sizeof *g->direction);
    memory_release(g->allocator, g->magnitude, (size_t)3 * g->n_waves * g->fit->n, sizeof *g->magnitude);
    memory_release(g->allocator, g->length, g->fit->n, sizeof *g->length);
    memory_release(g->allocator, g->loss, g->n_pieces, sizeof *g->loss);
    memory_release(g->allocator, g, 1, sizeof *g);
}

groom_status gradient_strands_evaluate(struct gradient_strands *g, struct groom_gradient *out, double *loss,
                                       const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_adjoint adjoint = {evaluate_piece, g};
    g->out_of_memory = 0;
    groom_status st = groom_evaluate_gradient(g->fit->groom, NULL, g->fit->n, adjoint, out, context, diag);
    if (st == GROOM_OK && g->out_of_memory)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the gradient of %u strands", g->fit->n);
    if (st != GROOM_OK)
        return st;
    *loss = 0;
    for (uint32_t p = 0; p < g->n_pieces; p++)
        *loss += g->loss[p] / g->fit->n;
    return GROOM_OK;
}
