#include "geometry/uv_judge.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/sort.h"
#include "groom/spatial.h"

#define FEWEST_ROOTS 16
#define MOST_SAMPLES 4000
#define NEIGHBOURS 7  /* a point itself and six others */

/* A pair of neighbours whose scale is so many times the median lies across a seam. */
#define TEAR 5.0
#define MOST_TORN 0.001
/* Neighbours in uv so much farther apart on the scalp belong to two charts, one on the other. */
#define MOST_STACKED 0.005
/* The scale may vary by this factor up and down, but for a few pairs. */
#define EVEN 2.5
#define MOST_UNEVEN 0.06

const char *uv_verdict_words(enum uv_verdict verdict)
{
    static const char *const words[] = {
        "they serve", "there are too few roots to judge them", "they have no area there",
        "a seam runs through the scalp", "parts of the scalp share them", "their scale varies too much"};
    return words[verdict];
}

struct samples {
    uint32_t n;
    float (*points)[3];  /* [n] */
    float (*uvs)[2];     /* [n] */
    uint32_t *ids;       /* [n][NEIGHBOURS] */
    double *scales;      /* [n * NEIGHBOURS] uv per metre of the pairs that have a length */
    double *nearest;     /* [n] metres to the nearest other place */
};

static int samples_init(struct samples *s, const float (*points)[3], const float (*uvs)[2], uint32_t n,
                        const struct groom_allocator *allocator)
{
    s->n = n < MOST_SAMPLES ? n : MOST_SAMPLES;
    s->points = memory_array(allocator, s->n, sizeof *s->points);
    s->uvs = memory_array(allocator, s->n, sizeof *s->uvs);
    s->ids = memory_array(allocator, (size_t)s->n * NEIGHBOURS, sizeof *s->ids);
    s->scales = memory_array(allocator, (size_t)s->n * NEIGHBOURS, sizeof *s->scales);
    s->nearest = memory_array(allocator, s->n, sizeof *s->nearest);
    if (!s->points || !s->uvs || !s->ids || !s->scales || !s->nearest)
        return 0;
    for (uint32_t i = 0; i < s->n; i++) {
        uint32_t from = (uint32_t)((uint64_t)i * n / s->n);
        memcpy(s->points[i], points[from], sizeof *s->points);
        for (int k = 0; k < 2; k++)
            s->uvs[i][k] = fminf(1e6f, fmaxf(-1e6f, uvs[from][k]));
    }
    return 1;
}

static void samples_finish(struct samples *s, const struct groom_allocator *allocator)
{
    memory_release(allocator, s->points, s->n, sizeof *s->points);
    memory_release(allocator, s->uvs, s->n, sizeof *s->uvs);
    memory_release(allocator, s->ids, (size_t)s->n * NEIGHBOURS, sizeof *s->ids);
    memory_release(allocator, s->scales, (size_t)s->n * NEIGHBOURS, sizeof *s->scales);
    memory_release(allocator, s->nearest, s->n, sizeof *s->nearest);
}

static groom_status find_neighbours(struct samples *s, const float *places, uint32_t dimension,
                                    const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_neighbours *neighbours = NULL;
    groom_status st = groom_neighbours_create(places, s->n, dimension, context, &neighbours, diag);
    if (st == GROOM_OK)
        st = groom_neighbours_find(neighbours, places, s->n, NEIGHBOURS, s->ids, NULL, context, diag);
    groom_neighbours_destroy(neighbours);
    return st;
}

static double metres_between(const struct samples *s, uint32_t i, uint32_t j)
{
    const float *p = s->points[i], *q = s->points[j];
    return sqrt(((double)p[0] - q[0]) * ((double)p[0] - q[0]) + ((double)p[1] - q[1]) * ((double)p[1] - q[1]) +
                ((double)p[2] - q[2]) * ((double)p[2] - q[2]));
}

static double uv_between(const struct samples *s, uint32_t i, uint32_t j)
{
    return hypot((double)s->uvs[i][0] - s->uvs[j][0], (double)s->uvs[i][1] - s->uvs[j][1]);
}

/* Scales of the pairs of neighbours on the scalp; how far the nearest other place is. */
static size_t gather_scales(struct samples *s)
{
    size_t n_pairs = 0;
    for (uint32_t i = 0; i < s->n; i++) {
        s->nearest[i] = INFINITY;
        for (uint32_t k = 0; k < NEIGHBOURS; k++) {
            uint32_t j = s->ids[i * NEIGHBOURS + k];
            double metres = j < s->n ? metres_between(s, i, j) : 0;
            if (metres <= 0)
                continue;
            s->scales[n_pairs++] = uv_between(s, i, j) / metres;
            s->nearest[i] = fmin(s->nearest[i], metres);
        }
    }
    return n_pairs;
}

static enum uv_verdict judge_scales(const double *sorted, size_t n, double scale)
{
    size_t n_torn = 0, n_uneven = 0;
    for (size_t i = 0; i < n; i++) {
        n_torn += sorted[i] > TEAR * scale;
        n_uneven += sorted[i] > EVEN * scale || sorted[i] < scale / EVEN;
    }
    if ((double)n_torn > MOST_TORN * (double)n)
        return UV_SEAM;
    return (double)n_uneven > MOST_UNEVEN * (double)n ? UV_UNEVEN : UV_SERVES;
}

/* ids are neighbours in uv now. */
static int is_stacked(const struct samples *s, double scale, double spacing)
{
    size_t n_stacked = 0;
    for (uint32_t i = 0; i < s->n; i++)
        for (uint32_t k = 0; k < NEIGHBOURS; k++) {
            uint32_t j = s->ids[i * NEIGHBOURS + k];
            if (j < s->n && metres_between(s, i, j) > TEAR * uv_between(s, i, j) / scale + TEAR * spacing)
                n_stacked++;
        }
    return (double)n_stacked > MOST_STACKED * s->n * NEIGHBOURS;
}

groom_status uv_judge(const float (*points)[3], const float (*uvs)[2], uint32_t n, const struct groom_context *context,
                      struct uv_judgement *judgement, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct samples s = {0};
    groom_status st = GROOM_OK;
    size_t n_pairs = 0;
    double scale = 0;

    *judgement = (struct uv_judgement){UV_TOO_FEW_ROOTS, 0};
    if (n < FEWEST_ROOTS)
        return GROOM_OK;
    if (!samples_init(&s, points, uvs, n, allocator)) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to judge the texture coordinates of the head");
        goto out;
    }
    if ((st = find_neighbours(&s, (const float *)s.points, 3, context, diag)) != GROOM_OK)
        goto out;
    n_pairs = gather_scales(&s);
    if (n_pairs < FEWEST_ROOTS)
        goto out;
    scale = median_of_doubles(s.scales, n_pairs);
    judgement->verdict = scale > 0 ? judge_scales(s.scales, n_pairs, scale) : UV_NO_AREA;
    if (judgement->verdict != UV_SERVES)
        goto out;
    judgement->metres = 1 / scale;
    if ((st = find_neighbours(&s, (const float *)s.uvs, 2, context, diag)) != GROOM_OK)
        goto out;
    if (is_stacked(&s, scale, median_of_doubles(s.nearest, s.n)))
        judgement->verdict = UV_STACKED;
out:
    samples_finish(&s, allocator);
    return st;
}
