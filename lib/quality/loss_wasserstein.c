/* The strand shape losses of Chang et al. 2025, Section 5.5: products of matrices and sorting. */
#include "quality/loss_wasserstein.h"

#include <cblas.h>
#include <math.h>

#include "base/blas.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/radix.h"
#include "quality/waves.h"

#define DIRECTIONS_PER_PIECE 16
#define STRANDS_PER_PIECE 256

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }
static uint32_t pieces_of(uint32_t n, uint32_t per_piece) { return n / per_piece + (n % per_piece != 0); }

/* --- Eq. 11 ----------------------------------------------------------------------------- */

struct slicing {
    const float *a, *b;
    uint32_t n, d, n_directions;
    struct groom_random_key key;
    float *scratch;     /* for each thread: directions, projections of a and of b, room to sort */
    size_t per_thread;
    double *sums;       /* [n_directions] */
};

void loss_wasserstein_direction(struct groom_random_key key, uint32_t index, uint32_t d, float *direction)
{
    double square = 0;
    for (uint32_t i = 0; i < d; i++) {
        direction[i] = (float)groom_random_normal(key, index, i);
        square += (double)direction[i] * direction[i];
    }
    float scale = square > 0 ? (float)(1 / sqrt(square)) : 0;
    for (uint32_t i = 0; i < d; i++)
        direction[i] *= scale;
}

static void slice_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct slicing *job = user;
    uint32_t first = piece * DIRECTIONS_PER_PIECE, count = least(job->n_directions - first, DIRECTIONS_PER_PIECE);
    int n = (int)job->n, d = (int)job->d;
    float *directions = job->scratch + thread * job->per_thread;
    float *of_a = directions + (size_t)DIRECTIONS_PER_PIECE * job->d, *of_b = of_a + (size_t)DIRECTIONS_PER_PIECE * job->n;
    float *spare = of_b + (size_t)DIRECTIONS_PER_PIECE * job->n;
    for (uint32_t k = 0; k < count; k++)
        loss_wasserstein_direction(job->key, first + k, job->d, directions + (size_t)k * job->d);
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)count, n, d, 1, directions, d, job->a, d, 0, of_a, n);
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)count, n, d, 1, directions, d, job->b, d, 0, of_b, n);
    for (uint32_t k = 0; k < count; k++) {
        float *p = of_a + (size_t)k * job->n, *q = of_b + (size_t)k * job->n;
        double sum = 0;
        radix_sort_floats(p, spare, job->n);
        radix_sort_floats(q, spare, job->n);
        for (uint32_t i = 0; i < job->n; i++)
            sum += ((double)p[i] - q[i]) * ((double)p[i] - q[i]);
        job->sums[first + k] = sum;
    }
}

groom_status loss_wasserstein(const float *a, const float *b, uint32_t n, uint32_t d, uint32_t n_directions,
                              struct groom_random_key key, const struct groom_context *context, double *loss,
                              struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct slicing job = {.a = a, .b = b, .n = n, .d = d, .n_directions = n_directions ? n_directions : d, .key = key};
    size_t n_scratch;
    double sum = 0;
    groom_status st = blas_prepare(context, diag);
    if (st != GROOM_OK)
        return st;
    job.per_thread = (size_t)DIRECTIONS_PER_PIECE * (d + 2 * (size_t)n) + n;
    n_scratch = job.per_thread * parallel_threads(context);
    job.scratch = memory_array(allocator, n_scratch, sizeof *job.scratch);
    job.sums = memory_array(allocator, job.n_directions, sizeof *job.sums);
    st = job.scratch && job.sums ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to compare %u strands", n);
    if (st == GROOM_OK) {
        parallel_for(context, pieces_of(job.n_directions, DIRECTIONS_PER_PIECE), slice_piece, &job);
        for (uint32_t k = 0; k < job.n_directions; k++)
            sum += job.sums[k];
        *loss = sum / job.n_directions / n;
    }
    memory_release(allocator, job.scratch, n_scratch, sizeof *job.scratch);
    memory_release(allocator, job.sums, job.n_directions, sizeof *job.sums);
    return st;
}

/* --- Eq. 12 -------------------------------------------------------------------------------- */

struct transforming {
    const float (*points)[3];
    uint32_t n, m;
    double unit;
    const float *waves;          /* [2 h][m-1] cosines, then sines */
    float *segments, *magnitudes;
    float *scratch;              /* for each thread: [3 STRANDS_PER_PIECE][2 h] */
};

static uint32_t half_of(uint32_t m) { return waves_count(m - 1); }

static void transform_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct transforming *job = user;
    uint32_t first = piece * STRANDS_PER_PIECE, count = least(job->n - first, STRANDS_PER_PIECE), n = job->m - 1;
    uint32_t h = half_of(job->m);
    float *waves = job->scratch + (size_t)thread * 3 * STRANDS_PER_PIECE * 2 * h;
    float *segments = job->segments + (size_t)first * 3 * n, *magnitudes = job->magnitudes + (size_t)first * 3 * h;
    for (uint32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            for (uint32_t j = 0; j < n; j++) {
                const float (*p)[3] = job->points + (size_t)(first + i) * job->m + j;
                segments[((size_t)i * 3 + (size_t)c) * n + j] = (float)(((double)p[1][c] - p[0][c]) / job->unit);
            }
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)(3 * count), (int)(2 * h), (int)n, 1, segments, (int)n,
                job->waves, (int)n, 0, waves, (int)(2 * h));
    for (uint32_t row = 0; row < 3 * count; row++)
        for (uint32_t k = 0; k < h; k++) {
            float re = waves[(size_t)row * 2 * h + k], im = waves[(size_t)row * 2 * h + h + k];
            magnitudes[(size_t)row * h + k] = sqrtf(re * re + im * im);
        }
}

groom_status loss_shape_features(const float (*points)[3], uint32_t n, uint32_t m, double unit, float *segments,
                                 float *magnitudes, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_waves = (size_t)2 * half_of(m) * (m - 1);
    size_t n_scratch = (size_t)parallel_threads(context) * 3 * STRANDS_PER_PIECE * 2 * half_of(m);
    float *waves = memory_array(allocator, n_waves, sizeof *waves);
    struct transforming job = {.points = points, .n = n, .m = m, .unit = unit, .waves = waves, .segments = segments,
                               .magnitudes = magnitudes};
    job.scratch = memory_array(allocator, n_scratch, sizeof *job.scratch);
    groom_status st = waves && job.scratch ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for spectra of %u strands", n);
    if (st == GROOM_OK)
        st = blas_prepare(context, diag);
    if (st == GROOM_OK) {
        waves_fill(m - 1, half_of(m), waves);
        parallel_for(context, pieces_of(n, STRANDS_PER_PIECE), transform_piece, &job);
    }
    memory_release(allocator, waves, n_waves, sizeof *waves);
    memory_release(allocator, job.scratch, n_scratch, sizeof *job.scratch);
    return st;
}

groom_status loss_shape(const float (*a)[3], const float (*b)[3], uint32_t n, uint32_t m, double unit, double lambda_e,
                        struct groom_random_key key, const struct groom_context *context, struct loss_shape *loss,
                        struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t d_segments = 3 * (m - 1), d_spectra = 3 * half_of(m);
    size_t n_floats = (size_t)n * 2 * (d_segments + d_spectra);
    float *features = memory_array(allocator, n_floats, sizeof *features);
    struct groom_random_key other = {key.seed, key.stream + 1};
    groom_status st;
    if (!features)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to compare the shapes of %u strands", n);
    float *segments_a = features, *segments_b = segments_a + (size_t)n * d_segments;
    float *spectra_a = segments_b + (size_t)n * d_segments, *spectra_b = spectra_a + (size_t)n * d_spectra;
    if ((st = loss_shape_features(a, n, m, unit, segments_a, spectra_a, context, diag)) != GROOM_OK ||
        (st = loss_shape_features(b, n, m, unit, segments_b, spectra_b, context, diag)) != GROOM_OK ||
        (st = loss_wasserstein(spectra_a, spectra_b, n, d_spectra, 0, key, context, &loss->spectra, diag)) != GROOM_OK ||
        (st = loss_wasserstein(segments_a, segments_b, n, d_segments, 0, other, context, &loss->segments, diag)) != GROOM_OK)
        goto out;
    loss->total = loss->spectra + lambda_e * loss->segments;
out:
    memory_release(allocator, features, n_floats, sizeof *features);
    return st;
}
