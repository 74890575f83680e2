/* Exact nearest neighbours on FLANN's KDTREE_SINGLE (index of one place each, so that a thousand
 * roots at one place cost nothing). FLANN finds candidates; distances are taken again in double and
 * ordered here, so that ties go by index whatever the tree looks like. */
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include <flann/flann.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "groom/spatial.h"

#define QUERIES_A_PIECE 256
#define BATCH_CANDIDATES 65536
#define SPARE 8            /* candidates beyond k, to see that the k-th is no tie */
#define LARGEST 1e15f      /* squares of larger numbers leave float */

struct groom_neighbours {
    const struct groom_allocator *allocator;
    uint32_t n, dimension;
    uint32_t n_places;
    float *places;         /* [n_places][dimension]; room for n */
    uint32_t *first;       /* [n_places + 1] into members; room for n + 1 */
    uint32_t *members;     /* [n] points of each place, ascending */
    flann_index_t index;
};

/* FLANN returns garbage for what it does not check: see groom_neighbours_find for the guards. */
static struct FLANNParameters parameters(void)
{
    struct FLANNParameters p = DEFAULT_FLANN_PARAMETERS;
    p.algorithm = FLANN_INDEX_KDTREE_SINGLE;
    p.checks = FLANN_CHECKS_UNLIMITED;
    p.eps = 0;
    p.sorted = 1;
    p.cores = 1;
    p.leaf_max_size = 10;
    p.log_level = FLANN_LOG_NONE;
    p.random_seed = 0;
    return p;
}

static int all_usable(const float *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!(fabsf(values[i]) <= LARGEST))
            return 0;
    return 1;
}

/* --- building ------------------------------------------------------------------ */

struct order {
    const float *points;
    uint32_t dimension;
};

static int compare_places(const float *a, const float *b, uint32_t dimension)
{
    for (uint32_t i = 0; i < dimension; i++)
        if (a[i] != b[i])
            return a[i] < b[i] ? -1 : 1;
    return 0;
}

static int compare_members(const void *a, const void *b, void *user)
{
    const struct order *order = user;
    uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
    int c = compare_places(order->points + (size_t)i * order->dimension, order->points + (size_t)j * order->dimension,
                           order->dimension);
    return c ? c : i < j ? -1 : i > j;
}

static void gather_places(struct groom_neighbours *nb, const float *points)
{
    struct order order = {points, nb->dimension};
    for (uint32_t i = 0; i < nb->n; i++)
        nb->members[i] = i;
    qsort_r(nb->members, nb->n, sizeof *nb->members, compare_members, &order);
    for (uint32_t i = 0; i < nb->n; i++) {
        const float *p = points + (size_t)nb->members[i] * nb->dimension;
        if (i == 0 || compare_places(p, nb->places + (size_t)(nb->n_places - 1) * nb->dimension, nb->dimension) != 0) {
            nb->first[nb->n_places] = i;
            memcpy(nb->places + (size_t)nb->n_places++ * nb->dimension, p, nb->dimension * sizeof *p);
        }
    }
    nb->first[nb->n_places] = nb->n;
}

groom_status groom_neighbours_create(const float *points, uint32_t n, uint32_t dimension,
                                     const struct groom_context *context, struct groom_neighbours **out,
                                     struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct FLANNParameters p = parameters();
    float speedup;
    if (dimension == 0)
        return groom_fail(diag, GROOM_EINVAL, "points of no dimension have no neighbours");
    if (n == 0)
        return groom_fail(diag, GROOM_EEMPTY, "there is no point to be a neighbour");
    if (n > INT32_MAX || dimension > INT32_MAX || !all_usable(points, (size_t)n * dimension))
        return groom_fail(diag, GROOM_EINVAL, "a point is not finite or beyond 1e15, or there are more than 2^31-1");
    struct groom_neighbours *nb = memory_array_zero(allocator, 1, sizeof *nb);
    if (!nb)
        goto no_memory;
    nb->allocator = allocator;
    nb->n = n;
    nb->dimension = dimension;
    nb->places = memory_array(allocator, (size_t)n * dimension, sizeof *nb->places);
    nb->first = memory_array(allocator, (size_t)n + 1, sizeof *nb->first);
    nb->members = memory_array(allocator, n, sizeof *nb->members);
    if (!nb->places || !nb->first || !nb->members)
        goto no_memory;
    gather_places(nb, points);
    nb->index = flann_build_index_float(nb->places, (int)nb->n_places, (int)dimension, &speedup, &p);
    if (!nb->index) {
        groom_neighbours_destroy(nb);
        return groom_fail(diag, GROOM_EINTERNAL, "FLANN could not index %u points", n);
    }
    *out = nb;
    return GROOM_OK;
no_memory:
    groom_neighbours_destroy(nb);
    return groom_fail(diag, GROOM_ENOMEM, "no memory to index %u points", n);
}

void groom_neighbours_destroy(struct groom_neighbours *nb)
{
    struct FLANNParameters p = parameters();
    if (!nb)
        return;
    if (nb->index)
        flann_free_index_float(nb->index, &p);
    memory_release(nb->allocator, nb->places, (size_t)nb->n * nb->dimension, sizeof *nb->places);
    memory_release(nb->allocator, nb->first, (size_t)nb->n + 1, sizeof *nb->first);
    memory_release(nb->allocator, nb->members, nb->n, sizeof *nb->members);
    memory_release(nb->allocator, nb, 1, sizeof *nb);
}

/* --- finding --------------------------------------------------------------------- */

struct candidate {
    double squared;
    uint32_t place;
    uint32_t taken; /* how many of its members are written */
};

/* Room for `width` candidates of each of `n_queries` queries. */
struct scratch {
    int *ids;
    float *distances;
    struct candidate *candidates; /* of one query */
    uint32_t width, n_queries;
};

static void scratch_finish(struct scratch *s, const struct groom_allocator *allocator)
{
    size_t n = (size_t)s->width * s->n_queries;
    memory_release(allocator, s->ids, n, sizeof *s->ids);
    memory_release(allocator, s->distances, n, sizeof *s->distances);
    memory_release(allocator, s->candidates, s->width, sizeof *s->candidates);
}

static int scratch_init(struct scratch *s, uint32_t width, uint32_t n_queries, const struct groom_allocator *allocator)
{
    size_t n = (size_t)width * n_queries;
    s->width = width;
    s->n_queries = n_queries;
    s->ids = memory_array(allocator, n, sizeof *s->ids);
    s->distances = memory_array(allocator, n, sizeof *s->distances);
    s->candidates = memory_array(allocator, width, sizeof *s->candidates);
    return s->ids && s->distances && s->candidates;
}

struct find {
    const struct groom_neighbours *nb;
    const float *queries;
    uint32_t n_queries, k;
    uint32_t *ids;
    float *squared;
    atomic_int status; /* a groom_status; the first failure stays */
};

static void fail(struct find *find, groom_status status)
{
    int none = GROOM_OK;
    atomic_compare_exchange_strong(&find->status, &none, (int)status);
}

static double squared_distance(const float *a, const float *b, uint32_t dimension)
{
    double sum = 0;
    for (uint32_t i = 0; i < dimension; i++)
        sum += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
    return sum;
}

static int compare_candidates(const void *a, const void *b)
{
    const struct candidate *p = a, *q = b;
    if (p->squared != q->squared)
        return p->squared < q->squared ? -1 : 1;
    return p->place < q->place ? -1 : p->place > q->place;
}

/* The lowest index that is left among places at one distance, or UINT32_MAX. */
static uint32_t take_lowest(const struct groom_neighbours *nb, struct candidate *c, uint32_t n)
{
    struct candidate *best = NULL;
    uint32_t lowest = UINT32_MAX;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t m = nb->first[c[i].place] + c[i].taken;
        if (m < nb->first[c[i].place + 1] && nb->members[m] < lowest) {
            lowest = nb->members[m];
            best = &c[i];
        }
    }
    if (best)
        best->taken++;
    return lowest;
}

static void write_answer(struct find *find, uint32_t query, struct candidate *c, uint32_t n)
{
    uint32_t *ids = find->ids + (size_t)query * find->k, n_out = 0;
    float *squared = find->squared ? find->squared + (size_t)query * find->k : NULL;
    for (uint32_t i = 0, end; i < n && n_out < find->k; i = end) {
        for (end = i + 1; end < n && c[end].squared == c[i].squared; end++) {}
        for (uint32_t id; n_out < find->k && (id = take_lowest(find->nb, c + i, end - i)) != UINT32_MAX; n_out++) {
            ids[n_out] = id;
            if (squared)
                squared[n_out] = (float)c[i].squared;
        }
    }
    for (; n_out < find->k; n_out++) {
        ids[n_out] = UINT32_MAX;
        if (squared)
            squared[n_out] = INFINITY;
    }
}

/* Order what FLANN found for one query. 0 where places as near as the k-th may be missing. */
static int settle(struct find *find, uint32_t query, const int *ids, const float *distances, struct scratch *s)
{
    const struct groom_neighbours *nb = find->nb;
    const float *q = find->queries + (size_t)query * nb->dimension;
    for (uint32_t i = 0; i < s->width; i++)
        s->candidates[i] = (struct candidate){
            squared_distance(q, nb->places + (size_t)ids[i] * nb->dimension, nb->dimension), (uint32_t)ids[i], 0};
    qsort(s->candidates, s->width, sizeof *s->candidates, compare_candidates);
    if (s->width < nb->n_places) {
        double margin = 1e-5 + 1e-6 * nb->dimension; /* of float sums, generously */
        if (!(distances[s->width - 1] > s->candidates[find->k - 1].squared * (1 + margin)))
            return 0;
    }
    write_answer(find, query, s->candidates, s->width);
    return 1;
}

static int ask(const struct groom_neighbours *nb, const float *queries, uint32_t n, struct scratch *s)
{
    struct FLANNParameters p = parameters();
    return flann_find_nearest_neighbors_index_float(nb->index, (float *)(uintptr_t)queries, (int)n, s->ids, s->distances,
                                                    (int)s->width, &p);
}

static uint32_t wider(const struct groom_neighbours *nb, uint64_t width)
{
    return width < nb->n_places ? (uint32_t)width : nb->n_places;
}

/* One query among many places at nearly one distance: ask for more until the k-th stands clear. */
static void find_among_ties(struct find *find, uint32_t query, uint32_t width)
{
    const struct groom_neighbours *nb = find->nb;
    for (int settled = 0; !settled;) {
        struct scratch s = {0};
        width = wider(nb, (uint64_t)width * 4);
        int ready = scratch_init(&s, width, 1, nb->allocator);
        if (ready && ask(nb, find->queries + (size_t)query * nb->dimension, 1, &s) == 0)
            settled = settle(find, query, s.ids, s.distances, &s);
        else
            fail(find, ready ? GROOM_EINTERNAL : GROOM_ENOMEM);
        settled |= !ready || atomic_load(&find->status) != GROOM_OK;
        scratch_finish(&s, nb->allocator);
    }
}

static void find_batch(struct find *find, uint32_t first, struct scratch *s, uint32_t n)
{
    const struct groom_neighbours *nb = find->nb;
    if (ask(nb, find->queries + (size_t)first * nb->dimension, n, s) != 0)
        fail(find, GROOM_EINTERNAL);
    for (uint32_t i = 0; i < n && atomic_load(&find->status) == GROOM_OK; i++)
        if (!settle(find, first + i, s->ids + (size_t)i * s->width, s->distances + (size_t)i * s->width, s))
            find_among_ties(find, first + i, s->width);
}

static void find_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct find *find = user;
    const struct groom_neighbours *nb = find->nb;
    uint32_t first = piece * QUERIES_A_PIECE, left = find->n_queries - first;
    uint32_t n = left < QUERIES_A_PIECE ? left : QUERIES_A_PIECE, width = wider(nb, (uint64_t)find->k + SPARE);
    uint32_t batch = width < BATCH_CANDIDATES / n ? n : BATCH_CANDIDATES / width + 1;
    struct scratch s = {0};
    (void)thread;
    if (!scratch_init(&s, width, batch, nb->allocator))
        fail(find, GROOM_ENOMEM);
    for (uint32_t i = 0; i < n && atomic_load(&find->status) == GROOM_OK; i += batch)
        find_batch(find, first + i, &s, n - i < batch ? n - i : batch);
    scratch_finish(&s, nb->allocator);
}

groom_status groom_neighbours_find(const struct groom_neighbours *neighbours, const float *queries,
                                   uint32_t n_queries, uint32_t k, uint32_t *ids, float *squared,
                                   const struct groom_context *context, struct groom_diag *diag)
{
    struct find find = {.nb = neighbours, .queries = queries, .n_queries = n_queries, .k = k, .ids = ids, .squared = squared};
    if (k == 0)
        return groom_fail(diag, GROOM_EINVAL, "k is 0; ask for one neighbour at least");
    if (!all_usable(queries, (size_t)n_queries * neighbours->dimension))
        return groom_fail(diag, GROOM_EINVAL, "a query is not finite or beyond 1e15");
    atomic_init(&find.status, GROOM_OK);
    parallel_for(context, n_queries / QUERIES_A_PIECE + (n_queries % QUERIES_A_PIECE != 0), find_piece, &find);
    groom_status st = (groom_status)atomic_load(&find.status);
    if (st != GROOM_OK)
        return groom_fail(diag, st, "finding %u neighbours of %u points: %s", k, n_queries, groom_status_message(st));
    return GROOM_OK;
}
