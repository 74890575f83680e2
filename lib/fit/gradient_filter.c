#include "fit/gradient_filter.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#include "base/blas.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "groom/spatial.h"

#define DIRECTIONS 32
#define GOLDEN_ANGLE 2.39996322972865332
#define MOST_ITERATIONS 1000
#define TOLERANCE 1e-16      /* of a squared residual, over that of the right-hand side, which is 1 */
#define COLUMNS_PER_PIECE 32

/* --- (I + lambda L)^-1 ------------------------------------------------------------------------- */

struct smoothing {
    const struct groom_triangulation *triangulation;
    double lambda;
    uint32_t n;
    double *scratch; /* [threads][4 n] */
    float *out;      /* [n][n] */
};

static void add_edge(double lambda, uint32_t a, uint32_t b, const double *x, double *y)
{
    double d = lambda * (x[a] - x[b]);
    y[a] += d;
    y[b] -= d;
}

/* Guides with one root are neighbours of the first of them. */
static void multiply(const struct smoothing *job, const double *x, double *y)
{
    const struct groom_triangulation *t = job->triangulation;
    memcpy(y, x, job->n * sizeof *y);
    for (uint32_t e = 0; e < t->n_edges; e++)
        add_edge(job->lambda, t->edges[e][0], t->edges[e][1], x, y);
    for (uint32_t g = 0; g < job->n; g++)
        if (t->same_as[g] != g)
            add_edge(job->lambda, g, t->same_as[g], x, y);
}

static double dot(const double *a, const double *b, uint32_t n)
{
    double sum = 0;
    for (uint32_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* A column of the inverse, which is symmetric, by conjugate gradients. */
static void invert_column(void *user, uint32_t column, uint32_t thread)
{
    const struct smoothing *job = user;
    uint32_t n = job->n;
    double *x = job->scratch + (size_t)thread * 4 * n, *r = x + n, *p = r + n, *ap = p + n, square = 1;
    memset(x, 0, (size_t)3 * n * sizeof *x);
    r[column] = p[column] = 1;
    for (int k = 0; k < MOST_ITERATIONS && square > TOLERANCE; k++) {
        multiply(job, p, ap);
        double step = square / dot(p, ap, n), before = square;
        for (uint32_t i = 0; i < n; i++) {
            x[i] += step * p[i];
            r[i] -= step * ap[i];
        }
        square = dot(r, r, n);
        for (uint32_t i = 0; i < n; i++)
            p[i] = r[i] + square / before * p[i];
    }
    for (uint32_t i = 0; i < n; i++)
        job->out[(size_t)column * n + i] = (float)x[i];
}

/* --- directions ------------------------------------------------------------------------------------ */

static void splat(const float direction[3], double sigma, float splats[DIRECTIONS])
{
    for (int q = 0; q < DIRECTIONS; q++) { /* a spiral over the sphere */
        double z = 1 - (2 * q + 1.0) / DIRECTIONS, r = sqrt(1 - z * z), square = 0;
        double at[3] = {r * cos(q * GOLDEN_ANGLE), r * sin(q * GOLDEN_ANGLE), z};
        for (int c = 0; c < 3; c++)
            square += ((double)direction[c] - at[c]) * ((double)direction[c] - at[c]);
        splats[q] = (float)exp(-square / (2 * sigma * sigma));
    }
}

/* Rows that nobody shares a direction with stay their own. */
static void weigh_row(const float *listens, const float *says, uint32_t n, uint32_t a, float *row)
{
    double sum = 0;
    for (uint32_t b = 0; b < n; b++) {
        double weight = 0;
        for (int q = 0; q < DIRECTIONS; q++)
            weight += (double)listens[(size_t)a * DIRECTIONS + q] * says[(size_t)b * DIRECTIONS + q];
        row[b] = (float)(fmax((double)row[b], 0) * weight);
        sum += (double)row[b];
    }
    for (uint32_t b = 0; b < n; b++)
        row[b] = sum > 1e-30 ? (float)((double)row[b] / sum) : (float)(a == b);
}

/* --- the filter --------------------------------------------------------------------------------------- */

groom_status gradient_filter(const float (*uv)[2], const float (*direction)[3], uint32_t n,
                             struct gradient_filter_widths widths, float *filter, const struct groom_context *context,
                             struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_scratch = (size_t)4 * n * parallel_threads(context), n_splats = (size_t)2 * n * DIRECTIONS;
    struct smoothing job = {.lambda = widths.lambda, .n = n, .out = filter};
    struct groom_triangulation *triangulation = NULL;
    groom_status st = blas_prepare(context, diag); /* for those who apply it */
    if (st == GROOM_OK)
        st = groom_triangulation_create(uv, n, context, &triangulation, diag);
    if (st != GROOM_OK)
        return st;
    float *says = memory_array(allocator, n_splats, sizeof *says), *listens;
    job.triangulation = triangulation;
    job.scratch = memory_array(allocator, n_scratch, sizeof *job.scratch);
    if (!says || !job.scratch) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to filter gradients of %u guides", n);
        goto out;
    }
    listens = says + (size_t)n * DIRECTIONS;
    for (uint32_t g = 0; g < n; g++) {
        splat(direction[g], widths.sigma_d, says + (size_t)g * DIRECTIONS);
        splat(direction[g], widths.sigma_phi, listens + (size_t)g * DIRECTIONS);
    }
    parallel_for(context, n, invert_column, &job);
    for (uint32_t a = 0; a < n; a++)
        weigh_row(listens, says, n, a, filter + (size_t)a * n);
out:
    memory_release(allocator, says, n_splats, sizeof *says);
    memory_release(allocator, job.scratch, n_scratch, sizeof *job.scratch);
    groom_triangulation_destroy(triangulation);
    return st;
}

struct applying { const float *filter, *rows; uint32_t n, width; float *out; };

static void apply_columns(void *user, uint32_t piece, uint32_t thread)
{
    const struct applying *job = user;
    uint32_t first = piece * COLUMNS_PER_PIECE, left = job->width - first;
    int n = (int)job->n, width = (int)job->width, count = (int)(left < COLUMNS_PER_PIECE ? left : COLUMNS_PER_PIECE);
    (void)thread;
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, n, count, n, 1, job->filter, n, job->rows + first, width, 0,
                job->out + first, width);
}

void gradient_filter_apply(const float *filter, const float *rows, uint32_t n, uint32_t width, float *out,
                           const struct groom_context *context)
{
    struct applying job = {filter, rows, n, width, out};
    parallel_for(context, width / COLUMNS_PER_PIECE + (width % COLUMNS_PER_PIECE != 0), apply_columns, &job);
}
