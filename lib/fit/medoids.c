#include "fit/medoids.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "base/sort.h"
#include "geometry/kmeans.h"

#define ROWS_PER_PIECE 16
#define NONE UINT32_MAX

struct choice {
    const float *x;
    uint32_t n, d, k;
    float *between;                /* [n][n] distances */
    uint32_t *medoids;             /* [k] */
    uint32_t *slot;                /* [n] which medoid a row is, or NONE */
    uint32_t *nearest, *second;    /* [n] slots of the two nearest medoids; second NONE where k = 1 */
    float *d_nearest, *d_second;   /* [n] */
    double *removal;               /* [k] what taking a medoid away would cost */
    double *gain;                  /* [k] of one candidate in place of each */
};

static float distance(const struct choice *c, uint32_t a, uint32_t b) { return c->between[(size_t)a * c->n + b]; }

static void distances_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct choice *c = user;
    uint32_t begin = piece * ROWS_PER_PIECE;
    (void)thread;
    for (uint32_t a = begin; a < c->n && a < begin + ROWS_PER_PIECE; a++)
        for (uint32_t b = 0; b < c->n; b++) {
            /* lower index first, so that the matrix is symmetric to the bit */
            const float *restrict p = c->x + (size_t)(a < b ? a : b) * c->d;
            const float *restrict q = c->x + (size_t)(a < b ? b : a) * c->d;
            float sum[8] = {0};
            uint32_t i = 0;
            for (; i + 8 <= c->d; i += 8)
                for (uint32_t l = 0; l < 8; l++)
                    sum[l] += (p[i + l] - q[i + l]) * (p[i + l] - q[i + l]);
            for (; i < c->d; i++)
                sum[0] += (p[i] - q[i]) * (p[i] - q[i]);
            c->between[(size_t)a * c->n + b] =
                sqrtf(((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7])));
        }
}

/* The two nearest medoids of row i, anew. */
static void find_nearest(struct choice *c, uint32_t i)
{
    uint32_t first = NONE, second = NONE;
    float d_first = INFINITY, d_second = INFINITY;
    for (uint32_t s = 0; s < c->k; s++) {
        float value = distance(c, i, c->medoids[s]);
        if (first == NONE || value < d_first) {
            second = first;
            d_second = d_first;
            first = s;
            d_first = value;
        } else if (second == NONE || value < d_second) {
            second = s;
            d_second = value;
        }
    }
    c->nearest[i] = first;
    c->second[i] = second;
    c->d_nearest[i] = d_first;
    c->d_second[i] = d_second;
}

static void sum_removals(struct choice *c)
{
    memset(c->removal, 0, c->k * sizeof *c->removal);
    for (uint32_t i = 0; i < c->n; i++)
        c->removal[c->nearest[i]] += (double)c->d_second[i] - c->d_nearest[i];
}

static double mean_distance(const struct choice *c)
{
    double sum = 0;
    for (uint32_t i = 0; i < c->n; i++)
        sum += c->d_nearest[i];
    return sum / c->n;
}

/* The change of the sum of distances where row x takes the place of the medoid that is best to go. */
static double best_swap(struct choice *c, uint32_t x, uint32_t *slot)
{
    const float *to = c->between + (size_t)x * c->n;
    double shared = 0;
    memcpy(c->gain, c->removal, c->k * sizeof *c->gain);
    for (uint32_t i = 0; i < c->n; i++) {
        if (to[i] < c->d_nearest[i]) {
            shared += (double)to[i] - c->d_nearest[i];
            c->gain[c->nearest[i]] += (double)c->d_nearest[i] - c->d_second[i];
        } else if (to[i] < c->d_second[i]) {
            c->gain[c->nearest[i]] += (double)to[i] - c->d_second[i];
        }
    }
    uint32_t best = 0;
    for (uint32_t s = 1; s < c->k; s++)
        if (c->gain[s] < c->gain[best])
            best = s;
    *slot = best;
    return shared + c->gain[best];
}

static void swap(struct choice *c, uint32_t slot, uint32_t x)
{
    c->slot[c->medoids[slot]] = NONE;
    c->medoids[slot] = x;
    c->slot[x] = slot;
    for (uint32_t i = 0; i < c->n; i++) {
        float value = distance(c, i, x);
        if (c->nearest[i] == slot || c->second[i] == slot) {
            find_nearest(c, i);
        } else if (value < c->d_nearest[i]) {
            c->second[i] = c->nearest[i];
            c->d_second[i] = c->d_nearest[i];
            c->nearest[i] = slot;
            c->d_nearest[i] = value;
        } else if (value < c->d_second[i]) {
            c->second[i] = slot;
            c->d_second[i] = value;
        }
    }
    sum_removals(c);
}

/* returns how many swaps were taken */
static uint32_t pass(struct choice *c)
{
    /* below what rounding can feign: a swap back and forth would never end */
    double least = 1e-6 * c->n * (mean_distance(c) + 1e-30);
    uint32_t n_swaps = 0, slot;
    for (uint32_t x = 0; x < c->n; x++)
        if (c->slot[x] == NONE && best_swap(c, x, &slot) < -least) {
            swap(c, slot, x);
            n_swaps++;
        }
    return n_swaps;
}

/* Rows at fewer than k places: the lowest rows that are none yet fill up. */
static void fill_up(struct choice *c, uint32_t n_chosen)
{
    for (uint32_t i = 0; i < c->n; i++)
        c->slot[i] = NONE;
    for (uint32_t s = 0; s < n_chosen; s++)
        c->slot[c->medoids[s]] = s;
    for (uint32_t i = 0; n_chosen < c->k; i++)
        if (c->slot[i] == NONE) {
            c->slot[i] = n_chosen;
            c->medoids[n_chosen++] = i;
        }
}

static int allocate(struct choice *c, const struct groom_allocator *allocator)
{
    c->between = memory_array(allocator, (size_t)c->n * c->n, sizeof *c->between);
    c->slot = memory_array(allocator, c->n, sizeof *c->slot);
    c->nearest = memory_array(allocator, c->n, sizeof *c->nearest);
    c->second = memory_array(allocator, c->n, sizeof *c->second);
    c->d_nearest = memory_array(allocator, c->n, sizeof *c->d_nearest);
    c->d_second = memory_array(allocator, c->n, sizeof *c->d_second);
    c->removal = memory_array(allocator, c->k, sizeof *c->removal);
    c->gain = memory_array(allocator, c->k, sizeof *c->gain);
    return c->between && c->slot && c->nearest && c->second && c->d_nearest && c->d_second && c->removal && c->gain;
}

static void release(struct choice *c, const struct groom_allocator *allocator)
{
    memory_release(allocator, c->between, (size_t)c->n * c->n, sizeof *c->between);
    memory_release(allocator, c->slot, c->n, sizeof *c->slot);
    memory_release(allocator, c->nearest, c->n, sizeof *c->nearest);
    memory_release(allocator, c->second, c->n, sizeof *c->second);
    memory_release(allocator, c->d_nearest, c->n, sizeof *c->d_nearest);
    memory_release(allocator, c->d_second, c->n, sizeof *c->d_second);
    memory_release(allocator, c->removal, c->k, sizeof *c->removal);
    memory_release(allocator, c->gain, c->k, sizeof *c->gain);
}

/* The one medoid of all rows: no second to compare with. */
static void choose_single(struct choice *c)
{
    double least = INFINITY;
    for (uint32_t a = 0; a < c->n; a++) {
        double sum = 0;
        for (uint32_t b = 0; b < c->n; b++)
            sum += distance(c, a, b);
        if (sum < least) {
            least = sum;
            c->medoids[0] = a;
        }
    }
    for (uint32_t i = 0; i < c->n; i++)
        find_nearest(c, i);
}

static groom_status improve(struct choice *c, uint32_t max_passes, const struct groom_context *context,
                            double *before, double *after, struct groom_diag *diag)
{
    for (uint32_t i = 0; i < c->n; i++)
        find_nearest(c, i);
    if (before)
        *before = mean_distance(c);
    if (c->k == 1)
        choose_single(c);
    else
        sum_removals(c);
    for (uint32_t p = 0; p < max_passes && c->k > 1; p++) {
        if (progress_cancelled(context))
            return groom_fail(diag, GROOM_ECANCELLED, "cancelled in K-medoids");
        if (pass(c) == 0)
            break;
    }
    if (after)
        *after = mean_distance(c);
    return GROOM_OK;
}

groom_status medoids_choose(const float *x, uint32_t n, uint32_t d, uint32_t k, uint32_t max_passes,
                            struct groom_random_key key, const struct groom_context *context, uint32_t *medoids,
                            double *before, double *after, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct choice c = {.x = x, .n = n, .d = d, .k = k, .medoids = medoids};
    uint32_t n_chosen;
    groom_status st;

    if (!allocate(&c, allocator)) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to choose %u of %u medoids", k, n);
        goto out;
    }
    if ((st = kmeans_seed(x, n, d, k, key, context, medoids, &n_chosen, diag)) != GROOM_OK)
        goto out;
    fill_up(&c, n_chosen);
    parallel_for(context, (n + ROWS_PER_PIECE - 1) / ROWS_PER_PIECE, distances_piece, &c);
    if ((st = improve(&c, max_passes, context, before, after, diag)) != GROOM_OK)
        goto out;
    sort_indices(medoids, k);
out:
    release(&c, allocator);
    return st;
}
