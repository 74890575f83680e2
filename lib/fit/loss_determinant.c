/* The strand correlation losses of Chang et al. 2025, Section 5.5. */
#include "fit/loss_determinant.h"

#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "fit/dense.h"
#include "groom/spatial.h"
#include "groom/strands.h"

#define LEAST_ROOT_DISTANCE 1e-4 /* units */

/* --- kernels ---------------------------------------------------------------------- */

void determinant_scale_kernel(const float (*points)[3], uint32_t n, uint32_t m, double unit, double sigma,
                              double *kernel)
{
    for (uint32_t a = 0; a < n; a++) /* lengths wait on the diagonal */
        kernel[(size_t)a * n + a] = groom_polyline_length(points + (size_t)a * m, m) / unit;
    for (uint32_t a = 0; a < n; a++)
        for (uint32_t b = 0; b < a; b++) {
            double d = kernel[(size_t)a * n + a] - kernel[(size_t)b * n + b];
            kernel[(size_t)a * n + b] = exp(-d * d / sigma);
        }
    for (uint32_t a = 0; a < n; a++)
        kernel[(size_t)a * n + a] = 1;
}

static double distance(const float a[3], const float b[3])
{
    float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return (double)sqrtf(x * x + y * y + z * z);
}

void determinant_clump_kernel(const float (*points)[3], uint32_t n, uint32_t m, double unit, double sigma,
                              double *kernel)
{
    for (uint32_t a = 0; a < n; a++) {
        const float (*p)[3] = points + (size_t)a * m;
        for (uint32_t b = 0; b < a; b++) {
            const float (*q)[3] = points + (size_t)b * m;
            double sum = 0, roots = fmax(distance(p[0], q[0]) / unit, LEAST_ROOT_DISTANCE);
            for (uint32_t j = 0; j < m; j++)
                sum += distance(p[j], q[j]);
            kernel[(size_t)a * n + b] = exp(-sum / unit / m / roots / sigma);
        }
        kernel[(size_t)a * n + a] = 1;
    }
}

/* --- determinants ------------------------------------------------------------------- */

/* Cholesky's factor in the lower triangle. The upper one holds the kernel for another try, with ten times
 * the epsilon: CD is no metric, and where roots nearly meet its kernel has eigenvalues well below 0. */
static int factor(double *kernel, uint32_t n)
{
    for (uint32_t a = 0; a < n; a++)
        for (uint32_t b = 0; b < a; b++)
            kernel[(size_t)b * n + a] = kernel[(size_t)a * n + b];
    for (double epsilon = DETERMINANT_EPSILON; epsilon < 10.0 * n; epsilon *= 10) {
        for (uint32_t a = 0; a < n; a++) {
            for (uint32_t b = 0; b < a; b++)
                kernel[(size_t)a * n + b] = kernel[(size_t)b * n + a];
            kernel[(size_t)a * n + a] = 1 + epsilon;
        }
        if (dense_cholesky(kernel, n))
            return 1;
    }
    return 0;
}

double determinant_log(double *kernel, uint32_t n)
{
    double sum = 0;
    if (!factor(kernel, n))
        return -INFINITY;
    for (uint32_t i = 0; i < n; i++)
        sum += log(kernel[(size_t)i * n + i]);
    return 2 * sum;
}

double determinant_log_inverse(double *kernel, uint32_t n, double *inverse)
{
    double value = determinant_log(kernel, n);
    if (value == -INFINITY)
        return value;
    for (uint32_t a = 0; a < n; a++) { /* symmetric: column by column is row by row */
        double *row = inverse + (size_t)a * n;
        for (uint32_t b = 0; b < n; b++)
            row[b] = a == b;
        dense_forward(kernel, n, row);
        dense_backward(kernel, n, row);
    }
    return value;
}

struct comparing {
    const float (*a)[3], (*b)[3];
    uint32_t n, m;
    double unit, sigma;
    determinant_kernel *kernel;
    double *scratch;    /* [threads][n * n] */
    double *difference; /* [n_batches] */
};

static void compare_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct comparing *job = user;
    size_t first = (size_t)piece * job->n * job->m;
    double *kernel = job->scratch + (size_t)thread * job->n * job->n, of_a;
    job->kernel(job->a + first, job->n, job->m, job->unit, job->sigma, kernel);
    of_a = determinant_log(kernel, job->n);
    job->kernel(job->b + first, job->n, job->m, job->unit, job->sigma, kernel);
    job->difference[piece] = of_a - determinant_log(kernel, job->n);
}

groom_status loss_determinant(const float (*a)[3], const float (*b)[3], uint32_t n_batches, uint32_t n, uint32_t m,
                              double unit, double sigma, determinant_kernel *kernel,
                              const struct groom_context *context, double *loss, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct comparing job = {.a = a, .b = b, .n = n, .m = m, .unit = unit, .sigma = sigma, .kernel = kernel};
    size_t n_scratch = (size_t)parallel_threads(context) * n * n;
    double sum = 0;
    job.scratch = memory_array(allocator, n_scratch, sizeof *job.scratch);
    job.difference = memory_array(allocator, n_batches, sizeof *job.difference);
    groom_status st = job.scratch && job.difference ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for kernels of %u strands", n);
    if (st == GROOM_OK) {
        parallel_for(context, n_batches, compare_piece, &job);
        for (uint32_t i = 0; i < n_batches; i++)
            sum += job.difference[i] * job.difference[i];
        *loss = sum / n_batches;
    }
    memory_release(allocator, job.scratch, n_scratch, sizeof *job.scratch);
    memory_release(allocator, job.difference, n_batches, sizeof *job.difference);
    return st;
}

/* --- batches ---------------------------------------------------------------------------- */

groom_status determinant_draw(const struct groom_neighbours *neighbours, const float (*root_uv)[2], uint32_t n_strands,
                              uint32_t index, uint32_t n_batches, uint32_t n, struct groom_random_key key,
                              const struct groom_context *context, uint32_t *strand, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    float (*middle)[2] = memory_array(allocator, n_batches, sizeof *middle);
    groom_status st = middle ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for %u batches", n_batches);
    for (uint32_t i = 0; st == GROOM_OK && i < n_batches; i++) {
        const float *uv = root_uv[groom_random_below(key, index + i, 0, n_strands)];
        middle[i][0] = uv[0], middle[i][1] = uv[1];
    }
    if (st == GROOM_OK)
        st = groom_neighbours_find(neighbours, middle[0], n_batches, n, strand, NULL, context, diag);
    memory_release(allocator, middle, n_batches, sizeof *middle);
    return st;
}

groom_status determinant_batches(const float (*root_uv)[2], uint32_t n_strands, uint32_t n_batches, uint32_t n,
                                 struct groom_random_key key, const struct groom_context *context, uint32_t *strand,
                                 struct groom_diag *diag)
{
    struct groom_neighbours *neighbours = NULL;
    groom_status st = groom_neighbours_create(root_uv[0], n_strands, 2, context, &neighbours, diag);
    if (st == GROOM_OK)
        st = determinant_draw(neighbours, root_uv, n_strands, 0, n_batches, n, key, context, strand, diag);
    groom_neighbours_destroy(neighbours);
    return st;
}
