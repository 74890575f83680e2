#include "base/sort.h"
#include "fit/regions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define USUAL 0.2 /* quantile of costs: where bundles are small, half of all edges are borders */
#define ROUNDS 3 /* of moving nodes */
#define NONE UINT32_MAX

/* A border between two regions: in the lists of both. */
struct border {
    uint32_t a, b;           /* regions; a = b: gone */
    uint32_t next_a, next_b; /* the next border in a's list, in b's */
    uint32_t n, place;       /* edges; where it stands in the heap */
    double sum;              /* of their costs */
};

struct merging {
    struct border *border;   /* [n_edges] */
    uint32_t *heap;          /* [n_edges] of borders, cheapest first */
    double *cost;            /* [n_edges] of borders */
    uint32_t n_heap;
    uint32_t *first;         /* [n] borders of each region */
    uint32_t *into, *size;   /* [n] */
    uint32_t *seen;          /* [n] border with the region, while lists are joined; else NONE */
};

/* --- a heap of borders ------------------------------------------------------------------- */

static int before(const struct merging *m, uint32_t x, uint32_t y)
{
    double a = m->cost[x], b = m->cost[y];
    return a < b || (a == b && x < y);
}

static void put(struct merging *m, uint32_t place, uint32_t border)
{
    m->heap[place] = border;
    m->border[border].place = place;
}

static void sift(struct merging *m, uint32_t place)
{
    uint32_t border = m->heap[place];
    for (; place > 0 && before(m, border, m->heap[(place - 1) / 2]); place = (place - 1) / 2)
        put(m, place, m->heap[(place - 1) / 2]);
    for (;;) {
        uint32_t child = 2 * place + 1;
        if (child + 1 < m->n_heap && before(m, m->heap[child + 1], m->heap[child]))
            child++;
        if (child >= m->n_heap || !before(m, m->heap[child], border))
            break;
        put(m, place, m->heap[child]);
        place = child;
    }
    put(m, place, border);
}

static void take_out(struct merging *m, uint32_t border)
{
    uint32_t place = m->border[border].place, last = m->heap[--m->n_heap];
    if (last != border) {
        put(m, place, last);
        sift(m, place);
    }
}

static void price(struct merging *m, uint32_t border)
{
    const struct border *x = &m->border[border];
    double na = m->size[x->a], nb = m->size[x->b];
    m->cost[border] = na * nb / (na + nb) * x->sum / x->n;
}

/* --- regions ------------------------------------------------------------------------------- */

static uint32_t *next_of(struct merging *m, uint32_t border, uint32_t region)
{
    struct border *x = &m->border[border];
    return x->a == region ? &x->next_a : &x->next_b;
}

static uint32_t other_of(const struct merging *m, uint32_t border, uint32_t region)
{
    const struct border *x = &m->border[border];
    return x->a == region ? x->b : x->a;
}

static void link_border(struct merging *m, uint32_t border, uint32_t region)
{
    *next_of(m, border, region) = m->first[region];
    m->first[region] = border;
}

static void unlink_border(struct merging *m, uint32_t border, uint32_t region)
{
    uint32_t *at = &m->first[region];
    while (*at != border)
        at = next_of(m, *at, region);
    *at = *next_of(m, border, region);
}

/* Region l ends in k: its borders become k's, and double ones one. */
static void merge(struct merging *m, uint32_t k, uint32_t l)
{
    for (uint32_t x = m->first[k]; x != NONE; x = *next_of(m, x, k))
        m->seen[other_of(m, x, k)] = x;
    for (uint32_t x = m->first[l], next; x != NONE; x = next) {
        uint32_t other = other_of(m, x, l);
        next = *next_of(m, x, l);
        if (other == k || m->seen[other] != NONE) {
            uint32_t kept = other == k ? NONE : m->seen[other];
            if (kept != NONE) {
                m->border[kept].sum += m->border[x].sum;
                m->border[kept].n += m->border[x].n;
            }
            unlink_border(m, x, other);
            take_out(m, x);
            m->border[x].a = m->border[x].b = NONE;
            continue;
        }
        if (m->border[x].a == l)
            m->border[x].a = k;
        else
            m->border[x].b = k;
        link_border(m, x, k);
    }
    m->size[k] += m->size[l];
    m->into[l] = k;
    for (uint32_t x = m->first[k]; x != NONE; x = *next_of(m, x, k)) {
        m->seen[other_of(m, x, k)] = NONE;
        price(m, x);
        sift(m, m->border[x].place);
    }
    m->seen[k] = NONE;
}

/* --- setting up -------------------------------------------------------------------------------- */

static int compare_edges(const void *a, const void *b)
{
    const struct region_edge *x = a, *y = b;
    if (x->a != y->a)
        return x->a < y->a ? -1 : 1;
    return (x->b > y->b) - (x->b < y->b);
}

/* Each pair once, the lower number first, at logarithmic costs. returns how many */
static size_t tidy(const struct region_edge *edge, size_t n_edges, struct region_edge *out, double *scratch)
{
    size_t n = 0, kept = 0;
    for (size_t e = 0; e < n_edges; e++)
        if (edge[e].a != edge[e].b) {
            uint32_t low = edge[e].a < edge[e].b ? edge[e].a : edge[e].b;
            out[n++] = (struct region_edge){low, edge[e].a + edge[e].b - low, edge[e].cost};
        }
    qsort(out, n, sizeof *out, compare_edges);
    for (size_t e = 0; e < n; e++)
        if (kept == 0 || compare_edges(&out[kept - 1], &out[e]) != 0) {
            scratch[kept] = out[e].cost;
            out[kept++] = out[e];
        }
    sort_doubles(scratch, kept);
    double usual = kept ? scratch[(size_t)(USUAL * (double)(kept - 1))] : 0;
    for (size_t e = 0; e < kept; e++)
        out[e].cost = usual > 0 ? log(1 + out[e].cost / usual) : 0;
    return kept;
}

static void set_up(struct merging *m, const struct region_edge *edge, uint32_t n_edges, uint32_t n)
{
    for (uint32_t k = 0; k < n; k++) {
        m->first[k] = m->seen[k] = NONE;
        m->into[k] = k;
        m->size[k] = 1;
    }
    for (uint32_t e = 0; e < n_edges; e++) {
        m->border[e] = (struct border){.a = edge[e].a, .b = edge[e].b, .n = 1, .sum = edge[e].cost};
        link_border(m, e, edge[e].a);
        link_border(m, e, edge[e].b);
        price(m, e);
        m->n_heap = e + 1;
        put(m, e, e);
        sift(m, e);
    }
}

static uint32_t end_of(const uint32_t *into, uint32_t k)
{
    while (into[k] != k)
        k = into[k];
    return k;
}

static void number_regions(struct merging *m, uint32_t n, uint32_t wanted, uint32_t *region)
{
    uint32_t n_found = 0, *number = m->seen;
    for (uint32_t k = 0; k < n; k++)
        if (m->into[k] == k)
            number[k] = n_found < wanted ? n_found++ : wanted - 1;
    for (uint32_t k = 0; k < n; k++)
        region[k] = number[end_of(m->into, k)];
}

/* The cost that parts edges inside of regions from those between them: half way between their means. */
static double threshold(const struct region_edge *edge, size_t n_edges, const uint32_t *region)
{
    double sum[2] = {0}, n[2] = {0};
    for (size_t e = 0; e < n_edges; e++) {
        int across = region[edge[e].a] != region[edge[e].b];
        sum[across] += edge[e].cost;
        n[across]++;
    }
    return n[0] > 0 && n[1] > 0 ? 0.5 * (sum[0] / n[0] + sum[1] / n[1]) : 0;
}

/* Nodes go where their neighbours are that are like them. first [n + 1], of [2 n_edges]: edges by node */
static uint32_t move_nodes(const struct region_edge *edge, const uint32_t *first, const uint32_t *of, uint32_t n,
                           double part, uint32_t *region, double *vote)
{
    uint32_t n_moved = 0;
    for (uint32_t k = 0; k < n; k++) {
        uint32_t best = region[k];
        for (uint32_t at = first[k]; at < first[k + 1]; at++) {
            const struct region_edge *x = &edge[of[at]];
            vote[region[x->a == k ? x->b : x->a]] += part - x->cost;
        }
        for (uint32_t at = first[k]; at < first[k + 1]; at++) {
            const struct region_edge *x = &edge[of[at]];
            uint32_t other = region[x->a == k ? x->b : x->a];
            if (vote[other] > vote[best])
                best = other;
        }
        for (uint32_t at = first[k]; at < first[k + 1]; at++)
            vote[region[edge[of[at]].a == k ? edge[of[at]].b : edge[of[at]].a]] = 0;
        vote[region[k]] = 0;
        n_moved += best != region[k];
        region[k] = best;
    }
    return n_moved;
}

static groom_status settle(const struct region_edge *edge, size_t n_edges, uint32_t n, uint32_t *region,
                           const struct groom_allocator *allocator)
{
    uint32_t *first = memory_array_zero(allocator, (size_t)n + 2, sizeof *first);
    uint32_t *of = memory_array(allocator, 2 * n_edges, sizeof *of);
    double *vote = memory_array_zero(allocator, n, sizeof *vote);
    groom_status st = first && of && vote ? GROOM_OK : GROOM_ENOMEM;
    if (st == GROOM_OK) {
        for (size_t e = 0; e < n_edges; e++) {
            first[edge[e].a + 2]++;
            first[edge[e].b + 2]++;
        }
        for (uint32_t k = 0; k < n; k++)
            first[k + 2] += first[k + 1];
        for (size_t e = 0; e < n_edges; e++) {
            of[first[edge[e].a + 1]++] = (uint32_t)e;
            of[first[edge[e].b + 1]++] = (uint32_t)e;
        }
        for (int round = 0; round < ROUNDS; round++)
            if (move_nodes(edge, first, of, n, threshold(edge, n_edges, region), region, vote) == 0)
                break;
    }
    memory_release(allocator, first, (size_t)n + 2, sizeof *first);
    memory_release(allocator, of, 2 * n_edges, sizeof *of);
    memory_release(allocator, vote, n, sizeof *vote);
    return st;
}

groom_status regions_merge(const struct region_edge *edge, size_t n_edges, uint32_t n, uint32_t wanted, uint32_t *region,
                           const struct groom_allocator *allocator)
{
    struct merging m = {0};
    struct region_edge *tidied = memory_array(allocator, n_edges, sizeof *tidied);
    m.border = memory_array(allocator, n_edges, sizeof *m.border);
    m.heap = memory_array(allocator, n_edges, sizeof *m.heap);
    m.cost = memory_array(allocator, n_edges, sizeof *m.cost);
    m.first = memory_array(allocator, n, sizeof *m.first);
    m.into = memory_array(allocator, n, sizeof *m.into);
    m.size = memory_array(allocator, n, sizeof *m.size);
    m.seen = memory_array(allocator, n, sizeof *m.seen);
    groom_status st = tidied && m.border && m.heap && m.cost && m.first && m.into && m.size && m.seen ? GROOM_OK : GROOM_ENOMEM;
    if (st == GROOM_OK) {
        uint32_t left = n;
        size_t kept = tidy(edge, n_edges, tidied, m.cost);
        set_up(&m, tidied, (uint32_t)kept, n);
        for (; left > wanted && m.n_heap > 0; left--) {
            const struct border *best = &m.border[m.heap[0]];
            merge(&m, best->a < best->b ? best->a : best->b, best->a < best->b ? best->b : best->a);
        }
        number_regions(&m, n, wanted, region);
        st = settle(tidied, kept, n, region, allocator);
    }
    memory_release(allocator, tidied, n_edges, sizeof *tidied);
    memory_release(allocator, m.border, n_edges, sizeof *m.border);
    memory_release(allocator, m.heap, n_edges, sizeof *m.heap);
    memory_release(allocator, m.cost, n_edges, sizeof *m.cost);
    memory_release(allocator, m.first, n, sizeof *m.first);
    memory_release(allocator, m.into, n, sizeof *m.into);
    memory_release(allocator, m.size, n, sizeof *m.size);
    memory_release(allocator, m.seen, n, sizeof *m.seen);
    return st;
}
