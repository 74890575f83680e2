#include "fit/likeness.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/parallel.h"
#include "base/sort.h"
#include "groom/spatial.h"
#include "groom/strands.h"

#define SAMPLES 50           /* of a strand, at most */
#define STRANDS_PER_PIECE 256
#define PAIRS 4000           /* from which rest is told, at most */
#define ROUNDS 4
#define ALIKE 0.4            /* quantile of costs up to which pairs have their full say */
#define LONGEST 0.98         /* quantile of lengths up to which winding strands are compared */
#define MOST_REST 3.0

struct comparing {
    const struct groom_fit *fit;
    struct likeness *likeness;
    uint32_t q;
    double step;                /* of winding strands, in the target's size; 0: equal parts */
    float (*point)[3];          /* [n][q] along the strands */
    uint32_t *reach;            /* [n] how many of these there are */
    double *rest;               /* [q] */
    uint32_t n_pairs;           /* strand pair * stride and its farthest neighbour */
    double *cost, *sorted;      /* [n_pairs] */
};

/* --- strands at equal ways or parts ----------------------------------------------------------- */

static double distance(const float a[3], const float b[3])
{
    double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static void sample_parts(const struct comparing *c, uint32_t i)
{
    const float (*x)[3] = (const float (*)[3])(c->fit->target + (size_t)i * c->fit->m);
    for (uint32_t s = 0; s < c->q; s++)
        memcpy(c->point[(size_t)i * c->q + s], x[(uint64_t)s * (c->fit->m - 1) / (c->q - 1)], sizeof *c->point);
    c->reach[i] = c->q;
}

static void sample_ways(const struct comparing *c, uint32_t i)
{
    const float (*x)[3] = (const float (*)[3])(c->fit->target + (size_t)i * c->fit->m);
    double begin = 0;
    uint32_t s = 0;
    for (uint32_t j = 0; j + 1 < c->fit->m; j++) {
        double length = distance(x[j], x[j + 1]);
        for (; s < c->q && s * c->step <= begin + length; s++)
            for (int k = 0; k < 3; k++)
                c->point[(size_t)i * c->q + s][k] =
                    (float)(x[j][k] + (length > 0 ? (s * c->step - begin) / length : 0) * ((double)x[j + 1][k] - x[j][k]));
        begin += length;
    }
    c->reach[i] = s;
}

static void sample_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct comparing *c = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < c->fit->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++)
        if (c->step > 0)
            sample_ways(c, i);
        else
            sample_parts(c, i);
}

/* The length that few strands exceed. */
static groom_status find_step(struct comparing *c, const struct groom_allocator *allocator)
{
    uint32_t n = c->fit->n;
    double *length = memory_array(allocator, n, sizeof *length);
    if (!length)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < n; i++)
        length[i] = groom_polyline_length((const float (*)[3])(c->fit->target + (size_t)i * c->fit->m), c->fit->m);
    sort_doubles(length, n);
    c->step = length[(uint32_t)(LONGEST * (n - 1))] / (c->q - 1);
    memory_release(allocator, length, n, sizeof *length);
    return GROOM_OK;
}

/* --- two strands ---------------------------------------------------------------------------------- */

/* Of both strands, at a sample that both reach; 0 where they have none. */
static void direction(const float (*x)[3], const float (*y)[3], uint32_t s, uint32_t reach, double out[3])
{
    uint32_t before = s > 0 ? s - 1 : s, after = s + 1 < reach ? s + 1 : s;
    double square = 0;
    for (int c = 0; c < 3; c++) {
        out[c] = ((double)x[after][c] - x[before][c]) + ((double)y[after][c] - y[before][c]);
        square += out[c] * out[c];
    }
    for (int c = 0; c < 3; c++)
        out[c] = square > 0 ? out[c] / sqrt(square) : 0;
}

/* What a pair says of each sample: |difference|^2, difference times root and |root|^2, all across the strands. */
struct across { double square, product, root; };

static struct across across_of(const float (*x)[3], const float (*y)[3], uint32_t s, uint32_t reach)
{
    double along[3], d_along = 0, r_along = 0;
    struct across a = {0};
    direction(x, y, s, reach, along);
    for (int c = 0; c < 3; c++) {
        double d = (double)x[s][c] - y[s][c], r = (double)x[0][c] - y[0][c];
        a.square += d * d;
        a.product += d * r;
        a.root += r * r;
        d_along += d * along[c];
        r_along += r * along[c];
    }
    return (struct across){a.square - d_along * d_along, a.product - d_along * r_along, a.root - r_along * r_along};
}

static double cost_of(const struct comparing *c, uint32_t i, uint32_t k)
{
    const float (*x)[3] = (const float (*)[3])(c->point + (size_t)i * c->q), (*y)[3] = (const float (*)[3])(c->point + (size_t)k * c->q);
    uint32_t reach = c->reach[i] < c->reach[k] ? c->reach[i] : c->reach[k];
    double sum = 0;
    for (uint32_t s = 1; s < reach; s++) {
        struct across a = across_of(x, y, s, reach);
        sum += a.square - 2 * c->rest[s] * a.product + c->rest[s] * c->rest[s] * a.root;
    }
    return reach > 1 ? fmax(sum, 0) / (reach - 1) : 0;
}

/* --- what is left of roots -------------------------------------------------------------------------- */

static uint32_t strand_of_pair(const struct comparing *c, uint32_t pair)
{
    return (uint32_t)((uint64_t)pair * c->fit->n / c->n_pairs);
}

static uint32_t farthest(const struct comparing *c, uint32_t i)
{
    uint32_t k = LIKENESS_NEIGHBOURS;
    while (k > 0 && c->likeness->neighbour[(size_t)i * LIKENESS_NEIGHBOURS + k - 1] == UINT32_MAX)
        k--;
    return k > 0 ? c->likeness->neighbour[(size_t)i * LIKENESS_NEIGHBOURS + k - 1] : i;
}

static void cost_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct comparing *c = user;
    (void)thread;
    for (uint32_t p = piece * STRANDS_PER_PIECE; p < c->n_pairs && p - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; p++)
        c->cost[p] = cost_of(c, strand_of_pair(c, p), farthest(c, strand_of_pair(c, p)));
}

static void regress(const struct comparing *c, double usual)
{
    double product[SAMPLES] = {0}, root[SAMPLES] = {0};
    for (uint32_t p = 0; p < c->n_pairs; p++) {
        uint32_t i = strand_of_pair(c, p), k = farthest(c, i), reach = c->reach[i] < c->reach[k] ? c->reach[i] : c->reach[k];
        const float (*x)[3] = (const float (*)[3])(c->point + (size_t)i * c->q);
        const float (*y)[3] = (const float (*)[3])(c->point + (size_t)k * c->q);
        double ratio = c->cost[p] / usual, weight = 1 / (1 + ratio * ratio);
        for (uint32_t s = 0; s < reach; s++) {
            struct across a = across_of(x, y, s, reach);
            product[s] += weight * a.product;
            root[s] += weight * a.root;
        }
    }
    for (uint32_t s = 0; s < c->q; s++)
        c->rest[s] = root[s] > 0 ? fmin(fmax(product[s] / root[s], 0), MOST_REST) : 0;
}

static void find_rest(struct comparing *c, const struct groom_context *context)
{
    memset(c->rest, 0, c->q * sizeof *c->rest);
    for (int round = 0; round < ROUNDS; round++) {
        parallel_for(context, (c->n_pairs + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE, cost_piece, c);
        memcpy(c->sorted, c->cost, c->n_pairs * sizeof *c->sorted);
        sort_doubles(c->sorted, c->n_pairs);
        double usual = c->sorted[(uint32_t)(ALIKE * (c->n_pairs - 1))];
        if (!(usual > 0))
            return;
        regress(c, usual);
    }
}

/* --- all pairs ------------------------------------------------------------------------------------------ */

static void edge_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct comparing *c = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < c->fit->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++)
        for (size_t at = (size_t)i * LIKENESS_NEIGHBOURS; at < ((size_t)i + 1) * LIKENESS_NEIGHBOURS; at++) {
            uint32_t k = c->likeness->neighbour[at];
            c->likeness->edge[at] = k == UINT32_MAX ? (struct region_edge){i, i, 0} : (struct region_edge){i, k, cost_of(c, i, k)};
        }
}

/* Of the nearest, without the strand itself. */
static groom_status find_neighbours(const struct groom_fit *fit, struct likeness *likeness,
                                    const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_neighbours *index = NULL;
    size_t n_found = (size_t)fit->n * (LIKENESS_NEIGHBOURS + 1);
    uint32_t *found = memory_array(allocator, n_found, sizeof *found);
    groom_status st = found ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for the neighbours of %u strands", fit->n);
    if (st == GROOM_OK && (st = groom_neighbours_create(fit->root_uv[0], fit->n, 2, context, &index, diag)) == GROOM_OK)
        st = groom_neighbours_find(index, fit->root_uv[0], fit->n, LIKENESS_NEIGHBOURS + 1, found, NULL, context, diag);
    for (uint32_t i = 0; st == GROOM_OK && i < fit->n; i++) {
        uint32_t n = 0;
        for (uint32_t k = 0; k <= LIKENESS_NEIGHBOURS && n < LIKENESS_NEIGHBOURS; k++) {
            uint32_t other = found[(size_t)i * (LIKENESS_NEIGHBOURS + 1) + k];
            if (other != i)
                likeness->neighbour[(size_t)i * LIKENESS_NEIGHBOURS + n++] = other;
        }
    }
    groom_neighbours_destroy(index);
    memory_release(allocator, found, n_found, sizeof *found);
    return st;
}

static groom_status compare(struct comparing *c, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_points = (size_t)c->fit->n * c->q;
    groom_status st = GROOM_OK;
    c->point = memory_array(allocator, n_points, sizeof *c->point);
    c->reach = memory_array(allocator, c->fit->n, sizeof *c->reach);
    c->rest = memory_array(allocator, c->q, sizeof *c->rest);
    c->cost = memory_array(allocator, c->n_pairs, sizeof *c->cost);
    c->sorted = memory_array(allocator, c->n_pairs, sizeof *c->sorted);
    if (!c->point || !c->reach || !c->rest || !c->cost || !c->sorted || (c->step > 0 && find_step(c, allocator) != GROOM_OK))
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to compare %u strands", c->fit->n);
    if (st == GROOM_OK) {
        uint32_t n_pieces = (c->fit->n + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE;
        parallel_for(context, n_pieces, sample_piece, c);
        find_rest(c, context);
        parallel_for(context, n_pieces, edge_piece, c);
    }
    memory_release(allocator, c->point, n_points, sizeof *c->point);
    memory_release(allocator, c->reach, c->fit->n, sizeof *c->reach);
    memory_release(allocator, c->rest, c->q, sizeof *c->rest);
    memory_release(allocator, c->cost, c->n_pairs, sizeof *c->cost);
    memory_release(allocator, c->sorted, c->n_pairs, sizeof *c->sorted);
    return st;
}

groom_status likeness_init(struct likeness *likeness, const struct groom_fit *fit, int winds,
                           const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_edges = (size_t)fit->n * LIKENESS_NEIGHBOURS;
    struct comparing c = {.fit = fit, .likeness = likeness, .q = fit->m < SAMPLES ? fit->m : SAMPLES, .step = winds,
                          .n_pairs = fit->n < PAIRS ? fit->n : PAIRS};
    *likeness = (struct likeness){.n = fit->n, .allocator = allocator};
    likeness->neighbour = memory_array(allocator, n_edges, sizeof *likeness->neighbour);
    likeness->edge = memory_array(allocator, n_edges, sizeof *likeness->edge);
    if (!likeness->neighbour || !likeness->edge)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the neighbours of %u strands", fit->n);
    groom_status st = find_neighbours(fit, likeness, context, diag);
    return st == GROOM_OK ? compare(&c, context, diag) : st;
}

void likeness_finish(struct likeness *likeness)
{
    size_t n_edges = (size_t)likeness->n * LIKENESS_NEIGHBOURS;
    if (!likeness->allocator)
        return;
    memory_release(likeness->allocator, likeness->neighbour, n_edges, sizeof *likeness->neighbour);
    memory_release(likeness->allocator, likeness->edge, n_edges, sizeof *likeness->edge);
}
