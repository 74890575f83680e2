/* Lloyd's iteration: the distances of a piece of rows to all centres are one matrix product. */
#include "geometry/kmeans.h"

#include <cblas.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/blas.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"

#define ROWS_PER_PIECE 256
#define CENTRES_PER_PIECE 16

struct lloyd {
    const float *x;
    uint32_t n, d, k;
    const float *centres;
    const struct groom_context *context;
    float *half_norm;    /* [k] |c|^2 / 2 */
    float *products;     /* [threads][ROWS_PER_PIECE][k] */
    uint32_t *nearest;   /* [n] the new clusters */
    double *distance;    /* [n] squared, to the assigned centre */
    uint32_t *first;     /* [k + 1] where a cluster's rows begin in member */
    uint32_t *member;    /* [n] rows by cluster, ascending within one */
    double *sums;        /* [threads][d] */
    float *means;        /* [k][d] the new centres */
    atomic_int cancelled;
};

static uint32_t pieces_of(uint32_t n, uint32_t size) { return n / size + (n % size != 0); }
static uint32_t end_of(uint32_t piece, uint32_t n, uint32_t size)
{
    return n - piece * size < size ? n : (piece + 1) * size;
}

static double exact_distance(const float *a, const float *b, uint32_t d)
{
    double sum = 0;
    for (uint32_t i = 0; i < d; i++) {
        double difference = (double)a[i] - b[i];
        sum += difference * difference;
    }
    return sum;
}

/* Rounding of a product, as a share of |c|^2: of centres closer than that the nearest is told in double, so that
 * the same rows rounded another way go to the same centres. */
#define PRODUCT_ROUNDING 4e-6f

static uint32_t nearest_centre(const struct lloyd *l, const float *row, const float *products)
{
    uint32_t best = 0, next = 0;
    float least = INFINITY, second = INFINITY;
    for (uint32_t c = 0; c < l->k; c++) {
        float value = l->half_norm[c] - products[c];
        if (value >= second)
            continue;
        int leads = value < least;
        second = leads ? least : value;
        next = leads ? best : c;
        least = leads ? value : least;
        best = leads ? c : best;
    }
    if (second - least > PRODUCT_ROUNDING * (l->half_norm[best] + l->half_norm[next]))
        return best;
    double d_best = exact_distance(row, l->centres + (size_t)best * l->d, l->d);
    double d_next = exact_distance(row, l->centres + (size_t)next * l->d, l->d);
    return d_next < d_best || (d_next == d_best && next < best) ? next : best;
}

static void assign_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct lloyd *l = user;
    uint32_t begin = piece * ROWS_PER_PIECE, end = end_of(piece, l->n, ROWS_PER_PIECE);
    float *products = l->products + (size_t)thread * ROWS_PER_PIECE * l->k;
    if (atomic_load_explicit(&l->cancelled, memory_order_relaxed))
        return;
    if (thread == 0 && progress_cancelled(l->context)) {
        atomic_store(&l->cancelled, 1);
        return;
    }
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)(end - begin), (int)l->k, (int)l->d, 1.0f,
                l->x + (size_t)begin * l->d, (int)l->d, l->centres, (int)l->d, 0.0f, products, (int)l->k);
    for (uint32_t i = begin; i < end; i++) {
        uint32_t c = nearest_centre(l, l->x + (size_t)i * l->d, products + (size_t)(i - begin) * l->k);
        l->nearest[i] = c;
        l->distance[i] = exact_distance(l->x + (size_t)i * l->d, l->centres + (size_t)c * l->d, l->d);
    }
}

/* first[c + 1] - first[c] rows in cluster c, and which */
static void sort_members(struct lloyd *l)
{
    memset(l->first, 0, ((size_t)l->k + 1) * sizeof *l->first);
    for (uint32_t i = 0; i < l->n; i++)
        l->first[l->nearest[i] + 1]++;
    for (uint32_t c = 0; c < l->k; c++)
        l->first[c + 1] += l->first[c];
    for (uint32_t i = 0; i < l->n; i++)
        l->member[l->first[l->nearest[i]]++] = i;
    for (uint32_t c = l->k; c > 0; c--)
        l->first[c] = l->first[c - 1];
    l->first[0] = 0;
}

/* The row that its centre serves worst and whose cluster has others. */
static uint32_t worst_served(const struct lloyd *l)
{
    uint32_t worst = UINT32_MAX;
    for (uint32_t i = 0; i < l->n; i++) {
        uint32_t c = l->nearest[i];
        if (l->first[c + 1] - l->first[c] > 1 && (worst == UINT32_MAX || l->distance[i] > l->distance[worst]))
            worst = i;
    }
    return worst;
}

/* A row of its own for each cluster that lost all of its rows; its distance becomes 0. */
static uint32_t refill_empty(struct lloyd *l)
{
    uint32_t n_refilled = 0;
    for (uint32_t c = 0; c < l->k; c++) {
        if (l->first[c + 1] > l->first[c])
            continue;
        uint32_t i = worst_served(l);
        if (i == UINT32_MAX)
            break; /* fewer rows than clusters: the caller's mistake, harmless */
        l->nearest[i] = c;
        l->distance[i] = 0;
        sort_members(l);
        n_refilled++;
    }
    return n_refilled;
}

static void add_row(double *restrict sum, const float *restrict x, uint32_t d)
{
    for (uint32_t i = 0; i < d; i++)
        sum[i] += x[i];
}

static void mean_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct lloyd *l = user;
    uint32_t end = end_of(piece, l->k, CENTRES_PER_PIECE);
    double *sum = l->sums + (size_t)thread * l->d;
    for (uint32_t c = piece * CENTRES_PER_PIECE; c < end; c++) {
        double n = l->first[c + 1] - l->first[c];
        memset(sum, 0, l->d * sizeof *sum);
        for (uint32_t a = l->first[c]; a < l->first[c + 1]; a++)
            add_row(sum, l->x + (size_t)l->member[a] * l->d, l->d);
        for (uint32_t i = 0; i < l->d; i++)
            l->means[(size_t)c * l->d + i] = n > 0 ? (float)(sum[i] / n) : l->centres[(size_t)c * l->d + i];
    }
}

static int allocate(struct lloyd *l, const struct groom_allocator *allocator, uint32_t n_threads)
{
    l->half_norm = memory_array(allocator, l->k, sizeof *l->half_norm);
    l->products = memory_array(allocator, (size_t)n_threads * ROWS_PER_PIECE * l->k, sizeof *l->products);
    l->nearest = memory_array(allocator, l->n, sizeof *l->nearest);
    l->distance = memory_array(allocator, l->n, sizeof *l->distance);
    l->first = memory_array(allocator, (size_t)l->k + 1, sizeof *l->first);
    l->member = memory_array(allocator, l->n, sizeof *l->member);
    l->sums = memory_array(allocator, (size_t)n_threads * l->d, sizeof *l->sums);
    l->means = memory_array(allocator, (size_t)l->k * l->d, sizeof *l->means);
    return l->half_norm && l->products && l->nearest && l->distance && l->first && l->member && l->sums && l->means;
}

static void release(struct lloyd *l, const struct groom_allocator *allocator, uint32_t n_threads)
{
    memory_release(allocator, l->half_norm, l->k, sizeof *l->half_norm);
    memory_release(allocator, l->products, (size_t)n_threads * ROWS_PER_PIECE * l->k, sizeof *l->products);
    memory_release(allocator, l->nearest, l->n, sizeof *l->nearest);
    memory_release(allocator, l->distance, l->n, sizeof *l->distance);
    memory_release(allocator, l->first, (size_t)l->k + 1, sizeof *l->first);
    memory_release(allocator, l->member, l->n, sizeof *l->member);
    memory_release(allocator, l->sums, (size_t)n_threads * l->d, sizeof *l->sums);
    memory_release(allocator, l->means, (size_t)l->k * l->d, sizeof *l->means);
}

static void commit(struct lloyd *l, float *centres, uint32_t *cluster_of, struct kmeans_step *step)
{
    double sum = 0;
    step->n_changed = 0;
    for (uint32_t i = 0; i < l->n; i++) {
        sum += l->distance[i];
        step->n_changed += cluster_of[i] != l->nearest[i];
    }
    step->objective = sum / l->n;
    memcpy(cluster_of, l->nearest, l->n * sizeof *cluster_of);
    memcpy(centres, l->means, (size_t)l->k * l->d * sizeof *centres);
}

groom_status kmeans_iterate(const float *x, uint32_t n, uint32_t d, uint32_t k, float *centres, uint32_t *cluster_of,
                            const struct groom_context *context, struct kmeans_step *step, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_threads = parallel_threads(context);
    struct lloyd l = {.x = x, .n = n, .d = d, .k = k, .centres = centres, .context = context};
    groom_status st = GROOM_OK;

    atomic_init(&l.cancelled, 0);
    if ((st = blas_prepare(context, diag)) != GROOM_OK)
        return st;
    if (!allocate(&l, allocator, n_threads)) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for an iteration of K-means, %u rows, %u clusters", n, k);
        goto out;
    }
    for (uint32_t c = 0; c < k; c++) {
        const float *centre = centres + (size_t)c * d;
        double norm = 0;
        for (uint32_t i = 0; i < d; i++)
            norm += (double)centre[i] * centre[i];
        l.half_norm[c] = (float)(0.5 * norm);
    }
    parallel_for(context, pieces_of(n, ROWS_PER_PIECE), assign_piece, &l);
    if (atomic_load(&l.cancelled)) {
        st = groom_fail(diag, GROOM_ECANCELLED, "cancelled in K-means");
        goto out;
    }
    sort_members(&l);
    step->n_refilled = refill_empty(&l);
    parallel_for(context, pieces_of(k, CENTRES_PER_PIECE), mean_piece, &l);
    commit(&l, centres, cluster_of, step);
out:
    release(&l, allocator, n_threads);
    return st;
}

groom_status kmeans_means(const float *x, uint32_t n, uint32_t d, uint32_t k, const uint32_t *cluster_of, float *centres,
                          const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_threads = parallel_threads(context);
    struct lloyd l = {.x = x, .n = n, .d = d, .k = k, .centres = centres, .context = context};
    groom_status st = GROOM_OK;
    if (allocate(&l, allocator, n_threads)) {
        memcpy(l.nearest, cluster_of, n * sizeof *l.nearest);
        sort_members(&l);
        parallel_for(context, pieces_of(k, CENTRES_PER_PIECE), mean_piece, &l);
        memcpy(centres, l.means, (size_t)k * d * sizeof *centres);
    } else
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the means of %u rows, %u clusters", n, k);
    release(&l, allocator, n_threads);
    return st;
}
