#include "fit/bundles.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"

#define FEATURES 50          /* vertices of a strand that are looked at, at most */
#define MERGED_WITH 8        /* nearest clusters that one may be merged with */
#define NEAR 6               /* bundles that a strand may go to */
#define POOLED 5             /* neighbours whose word counts as much as a strand's own */
#define ROUNDS 5             /* of moving strands */
#define STRANDS_PER_PIECE 256
#define MOST_REST 3.0

struct bundling {
    struct groom_fit *fit;
    uint32_t q, n_clusters;
    uint32_t *vertex;           /* [q] */
    double (*mean)[3];          /* [n_clusters][q] of a cluster, then of the bundle that goes by its number */
    double *count;              /* [n_clusters] strands; 0: merged into another */
    uint32_t *bundle_of;        /* [n_clusters] */
    uint32_t *strand_bundle;    /* [n] */
    double *rest;               /* [q] */
    uint32_t *alive;            /* [n_operator_guides] numbers of bundles */
    float (*root)[3];           /* [n_operator_guides] their mean roots */
    uint32_t *near;             /* [n][NEAR] of alive */
    float *energy;              /* [n][NEAR] */
    uint32_t *neighbour;        /* [n][POOLED + 1] */
};

static const float *vertex_of(const struct bundling *b, uint32_t i, uint32_t s)
{
    return b->fit->target[(size_t)i * b->fit->m + b->vertex[s]];
}

/* --- what bundles are like --------------------------------------------------------------- */

static void measure_means(struct bundling *b)
{
    memset(b->mean, 0, (size_t)b->n_clusters * b->q * sizeof *b->mean);
    memset(b->count, 0, b->n_clusters * sizeof *b->count);
    for (uint32_t i = 0; i < b->fit->n; i++) {
        uint32_t k = b->strand_bundle[i];
        b->count[k]++;
        for (uint32_t s = 0; s < b->q; s++)
            for (int c = 0; c < 3; c++)
                b->mean[(size_t)k * b->q + s][c] += (double)vertex_of(b, i, s)[c];
    }
    for (uint32_t k = 0; k < b->n_clusters; k++)
        for (uint32_t s = 0; s < b->q && b->count[k] > 0; s++)
            for (int c = 0; c < 3; c++)
                b->mean[(size_t)k * b->q + s][c] /= b->count[k];
}

/* How much of the distance of roots is left at each vertex: one regression a vertex over all strands. */
static void measure_rest(struct bundling *b)
{
    double square = 0;
    memset(b->rest, 0, b->q * sizeof *b->rest);
    for (uint32_t i = 0; i < b->fit->n; i++) {
        const double (*mean)[3] = (const double (*)[3])(b->mean + (size_t)b->strand_bundle[i] * b->q);
        for (int c = 0; c < 3; c++) {
            double root = vertex_of(b, i, 0)[c] - mean[0][c];
            square += root * root;
            for (uint32_t s = 0; s < b->q; s++)
                b->rest[s] += root * (vertex_of(b, i, s)[c] - mean[s][c]);
        }
    }
    for (uint32_t s = 0; s < b->q; s++)
        b->rest[s] = square > 0 ? fmin(fmax(b->rest[s] / square, 0), MOST_REST) : 1;
}

/* |d|^2 of what d has off the shape's own direction: differences of length say nothing. */
struct off_shape { double square, along, shape; };

static void add_off_shape(struct off_shape *sum, double difference, double shape)
{
    sum->square += difference * difference;
    sum->along += difference * shape;
    sum->shape += shape * shape;
}

static double off_shape(const struct off_shape *sum)
{
    return fmax(sum->square - (sum->shape > 0 ? sum->along * sum->along / sum->shape : 0), 0);
}

/* --- merging ------------------------------------------------------------------------------ */

static double merging_cost(const struct bundling *b, uint32_t k, uint32_t l)
{
    const double (*x)[3] = (const double (*)[3])(b->mean + (size_t)k * b->q), (*y)[3] = (const double (*)[3])(b->mean + (size_t)l * b->q);
    struct off_shape sum = {0};
    for (uint32_t s = 1; s < b->q; s++)
        for (int c = 0; c < 3; c++)
            add_off_shape(&sum, x[s][c] - y[s][c] - b->rest[s] * (x[0][c] - y[0][c]),
                          0.5 * (x[s][c] - x[0][c] + y[s][c] - y[0][c]));
    return b->count[k] * b->count[l] / (b->count[k] + b->count[l]) * off_shape(&sum);
}

/* Pairs of clusters that may be merged: candidate edges, which follow their ends into bundles. */
struct edge { uint32_t a, b; double cost; };

static uint32_t root_of(const uint32_t *into, uint32_t k)
{
    while (into[k] != k)
        k = into[k];
    return k;
}

static void merge(struct bundling *b, uint32_t k, uint32_t l)
{
    double all = b->count[k] + b->count[l];
    for (uint32_t s = 0; s < b->q; s++)
        for (int c = 0; c < 3; c++) {
            double *mean = &b->mean[(size_t)k * b->q + s][c];
            *mean = (b->count[k] * *mean + b->count[l] * b->mean[(size_t)l * b->q + s][c]) / all;
        }
    b->count[k] = all;
    b->count[l] = 0;
    b->bundle_of[l] = k;
}

static void merge_all(struct bundling *b, struct edge *edges, uint32_t n_edges, uint32_t wanted)
{
    for (uint32_t e = 0; e < n_edges; e++)
        edges[e].cost = merging_cost(b, edges[e].a, edges[e].b);
    for (uint32_t n = b->n_clusters; n > wanted;) {
        uint32_t best = n_edges;
        for (uint32_t e = 0; e < n_edges; e++)
            if (edges[e].a != edges[e].b && (best == n_edges || edges[e].cost < edges[best].cost))
                best = e;
        if (best == n_edges)
            break; /* islands: more bundles than wanted are left; strands leave them as they move */
        uint32_t k = edges[best].a < edges[best].b ? edges[best].a : edges[best].b;
        uint32_t l = edges[best].a < edges[best].b ? edges[best].b : edges[best].a;
        merge(b, k, l);
        n--;
        for (uint32_t e = 0; e < n_edges; e++) {
            int touched = edges[e].a == k || edges[e].a == l || edges[e].b == k || edges[e].b == l;
            edges[e].a = edges[e].a == l ? k : edges[e].a;
            edges[e].b = edges[e].b == l ? k : edges[e].b;
            if (touched && edges[e].a != edges[e].b)
                edges[e].cost = merging_cost(b, edges[e].a, edges[e].b);
        }
    }
}

static groom_status merge_clusters(struct bundling *b, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = b->n_clusters, k = MERGED_WITH + 1, n_edges = 0;
    size_t n_ids = (size_t)n * k;
    struct groom_neighbours *index = NULL;
    float (*root)[3] = memory_array(allocator, n, sizeof *root);
    uint32_t *ids = memory_array(allocator, n_ids, sizeof *ids);
    struct edge *edges = memory_array(allocator, n_ids, sizeof *edges);
    groom_status st = root && ids && edges ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to merge %u clusters", n);
    for (uint32_t g = 0; st == GROOM_OK && g < n; g++)
        for (int c = 0; c < 3; c++)
            root[g][c] = (float)b->mean[(size_t)g * b->q][c];
    if (st == GROOM_OK && (st = groom_neighbours_create(root[0], n, 3, context, &index, diag)) == GROOM_OK)
        st = groom_neighbours_find(index, root[0], n, k, ids, NULL, context, diag);
    for (size_t at = 0; st == GROOM_OK && at < n_ids; at++) {
        uint32_t g = (uint32_t)(at / k);
        if (ids[at] != UINT32_MAX && ids[at] != g && b->count[g] > 0 && b->count[ids[at]] > 0)
            edges[n_edges++] = (struct edge){g, ids[at], 0};
    }
    if (st == GROOM_OK)
        merge_all(b, edges, n_edges, b->fit->groom->n_operator_guides);
    groom_neighbours_destroy(index);
    memory_release(allocator, root, n, sizeof *root);
    memory_release(allocator, ids, n_ids, sizeof *ids);
    memory_release(allocator, edges, n_ids, sizeof *edges);
    return st;
}

/* Lists the bundles that are left, and puts strands into them; those of one beyond the number move on. */
static uint32_t list_bundles(struct bundling *b)
{
    uint32_t wanted = b->fit->groom->n_operator_guides, n = 0;
    for (uint32_t k = 0; k < wanted; k++)
        b->alive[k] = UINT32_MAX;
    for (uint32_t k = 0; k < b->n_clusters && n < wanted; k++)
        if (b->count[k] > 0)
            b->alive[n++] = k;
    for (uint32_t i = 0; i < b->fit->n; i++)
        b->strand_bundle[i] = root_of(b->bundle_of, b->fit->cluster_of[i]);
    return n;
}

/* --- moving strands ---------------------------------------------------------------------------- */

static double misfit_of(const struct bundling *b, uint32_t i, uint32_t bundle)
{
    const double (*mean)[3] = (const double (*)[3])(b->mean + (size_t)bundle * b->q);
    const float *root = vertex_of(b, i, 0);
    struct off_shape sum = {0};
    for (uint32_t s = 1; s < b->q; s++) {
        const float *x = vertex_of(b, i, s);
        for (int c = 0; c < 3; c++)
            add_off_shape(&sum, x[c] - mean[s][c] - b->rest[s] * (root[c] - mean[0][c]), (double)x[c] - root[c]);
    }
    return off_shape(&sum);
}

static void energy_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct bundling *b = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < b->fit->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++)
        for (uint32_t a = 0; a < NEAR; a++) {
            size_t at = (size_t)i * NEAR + a;
            b->energy[at] = b->near[at] == UINT32_MAX ? INFINITY : (float)misfit_of(b, i, b->alive[b->near[at]]);
        }
}

/* What strand k says of a bundle; of one that is far from it, the worst that it says of any. */
static double word_of(const struct bundling *b, uint32_t k, uint32_t bundle)
{
    double worst = 0;
    for (uint32_t a = 0; a < NEAR; a++) {
        size_t at = (size_t)k * NEAR + a;
        if (b->near[at] == bundle)
            return b->energy[at];
        worst = b->near[at] != UINT32_MAX ? fmax(worst, b->energy[at]) : worst;
    }
    return worst;
}

static void move_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct bundling *b = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < b->fit->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++) {
        double least = INFINITY;
        for (uint32_t a = 0; a < NEAR; a++) {
            uint32_t bundle = b->near[(size_t)i * NEAR + a];
            double sum = b->energy[(size_t)i * NEAR + a];
            for (uint32_t k = 0; bundle != UINT32_MAX && k <= POOLED; k++) {
                uint32_t other = b->neighbour[(size_t)i * (POOLED + 1) + k];
                if (other != i && other != UINT32_MAX)
                    sum += word_of(b, other, bundle);
            }
            if (bundle != UINT32_MAX && sum < least) {
                least = sum;
                b->strand_bundle[i] = b->alive[bundle];
            }
        }
    }
}

static groom_status move_strands(struct bundling *b, uint32_t n_bundles, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    uint32_t n = b->fit->n, n_pieces = (n + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE;
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_neighbours *index = NULL;
    float (*root)[3] = memory_array(allocator, n, sizeof *root);
    groom_status st = root ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to bundle %u strands", n);
    for (uint32_t i = 0; st == GROOM_OK && i < n; i++)
        memcpy(root[i], vertex_of(b, i, 0), sizeof *root);
    for (uint32_t k = 0; k < n_bundles; k++)
        for (int c = 0; c < 3; c++)
            b->root[k][c] = (float)b->mean[(size_t)b->alive[k] * b->q][c];
    if (st == GROOM_OK && (st = groom_neighbours_create(b->root[0], n_bundles, 3, context, &index, diag)) == GROOM_OK)
        st = groom_neighbours_find(index, root[0], n, NEAR, b->near, NULL, context, diag);
    if (st == GROOM_OK) {
        parallel_for(context, n_pieces, energy_piece, b);
        parallel_for(context, n_pieces, move_piece, b);
    }
    groom_neighbours_destroy(index);
    memory_release(allocator, root, n, sizeof *root);
    return st;
}

/* --- the groom --------------------------------------------------------------------------------- */

/* Of the guides of a bundle's clusters, the one whose root is nearest to the middle of its strands' roots. */
static void name_operator_guides(struct bundling *b, uint32_t n_bundles)
{
    struct groom *groom = b->fit->groom;
    unsigned taken = 0;
    for (uint32_t k = 0; k < n_bundles; k++) {
        double least = INFINITY;
        for (uint32_t g = 0; g < b->n_clusters; g++) {
            double square = 0;
            for (int c = 0; c < 3; c++) {
                double root = ((double)groom->guides[(size_t)g * b->fit->m][c] - b->fit->centre[c]) / b->fit->scale;
                square += (root - b->mean[(size_t)b->alive[k] * b->q][c]) * (root - b->mean[(size_t)b->alive[k] * b->q][c]);
            }
            if (root_of(b->bundle_of, g) == b->alive[k] && square < least) {
                least = square;
                groom->operator_guide[k] = g;
            }
        }
        taken++;
    }
    /* fewer bundles than operator guides, as clusters without strands make them: any guides that are left */
    for (uint32_t g = 0; g < b->n_clusters && taken < groom->n_operator_guides; g++) {
        int used = 0;
        for (uint32_t k = 0; k < taken; k++)
            used |= groom->operator_guide[k] == g;
        if (!used)
            groom->operator_guide[taken++] = g;
    }
}

/* Operator guides ascend, in the groom: bundles are put in their order. */
static void order_bundles(struct bundling *b)
{
    uint32_t *guide = b->fit->groom->operator_guide, n = b->fit->groom->n_operator_guides;
    for (uint32_t k = 1; k < n; k++)
        for (uint32_t l = k; l > 0 && guide[l] < guide[l - 1]; l--) {
            uint32_t g = guide[l], bundle = b->alive[l];
            guide[l] = guide[l - 1];
            guide[l - 1] = g;
            b->alive[l] = b->alive[l - 1];
            b->alive[l - 1] = bundle;
        }
}

static void write_assignment(struct bundling *b)
{
    struct groom *groom = b->fit->groom;
    uint32_t *number = b->bundle_of; /* not needed any more: of a bundle, its place in operator_guide */
    for (uint32_t k = 0; k < b->n_clusters; k++)
        number[k] = UINT32_MAX;
    for (uint32_t k = 0; k < groom->n_operator_guides; k++)
        if (b->alive[k] != UINT32_MAX)
            number[b->alive[k]] = k;
    for (uint32_t i = 0; i < b->fit->n; i++)
        groom->operator_guide_of[i] = number[b->strand_bundle[i]];
}

static groom_status find(struct bundling *b, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_neighbours *index = NULL;
    groom_status st;
    for (uint32_t g = 0; g < b->n_clusters; g++)
        b->bundle_of[g] = g;
    memcpy(b->strand_bundle, b->fit->cluster_of, b->fit->n * sizeof *b->strand_bundle);
    measure_means(b);
    measure_rest(b);
    if ((st = merge_clusters(b, context, diag)) != GROOM_OK ||
        (st = groom_neighbours_create(b->fit->root_uv[0], b->fit->n, 2, context, &index, diag)) != GROOM_OK ||
        (st = groom_neighbours_find(index, b->fit->root_uv[0], b->fit->n, POOLED + 1, b->neighbour, NULL, context, diag)) != GROOM_OK)
        goto out;
    uint32_t n_bundles = list_bundles(b);
    for (int round = 0; st == GROOM_OK && round < ROUNDS; round++) {
        measure_means(b);
        measure_rest(b);
        st = move_strands(b, n_bundles, context, diag);
    }
    if (st != GROOM_OK)
        goto out;
    name_operator_guides(b, n_bundles);
    order_bundles(b);
    write_assignment(b);
out:
    groom_neighbours_destroy(index);
    return st;
}

groom_status bundles_find(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->n, k = fit->n_guides, n_op = fit->groom->n_operator_guides;
    struct bundling b = {.fit = fit, .q = fit->m < FEATURES ? fit->m : FEATURES, .n_clusters = k};
    size_t n_means = (size_t)k * b.q;
    groom_status st;
    b.vertex = memory_array(allocator, b.q, sizeof *b.vertex);
    b.mean = memory_array(allocator, n_means, sizeof *b.mean);
    b.count = memory_array(allocator, k, sizeof *b.count);
    b.bundle_of = memory_array(allocator, k, sizeof *b.bundle_of);
    b.strand_bundle = memory_array(allocator, n, sizeof *b.strand_bundle);
    b.rest = memory_array(allocator, b.q, sizeof *b.rest);
    b.alive = memory_array(allocator, n_op, sizeof *b.alive);
    b.root = memory_array(allocator, n_op, sizeof *b.root);
    b.near = memory_array(allocator, n, NEAR * sizeof *b.near);
    b.energy = memory_array(allocator, n, NEAR * sizeof *b.energy);
    b.neighbour = memory_array(allocator, n, (POOLED + 1) * sizeof *b.neighbour);
    if (b.vertex && b.mean && b.count && b.bundle_of && b.strand_bundle && b.rest && b.alive && b.root && b.near &&
        b.energy && b.neighbour) {
        for (uint32_t s = 0; s < b.q; s++)
            b.vertex[s] = (uint32_t)((uint64_t)s * (fit->m - 1) / (b.q - 1));
        st = find(&b, context, diag);
    } else
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to bundle %u strands", n);
    memory_release(allocator, b.vertex, b.q, sizeof *b.vertex);
    memory_release(allocator, b.mean, n_means, sizeof *b.mean);
    memory_release(allocator, b.count, k, sizeof *b.count);
    memory_release(allocator, b.bundle_of, k, sizeof *b.bundle_of);
    memory_release(allocator, b.strand_bundle, n, sizeof *b.strand_bundle);
    memory_release(allocator, b.rest, b.q, sizeof *b.rest);
    memory_release(allocator, b.alive, n_op, sizeof *b.alive);
    memory_release(allocator, b.root, n_op, sizeof *b.root);
    memory_release(allocator, b.near, n, NEAR * sizeof *b.near);
    memory_release(allocator, b.energy, n, NEAR * sizeof *b.energy);
    memory_release(allocator, b.neighbour, n, (POOLED + 1) * sizeof *b.neighbour);
    return st;
}
