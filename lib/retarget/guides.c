/* Guides: k-means over strands, and of each cluster the strand nearest to its centre (Wang et al. 2009, as
 * Section 5 asks for). A strand is its points at SAMPLES shares of its arc length. */
#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "base/sort.h"
#include "geometry/kmeans.h"
#include "retarget/source.h"

#define SAMPLES 8
#define WIDTH (3 * SAMPLES)
#define ITERATIONS 12
#define PIECE 512          /* strands */
#define SIZE 0.1           /* metres that count as 1: rows are best of a size near that */
#define STREAM 0x72746731u

struct features {
    const struct groom_retarget_source *source;
    float *rows;           /* [n_strands][WIDTH] */
};

static double segment(const float a[3], const float b[3])
{
    double x = (double)b[0] - a[0], y = (double)b[1] - a[1], z = (double)b[2] - a[2];
    return sqrt(x * x + y * y + z * z);
}

static void sample_strand(const struct groom_retarget_source *source, uint32_t strand, float *row)
{
    const uint32_t *first = &source->strands->first[strand];
    const float(*p)[3] = (const float(*)[3])source->strands->points + first[0];
    uint32_t n = first[1] - first[0], j = 0;
    double length = groom_polyline_length(p, n), arc = 0;
    for (int k = 0; k < SAMPLES; k++) {
        double at = length * k / (SAMPLES - 1), step;
        while (j + 2 < n && arc + (step = segment(p[j], p[j + 1])) < at) {
            arc += step;
            j++;
        }
        step = segment(p[j], p[j + 1]);
        double t = step > 0 ? (at - arc) / step : 0;
        t = t < 0 ? 0 : t > 1 ? 1 : t;
        for (int c = 0; c < 3; c++)
            row[3 * k + c] = (float)((p[j][c] + t * ((double)p[j + 1][c] - p[j][c]) - source->centre[c]) / SIZE);
    }
}

static void sample_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct features *features = user;
    uint32_t n = features->source->strands->n_strands;
    (void)thread;
    for (uint32_t i = piece * PIECE; i < n && i - piece * PIECE < PIECE; i++)
        sample_strand(features->source, i, features->rows + (size_t)i * WIDTH);
}

/* Of each cluster the row nearest to the centre, ties to the lower index. */
static void middles(const float *rows, uint32_t n, const float *centres, const uint32_t *cluster_of, double *best,
                    uint32_t *middle, uint32_t k)
{
    for (uint32_t c = 0; c < k; c++)
        best[c] = INFINITY;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t cluster = cluster_of[i];
        double sum = 0;
        for (int d = 0; d < WIDTH; d++) {
            double away = (double)rows[(size_t)i * WIDTH + d] - centres[(size_t)cluster * WIDTH + d];
            sum += away * away;
        }
        if (sum < best[cluster]) {
            best[cluster] = sum;
            middle[cluster] = i;
        }
    }
}

struct clusters {
    uint32_t wanted, k, *chosen, *cluster_of;
    float *rows, *centres;
    double *best;
};

static groom_status cluster(struct groom_retarget_source *source, struct clusters *c, const struct groom_context *context,
                            struct groom_diag *diag)
{
    uint32_t n = source->strands->n_strands;
    struct features features = {source, c->rows};
    struct groom_random_key key = {source->options.seed, STREAM};
    groom_status st;
    parallel_for(context, n / PIECE + 1, sample_piece, &features);
    if ((st = kmeans_seed(c->rows, n, WIDTH, c->wanted, key, context, c->chosen, &c->k, diag)) != GROOM_OK)
        return st;
    for (uint32_t i = 0; i < c->k; i++)
        for (int d = 0; d < WIDTH; d++)
            c->centres[(size_t)i * WIDTH + d] = c->rows[(size_t)c->chosen[i] * WIDTH + d];
    for (uint32_t i = 0; i < n; i++)
        c->cluster_of[i] = 0;
    for (int i = 0; i < ITERATIONS; i++) {
        struct kmeans_step step;
        st = kmeans_iterate(c->rows, n, WIDTH, c->k, c->centres, c->cluster_of, context, &step, diag);
        if (st != GROOM_OK || step.n_changed == 0)
            break;
    }
    return st;
}

static groom_status take_middles(struct groom_retarget_source *source, struct clusters *c, struct groom_diag *diag)
{
    for (uint32_t i = 0; i < c->k; i++)
        c->chosen[i] = UINT32_MAX;
    middles(c->rows, source->strands->n_strands, c->centres, c->cluster_of, c->best, c->chosen, c->k);
    sort_indices(c->chosen, c->k);
    while (c->k > 1 && c->chosen[c->k - 1] == UINT32_MAX)
        c->k--;
    if (!(source->guides = memory_array(source->allocator, c->k, sizeof *source->guides)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u guides", c->k);
    source->n_guides = c->k;
    for (uint32_t i = 0; i < c->k; i++)
        source->guides[i] = c->chosen[i];
    return GROOM_OK;
}

static groom_status take_all(struct groom_retarget_source *source, struct groom_diag *diag)
{
    uint32_t n = source->strands->n_strands;
    if (!(source->guides = memory_array(source->allocator, n, sizeof *source->guides)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u guides", n);
    source->n_guides = n;
    for (uint32_t i = 0; i < n; i++)
        source->guides[i] = i;
    return GROOM_OK;
}

groom_status guides_choose(struct groom_retarget_source *source, const struct groom_context *context,
                           struct groom_diag *diag)
{
    const struct groom_allocator *allocator = source->allocator;
    uint32_t n = source->strands->n_strands, wanted = source->options.guides;
    if (wanted >= n)
        return take_all(source, diag);
    struct clusters c = {.wanted = wanted};
    c.rows = memory_array(allocator, n, WIDTH * sizeof *c.rows);
    c.centres = memory_array(allocator, wanted, WIDTH * sizeof *c.centres);
    c.chosen = memory_array(allocator, wanted, sizeof *c.chosen);
    c.cluster_of = memory_array(allocator, n, sizeof *c.cluster_of);
    c.best = memory_array(allocator, wanted, sizeof *c.best);
    groom_status st = GROOM_ENOMEM;
    if (c.rows && c.centres && c.chosen && c.cluster_of && c.best) {
        if ((st = cluster(source, &c, context, diag)) == GROOM_OK)
            st = take_middles(source, &c, diag);
    } else {
        groom_fail(diag, st, "no memory to cluster %u strands", n);
    }
    memory_release(allocator, c.rows, n, WIDTH * sizeof *c.rows);
    memory_release(allocator, c.centres, wanted, WIDTH * sizeof *c.centres);
    memory_release(allocator, c.chosen, wanted, sizeof *c.chosen);
    memory_release(allocator, c.cluster_of, n, sizeof *c.cluster_of);
    memory_release(allocator, c.best, wanted, sizeof *c.best);
    return st;
}
