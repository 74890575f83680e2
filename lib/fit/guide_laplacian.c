#include "fit/guide_laplacian.h"

#include <math.h>

#include "base/memory.h"
#include "groom/spatial.h"

#define MOST_NEIGHBOURS 64 /* that a regression takes */
#define RIDGE 0.1          /* of the spread of the neighbours: keeps slopes sane where they are on one line */
#define NO_WEIGHT 1e-6     /* in sum: nobody is like this guide */

struct scalp {
    const float (*uv)[2];
    const float (*direction)[3];
    double sigma_d;
    const struct groom_triangulation *triangulation;
    uint32_t *first, *neighbour; /* [n + 1], [first[n]] */
};

/* The neighbours of a guide, and with what weights they predict it. */
struct ring {
    uint32_t n, guide[MOST_NEIGHBOURS];
    double weight[MOST_NEIGHBOURS], offset[MOST_NEIGHBOURS][2];
};

/* --- who is next to whom --------------------------------------------------------------- */

/* Edges both ways; guides with one root are neighbours of the first of them. */
static void visit(struct scalp *scalp, void (*each)(struct scalp *, uint32_t, uint32_t))
{
    const struct groom_triangulation *t = scalp->triangulation;
    for (uint32_t e = 0; e < t->n_edges; e++) {
        each(scalp, t->edges[e][0], t->edges[e][1]);
        each(scalp, t->edges[e][1], t->edges[e][0]);
    }
    for (uint32_t g = 0; g < t->n_points; g++)
        if (t->same_as[g] != g) {
            each(scalp, g, t->same_as[g]);
            each(scalp, t->same_as[g], g);
        }
}

static void count_neighbour(struct scalp *scalp, uint32_t g, uint32_t other)
{
    (void)other;
    scalp->first[g + 1]++;
}

static void add_neighbour(struct scalp *scalp, uint32_t g, uint32_t other)
{
    scalp->neighbour[scalp->first[g]++] = other;
}

static void list_neighbours(struct scalp *scalp)
{
    uint32_t n = scalp->triangulation->n_points;
    for (uint32_t g = 0; g < n; g++)
        scalp->first[g + 1] += scalp->first[g];
    visit(scalp, add_neighbour);
    for (uint32_t g = n; g > 0; g--)
        scalp->first[g] = scalp->first[g - 1];
    scalp->first[0] = 0;
}

/* --- regression ---------------------------------------------------------------------------- */

static double likeness(const struct scalp *scalp, uint32_t a, uint32_t b)
{
    double square = 0;
    for (int c = 0; c < 3; c++) {
        double d = (double)scalp->direction[a][c] - scalp->direction[b][c];
        square += d * d;
    }
    return exp(-square / (2 * scalp->sigma_d * scalp->sigma_d));
}

static void ring_fill(const struct scalp *scalp, uint32_t g, struct ring *ring)
{
    ring->n = 0;
    for (uint32_t at = scalp->first[g]; at < scalp->first[g + 1] && ring->n < MOST_NEIGHBOURS; at++, ring->n++) {
        uint32_t other = scalp->neighbour[at];
        ring->guide[ring->n] = other;
        ring->weight[ring->n] = likeness(scalp, g, other);
        for (int c = 0; c < 2; c++)
            ring->offset[ring->n][c] = (double)scalp->uv[other][c] - scalp->uv[g][c];
    }
}

/* The slope over the scalp that the regression reads from `mean` to the guide itself: C^-1 mean. */
static void ring_slope(const struct ring *ring, const double mean[2], double slope[2])
{
    double c[3] = {0};
    for (uint32_t b = 0; b < ring->n; b++) {
        double x = ring->offset[b][0] - mean[0], y = ring->offset[b][1] - mean[1];
        c[0] += ring->weight[b] * x * x, c[1] += ring->weight[b] * x * y, c[2] += ring->weight[b] * y * y;
    }
    double ridge = RIDGE * (c[0] + c[2]) + 1e-12;
    c[0] += ridge, c[2] += ridge;
    double determinant = c[0] * c[2] - c[1] * c[1];
    slope[0] = (c[2] * mean[0] - c[1] * mean[1]) / determinant;
    slope[1] = (c[0] * mean[1] - c[1] * mean[0]) / determinant;
}

/* Turns likenesses into the weights of the regression, which sum to 1; returns their mean. */
static double ring_regress(struct ring *ring)
{
    double sum = 0, mean[2] = {0}, slope[2];
    for (uint32_t b = 0; b < ring->n; b++)
        sum += ring->weight[b];
    if (!(sum > NO_WEIGHT))
        return 0;
    for (uint32_t b = 0; b < ring->n; b++)
        for (int c = 0; c < 2; c++)
            mean[c] += ring->weight[b] * ring->offset[b][c] / sum;
    ring_slope(ring, mean, slope);
    for (uint32_t b = 0; b < ring->n; b++) {
        double x = ring->offset[b][0] - mean[0], y = ring->offset[b][1] - mean[1];
        ring->weight[b] *= 1 / sum - (slope[0] * x + slope[1] * y);
    }
    return sum / ring->n;
}

static int fill_row(const struct scalp *scalp, uint32_t g, struct sparse *laplacian)
{
    struct ring ring;
    ring_fill(scalp, g, &ring);
    double strength = ring_regress(&ring), *entry = sparse_entry(laplacian, g, g);
    if (!entry)
        return 0;
    entry[0] += strength;
    for (uint32_t b = 0; b < ring.n; b++) {
        if (!(entry = sparse_entry(laplacian, g, ring.guide[b])))
            return 0;
        entry[0] -= strength * ring.weight[b];
    }
    for (uint32_t at = scalp->first[g] + ring.n; at < scalp->first[g + 1]; at++) /* 0: for the pattern's symmetry */
        if (!sparse_entry(laplacian, g, scalp->neighbour[at]))
            return 0;
    sparse_end_row(laplacian, g);
    return 1;
}

groom_status guide_laplacian(const float (*uv)[2], const float (*direction)[3], uint32_t n, double sigma_d,
                             struct sparse *laplacian, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct scalp scalp = {.uv = uv, .direction = direction, .sigma_d = sigma_d};
    struct groom_triangulation *triangulation;
    size_t n_neighbours = 0;
    groom_status st = groom_triangulation_create(uv, n, context, &triangulation, diag);
    if (st != GROOM_OK)
        return st;
    scalp.triangulation = triangulation;
    int fine = sparse_init(laplacian, n, allocator);
    if ((scalp.first = memory_array_zero(allocator, (size_t)n + 1, sizeof *scalp.first))) {
        visit(&scalp, count_neighbour);
        for (uint32_t g = 0; g < n; g++)
            n_neighbours += scalp.first[g + 1];
        scalp.neighbour = memory_array(allocator, n_neighbours, sizeof *scalp.neighbour);
    }
    if ((fine = fine && scalp.first && scalp.neighbour))
        list_neighbours(&scalp);
    for (uint32_t g = 0; fine && g < n; g++)
        fine = fill_row(&scalp, g, laplacian);
    if (!fine)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the neighbours of %u guides", n);
    memory_release(allocator, scalp.neighbour, n_neighbours, sizeof *scalp.neighbour);
    memory_release(allocator, scalp.first, (size_t)n + 1, sizeof *scalp.first);
    groom_triangulation_destroy(triangulation);
    return st;
}
