#include "fit/bundles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "fit/regions.h"
#include "groom/strands.h"

#define FEATURES 50          /* vertices of a strand that are looked at, at most */
#define NEIGHBOURS 8         /* on the scalp, that a strand is compared with */
#define STRANDS_PER_PIECE 256
#define MOST_REST 3.0

struct bundling {
    struct groom_fit *fit;
    uint32_t q;
    uint32_t *vertex;           /* [q] */
    double *rest;               /* [q] */
    double *length;             /* [n] of strands */
    int winds;                  /* whether there are curls */
    uint32_t *neighbour;        /* [n][NEIGHBOURS + 1] */
    struct region_edge *edge;   /* [n][NEIGHBOURS] */
    uint32_t *region;           /* [n] */
    double (*middle)[3];        /* [n_gop] mean roots of regions */
    uint32_t *count;            /* [n_gop] */
};

static const float *vertex_of(const struct bundling *b, uint32_t i, uint32_t s)
{
    return b->fit->target[(size_t)i * b->fit->m + b->vertex[s]];
}

/* --- how alike strands are ---------------------------------------------------------------- */

/* How much of the distance of roots is left at each vertex: one regression a vertex over all pairs of
 * neighbours. */
static void measure_rest(struct bundling *b)
{
    double square = 0;
    memset(b->rest, 0, b->q * sizeof *b->rest);
    for (uint32_t i = 0; i < b->fit->n; i++) {
        uint32_t other = b->neighbour[(size_t)i * (NEIGHBOURS + 1) + NEIGHBOURS];
        for (int c = 0; other != UINT32_MAX && c < 3; c++) {
            double root = vertex_of(b, i, 0)[c] - vertex_of(b, other, 0)[c];
            square += root * root;
            for (uint32_t s = 0; s < b->q; s++)
                b->rest[s] += root * (vertex_of(b, i, s)[c] - vertex_of(b, other, s)[c]);
        }
    }
    for (uint32_t s = 0; s < b->q; s++)
        b->rest[s] = square > 0 ? fmin(fmax(b->rest[s] / square, 0), MOST_REST) : 1;
}

/* Where strand i is at a part of its length. */
static void at_part(const struct bundling *b, uint32_t i, double part, double out[3])
{
    const float (*x)[3] = (const float (*)[3])(b->fit->target + (size_t)i * b->fit->m);
    double at = part * (b->fit->m - 1);
    uint32_t j = at < b->fit->m - 1 ? (uint32_t)at : b->fit->m - 2;
    for (int c = 0; c < 3; c++)
        out[c] = x[j][c] + (at - j) * ((double)x[j + 1][c] - x[j][c]);
}

/* |d|^2 of what d has off the shape's own direction: differences of length say nothing. Curls wind by the
 * metre, so that strands are compared at equal ways from the root as far as both go. */
static double apart(const struct bundling *b, uint32_t i, uint32_t j)
{
    const float *p = vertex_of(b, i, 0), *q = vertex_of(b, j, 0);
    double square = 0, along = 0, shape = 0;
    double least = fmin(b->length[i], b->length[j]);
    double part_i = b->winds && b->length[i] > 0 ? least / b->length[i] : 1;
    double part_j = b->winds && b->length[j] > 0 ? least / b->length[j] : 1;
    for (uint32_t s = 1; s < b->q; s++) {
        double x[3], y[3], part = (double)s / (b->q - 1);
        at_part(b, i, part * part_i, x);
        at_part(b, j, part * part_j, y);
        for (int c = 0; c < 3; c++) {
            double root = (double)p[c] - q[c], d = x[c] - y[c] - b->rest[s] * root;
            double mean = 0.5 * (x[c] - p[c] + y[c] - q[c]);
            square += d * d;
            along += d * mean;
            shape += mean * mean;
        }
    }
    return fmax(square - (shape > 0 ? along * along / shape : 0), 0);
}

static void compare_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct bundling *b = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < b->fit->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++) {
        uint32_t n = 0;
        for (uint32_t k = 0; k <= NEIGHBOURS && n < NEIGHBOURS; k++) {
            uint32_t j = b->neighbour[(size_t)i * (NEIGHBOURS + 1) + k];
            if (j != i)
                b->edge[(size_t)i * NEIGHBOURS + n++] =
                    j == UINT32_MAX ? (struct region_edge){i, i, 0} : (struct region_edge){i, j, apart(b, i, j)};
        }
    }
}

/* --- operator guides ------------------------------------------------------------------------ */

static void measure_regions(struct bundling *b)
{
    uint32_t n = b->fit->groom->n_operator_guides;
    memset(b->middle, 0, n * sizeof *b->middle);
    memset(b->count, 0, n * sizeof *b->count);
    for (uint32_t i = 0; i < b->fit->n; i++) {
        b->count[b->region[i]]++;
        for (int c = 0; c < 3; c++)
            b->middle[b->region[i]][c] += (double)b->fit->roots[i][c];
    }
    for (uint32_t k = 0; k < n; k++)
        for (int c = 0; c < 3; c++)
            b->middle[k][c] /= b->count[k] ? b->count[k] : 1;
}

struct choice { double square; uint32_t region, guide; };

static int compare_choices(const void *a, const void *b)
{
    const struct choice *x = a, *y = b;
    if (x->square != y->square)
        return x->square < y->square ? -1 : 1;
    if (x->region != y->region)
        return x->region < y->region ? -1 : 1;
    return (x->guide > y->guide) - (x->guide < y->guide);
}

/* A guide for each region, by the distance of its root from the middle of the region's: nearest pairs first. */
static groom_status name_guides(struct bundling *b, uint32_t *guide, const struct groom_allocator *allocator)
{
    const struct groom *groom = b->fit->groom;
    uint32_t n = groom->n_operator_guides, n_guides = groom->n_guides, left = n;
    struct choice *choice = memory_array(allocator, (size_t)n * n_guides, sizeof *choice);
    uint8_t *taken = memory_array_zero(allocator, n_guides, 1);
    groom_status st = choice && taken ? GROOM_OK : GROOM_ENOMEM;
    for (uint32_t k = 0; st == GROOM_OK && k < n; k++) {
        guide[k] = UINT32_MAX;
        for (uint32_t g = 0; g < n_guides; g++) {
            double square = b->count[k] ? 0 : INFINITY;
            for (int c = 0; c < 3; c++)
                square += pow((double)groom->guides[(size_t)g * groom->n_vertices][c] - b->middle[k][c], 2);
            choice[(size_t)k * n_guides + g] = (struct choice){square, k, g};
        }
    }
    if (st == GROOM_OK)
        qsort(choice, (size_t)n * n_guides, sizeof *choice, compare_choices);
    for (size_t at = 0; st == GROOM_OK && left > 0; at++)
        if (guide[choice[at].region] == UINT32_MAX && !taken[choice[at].guide]) {
            guide[choice[at].region] = choice[at].guide;
            taken[choice[at].guide] = 1;
            left--;
        }
    memory_release(allocator, choice, (size_t)n * n_guides, sizeof *choice);
    memory_release(allocator, taken, n_guides, 1);
    return st;
}

/* The mean shape of a region: of its strands' clusters, from their roots on. points [n_guides * m], shape [n_gop * m] */
static void mean_shapes(const struct bundling *b, const float (*points)[3], float (*shape)[3])
{
    const struct groom_fit *fit = b->fit;
    uint32_t m = fit->m, n_op = fit->groom->n_operator_guides;
    memset(shape, 0, (size_t)n_op * m * sizeof *shape);
    for (uint32_t i = 0; i < fit->n; i++) {
        const float (*x)[3] = points + (size_t)fit->cluster_of[i] * m;
        for (uint32_t j = 0; j < m; j++)
            for (int c = 0; c < 3; c++)
                shape[(size_t)b->region[i] * m + j][c] += (x[j][c] - x[0][c]) / (float)b->count[b->region[i]];
    }
}

/* Operator guides, and their centroids, take the mean shapes of their regions. shape [n_gop * m] scratch */
static void shape_guides(const struct bundling *b, const uint32_t *guide, float (*shape)[3])
{
    struct groom_fit *fit = b->fit;
    float (*const points[2])[3] = {fit->centroids, fit->groom->guides};
    for (int which = 0; which < 2; which++) {
        mean_shapes(b, (const float (*)[3])points[which], shape);
        for (uint32_t k = 0; k < fit->groom->n_operator_guides; k++) {
            float (*x)[3] = points[which] + (size_t)guide[k] * fit->m;
            for (uint32_t j = 1; b->count[k] > 0 && j < fit->m; j++)
                for (int c = 0; c < 3; c++)
                    x[j][c] = x[0][c] + shape[(size_t)k * fit->m + j][c];
        }
    }
}

/* Operator guides ascend, in the groom. number [n_gop]: a region's place among them */
static void write_assignment(struct bundling *b, const uint32_t *guide, uint32_t *number)
{
    struct groom *groom = b->fit->groom;
    uint32_t n = groom->n_operator_guides;
    for (uint32_t k = 0; k < n; k++) {
        number[k] = 0;
        for (uint32_t l = 0; l < n; l++)
            number[k] += guide[l] < guide[k];
        groom->operator_guide[number[k]] = guide[k];
    }
    for (uint32_t i = 0; i < b->fit->n; i++)
        groom->operator_guide_of[i] = number[b->region[i]];
}

/* --- where they stand ------------------------------------------------------------------------- */

/* Moves a guide so that its root is here, or on the head next to here. */
static void stand(struct groom_fit *fit, uint32_t guide, const double middle[3])
{
    float (*x)[3] = fit->groom->guides + (size_t)guide * fit->m, to[3] = {(float)middle[0], (float)middle[1], (float)middle[2]};
    struct groom_surface_point surface;
    if (fit->bvh && groom_bvh_closest(fit->bvh, to, INFINITY, &surface))
        memcpy(to, surface.position, sizeof to);
    for (int c = 0; c < 3; c++) {
        float move = to[c] - x[0][c];
        for (uint32_t j = 0; j < fit->m; j++)
            x[j][c] += move;
    }
}

struct middle {
    double sum[3], n;  /* of roots */
    double nearest;    /* squared distance of `strand` to the guide that stands there */
    uint32_t strand;
};

/* Where the file brought the scalp coordinates, no chart tells those of a new place: they are those of the
 * nearest strand of the guide's own. */
static void take_coordinates(struct groom_fit *fit, struct middle *middle)
{
    struct groom *groom = fit->groom;
    for (uint32_t i = 0; i < fit->n; i++) {
        struct middle *of = &middle[groom->operator_guide_of[i]];
        const float *root = groom->guides[(size_t)groom->operator_guide[groom->operator_guide_of[i]] * fit->m];
        double square = 0;
        for (int c = 0; c < 3; c++)
            square += ((double)fit->roots[i][c] - root[c]) * ((double)fit->roots[i][c] - root[c]);
        if (square >= of->nearest)
            continue;
        of->nearest = square;
        of->strand = i;
    }
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        if (middle[o].n > 0)
            memcpy(groom->guide_uv[groom->operator_guide[o]], fit->root_uv[middle[o].strand], sizeof *groom->guide_uv);
}

/* Operator guides to the middles of their strands. middle [n_gop] scratch, zeroed */
static void centre(struct groom_fit *fit, struct middle *middle, const struct groom_context *context)
{
    const struct groom *groom = fit->groom;
    for (uint32_t i = 0; i < fit->n; i++) {
        struct middle *of = &middle[groom->operator_guide_of[i]];
        for (int c = 0; c < 3; c++)
            of->sum[c] += (double)fit->roots[i][c];
        of->n++;
        of->nearest = INFINITY;
    }
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        const double n = middle[o].n, at[3] = {middle[o].sum[0] / n, middle[o].sum[1] / n, middle[o].sum[2] / n};
        uint32_t guide = groom->operator_guide[o];
        if (!(n > 0))
            continue;
        stand(fit, guide, at);
        if (fit->scalp)
            groom_scalp_coordinates(fit->scalp, (const float (*)[3])groom->guides + (size_t)guide * fit->m, 1, groom->guide_uv + guide, context);
    }
    if (!fit->scalp)
        take_coordinates(fit, middle);
}

groom_status bundles_centre(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_op = fit->groom->n_operator_guides;
    struct middle *middle = memory_array_zero(allocator, n_op, sizeof *middle);
    if (!middle)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to move %u operator guides", n_op);
    centre(fit, middle, context);
    memory_release(allocator, middle, n_op, sizeof *middle);
    return GROOM_OK;
}

/* --- all --------------------------------------------------------------------------------------- */

static groom_status find(struct bundling *b, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = b->fit->n, n_op = b->fit->groom->n_operator_guides;
    struct groom_neighbours *index = NULL;
    size_t n_shape = (size_t)n_op * b->fit->m;
    uint32_t *guide = memory_array(allocator, n_op, 2 * sizeof *guide);
    float (*shape)[3] = memory_array(allocator, n_shape, sizeof *shape);
    struct middle *middle = memory_array_zero(allocator, n_op, sizeof *middle);
    groom_status st = guide && shape && middle ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to name operator guides");
    if (st != GROOM_OK ||
        (st = groom_neighbours_create(b->fit->root_uv[0], n, 2, context, &index, diag)) != GROOM_OK ||
        (st = groom_neighbours_find(index, b->fit->root_uv[0], n, NEIGHBOURS + 1, b->neighbour, NULL, context, diag)) != GROOM_OK)
        goto out;
    measure_rest(b);
    for (uint32_t i = 0; i < n; i++)
        b->length[i] = groom_polyline_length((const float (*)[3])(b->fit->target + (size_t)i * b->fit->m), b->fit->m);
    for (uint32_t o = 0; o < b->fit->options.n_operators; o++)
        b->winds |= b->fit->options.operators[o] == GROOM_OPERATOR_CURL;
    parallel_for(context, (n + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE, compare_piece, b);
    if ((st = regions_merge(b->edge, (size_t)n * NEIGHBOURS, n, n_op, b->region, allocator)) != GROOM_OK) {
        groom_fail(diag, st, "no memory to bundle %u strands", n);
        goto out;
    }
    measure_regions(b);
    if ((st = name_guides(b, guide, allocator)) != GROOM_OK) {
        groom_fail(diag, st, "no memory to name %u operator guides", n_op);
        goto out;
    }
    shape_guides(b, guide, shape);
    write_assignment(b, guide, guide + n_op);
    centre(b->fit, middle, context);
out:
    groom_neighbours_destroy(index);
    memory_release(allocator, guide, n_op, 2 * sizeof *guide);
    memory_release(allocator, shape, n_shape, sizeof *shape);
    memory_release(allocator, middle, n_op, sizeof *middle);
    return st;
}

groom_status bundles_find(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->n, n_op = fit->groom->n_operator_guides;
    struct bundling b = {.fit = fit, .q = fit->m < FEATURES ? fit->m : FEATURES};
    groom_status st;
    b.vertex = memory_array(allocator, b.q, sizeof *b.vertex);
    b.length = memory_array(allocator, n, sizeof *b.length);
    b.rest = memory_array(allocator, b.q, sizeof *b.rest);
    b.neighbour = memory_array(allocator, n, (NEIGHBOURS + 1) * sizeof *b.neighbour);
    b.edge = memory_array(allocator, n, NEIGHBOURS * sizeof *b.edge);
    b.region = memory_array(allocator, n, sizeof *b.region);
    b.middle = memory_array(allocator, n_op, sizeof *b.middle);
    b.count = memory_array(allocator, n_op, sizeof *b.count);
    if (b.vertex && b.length && b.rest && b.neighbour && b.edge && b.region && b.middle && b.count) {
        for (uint32_t s = 0; s < b.q; s++)
            b.vertex[s] = (uint32_t)((uint64_t)s * (fit->m - 1) / (b.q - 1));
        st = find(&b, context, diag);
    } else
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to bundle %u strands", n);
    memory_release(allocator, b.vertex, b.q, sizeof *b.vertex);
    memory_release(allocator, b.length, n, sizeof *b.length);
    memory_release(allocator, b.rest, b.q, sizeof *b.rest);
    memory_release(allocator, b.neighbour, n, (NEIGHBOURS + 1) * sizeof *b.neighbour);
    memory_release(allocator, b.edge, n, NEIGHBOURS * sizeof *b.edge);
    memory_release(allocator, b.region, n, sizeof *b.region);
    memory_release(allocator, b.middle, n_op, sizeof *b.middle);
    memory_release(allocator, b.count, n_op, sizeof *b.count);
    return st;
}
