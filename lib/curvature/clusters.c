/* Strands grouped by where they begin and end (Shi et al. 2026, Section 5.3). */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "geometry/kmeans.h"
#include "groom/curvature.h"

#define STREAM_CLUSTERS 0x63760010u
#define MOST_ITERATIONS 60
#define DIMENSION 6 /* root and tip */

void groom_clusters_destroy(struct groom_clusters *clusters)
{
    if (!clusters)
        return;
    const struct groom_allocator *a = clusters->allocator;
    memory_release(a, clusters->of_strand, clusters->n_strands, sizeof *clusters->of_strand);
    memory_release(a, clusters->first, (size_t)clusters->n_clusters + 1, sizeof *clusters->first);
    memory_release(a, clusters->strands, clusters->n_strands, sizeof *clusters->strands);
    memory_release(a, clusters, 1, sizeof *clusters);
}

static groom_status clusters_create(uint32_t count, uint32_t n_strands, const struct groom_context *context,
                                    struct groom_clusters **clusters, struct groom_diag *diag)
{
    const struct groom_allocator *a = memory_allocator(context);
    struct groom_clusters *made = memory_array_zero(a, 1, sizeof *made);
    if (!made)
        goto no_memory;
    *made = (struct groom_clusters){.n_clusters = count, .n_strands = n_strands, .allocator = a};
    made->of_strand = memory_array_zero(a, n_strands, sizeof *made->of_strand);
    made->first = memory_array_zero(a, (size_t)count + 1, sizeof *made->first);
    made->strands = memory_array(a, n_strands, sizeof *made->strands);
    if (!made->of_strand || !made->first || !made->strands)
        goto no_memory;
    *clusters = made;
    return GROOM_OK;
no_memory:
    groom_clusters_destroy(made);
    return groom_fail(diag, GROOM_ENOMEM, "no memory for %u clusters of %u strands", count, n_strands);
}

/* --- rows ------------------------------------------------------------------------------ */

/* Centred, and of size 1 in the mean, as K-means in single precision wants them. */
static void normalise(float *rows, uint32_t n)
{
    double mean[3] = {0}, square = 0.0;
    for (size_t i = 0; i < (size_t)n * DIMENSION; i++)
        mean[i % 3] += rows[i] / (2.0 * n);
    for (size_t i = 0; i < (size_t)n * DIMENSION; i++)
        square += (rows[i] - mean[i % 3]) * (rows[i] - mean[i % 3]) / n;
    double scale = square > 0.0 ? 1.0 / sqrt(square) : 1.0;
    for (size_t i = 0; i < (size_t)n * DIMENSION; i++)
        rows[i] = (float)((rows[i] - mean[i % 3]) * scale);
}

static groom_status fill_rows(const struct groom_strands *strands, float *rows, struct groom_diag *diag)
{
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        float *row = rows + (size_t)i * DIMENSION;
        if (strands->first[i + 1] == strands->first[i])
            return groom_fail(diag, GROOM_EINVAL, "strand %u has no vertex", i);
        memcpy(row, strands->points[strands->first[i]], 3 * sizeof *row);
        memcpy(row + 3, strands->points[strands->first[i + 1] - 1], 3 * sizeof *row);
        for (int k = 0; k < DIMENSION; k++)
            if (!isfinite(row[k]))
                return groom_fail(diag, GROOM_EINVAL, "the %s of strand %u is not finite", k < 3 ? "root" : "tip", i);
    }
    normalise(rows, strands->n_strands);
    return GROOM_OK;
}

/* --- Lloyd -------------------------------------------------------------------------------- */

static groom_status iterate(const float *rows, uint32_t n, uint32_t k, float *centres, uint32_t *of_strand,
                            const struct groom_context *context, struct groom_diag *diag)
{
    for (int i = 0; i < MOST_ITERATIONS; i++) {
        struct kmeans_step step;
        groom_status st = kmeans_iterate(rows, n, DIMENSION, k, centres, of_strand, context, &step, diag);
        if (st != GROOM_OK || (i > 0 && step.n_changed == 0))
            return st;
    }
    return GROOM_OK;
}

static groom_status assign(const float *rows, uint32_t n, uint32_t count, uint64_t seed, uint32_t *of_strand,
                           const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *a = memory_allocator(context);
    struct groom_random_key key = {seed, STREAM_CLUSTERS};
    uint32_t n_chosen = 0, *chosen = memory_array(a, count, sizeof *chosen);
    float (*centres)[DIMENSION] = memory_array(a, count, sizeof *centres);
    groom_status st;
    if (!chosen || !centres) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for %u clusters", count);
        goto out;
    }
    if ((st = kmeans_seed(rows, n, DIMENSION, count, key, context, chosen, &n_chosen, diag)) != GROOM_OK)
        goto out;
    for (uint32_t k = 0; k < n_chosen; k++)
        memcpy(centres[k], rows + (size_t)chosen[k] * DIMENSION, sizeof *centres);
    st = iterate(rows, n, n_chosen, centres[0], of_strand, context, diag);
out:
    memory_release(a, chosen, count, sizeof *chosen);
    memory_release(a, centres, count, sizeof *centres);
    return st;
}

static void list_members(struct groom_clusters *c)
{
    for (uint32_t i = 0; i < c->n_strands; i++)
        c->first[c->of_strand[i] + 1]++;
    for (uint32_t k = 0; k < c->n_clusters; k++)
        c->first[k + 1] += c->first[k];
    for (uint32_t i = c->n_strands; i-- > 0;)
        c->strands[--c->first[c->of_strand[i] + 1]] = i;
    /* the begin of cluster k now stands in first[k + 1] */
    memmove(c->first, c->first + 1, c->n_clusters * sizeof *c->first);
    c->first[c->n_clusters] = c->n_strands;
}

groom_status groom_strands_cluster(const struct groom_strands *strands, uint32_t count, uint64_t seed,
                                   const struct groom_context *context, struct groom_clusters **clusters,
                                   struct groom_diag *diag)
{
    const struct groom_allocator *a = memory_allocator(context);
    uint32_t n = strands->n_strands, most = n < GROOM_CLUSTERS_MOST ? n : GROOM_CLUSTERS_MOST;
    struct groom_clusters *made = NULL;
    float *rows = NULL;
    groom_status st;
    if (count < 1 || count > most)
        return groom_fail_field(diag, GROOM_EINVAL, "/clusters/count", "%u clusters of %u strands: ask for 1..%u",
                                count, n, most);
    if ((st = clusters_create(count, n, context, &made, diag)) != GROOM_OK)
        return st;
    rows = memory_array(a, (size_t)n * DIMENSION, sizeof *rows);
    st = rows ? fill_rows(strands, rows, diag) : groom_fail(diag, GROOM_ENOMEM, "no memory for roots and tips");
    if (st == GROOM_OK)
        st = assign(rows, n, count, seed, made->of_strand, context, diag);
    if (st != GROOM_OK)
        goto out;
    list_members(made);
    *clusters = made;
    made = NULL;
out:
    memory_release(a, rows, (size_t)n * DIMENSION, sizeof *rows);
    groom_clusters_destroy(made);
    return st;
}
