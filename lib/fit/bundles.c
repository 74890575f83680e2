#include "fit/bundles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "fit/likeness.h"
#include "fit/sites.h"

struct bundling {
    struct groom_fit *fit;
    struct likeness likeness;
    uint32_t *region;           /* [n] */
    double (*middle)[3];        /* [n_gop] mean roots of regions */
    uint32_t *count;            /* [n_gop] */
};

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

struct nearest { double square; uint32_t strand; };

/* Where the file brought the scalp coordinates, no chart tells those of a new place: they are those of the
 * nearest strand of the guide's own. */
static void take_coordinates(struct groom_fit *fit, struct nearest *nearest)
{
    struct groom *groom = fit->groom;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        nearest[o] = (struct nearest){INFINITY, 0};
    for (uint32_t i = 0; i < fit->n; i++) {
        struct nearest *of = &nearest[groom->operator_guide_of[i]];
        const float *root = groom->guides[(size_t)groom->operator_guide[groom->operator_guide_of[i]] * fit->m];
        double square = 0;
        for (int c = 0; c < 3; c++)
            square += ((double)fit->roots[i][c] - root[c]) * ((double)fit->roots[i][c] - root[c]);
        if (square < of->square)
            *of = (struct nearest){square, i};
    }
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        if (nearest[o].square < (double)INFINITY)
            memcpy(groom->guide_uv[groom->operator_guide[o]], fit->root_uv[nearest[o].strand], sizeof *groom->guide_uv);
}

static void find_coordinates(struct groom_fit *fit, struct nearest *nearest, const struct groom_context *context)
{
    const struct groom *groom = fit->groom;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        uint32_t guide = groom->operator_guide[o];
        if (fit->scalp)
            groom_scalp_coordinates(fit->scalp, (const float (*)[3])groom->guides + (size_t)guide * fit->m, 1, groom->guide_uv + guide, context);
    }
    if (!fit->scalp)
        take_coordinates(fit, nearest);
}

groom_status bundles_coordinates(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_op = fit->groom->n_operator_guides;
    struct nearest *nearest = memory_array(allocator, n_op, sizeof *nearest);
    if (!nearest)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the coordinates of %u operator guides", n_op);
    find_coordinates(fit, nearest, context);
    memory_release(allocator, nearest, n_op, sizeof *nearest);
    return GROOM_OK;
}

static void move_root(struct groom_fit *fit, uint32_t guide, const double to[3])
{
    float (*x)[3] = fit->groom->guides + (size_t)guide * fit->m;
    for (int c = 0; c < 3; c++) {
        float move = (float)to[c] - x[0][c];
        for (uint32_t j = 0; j < fit->m; j++)
            x[j][c] += move;
    }
}

/* guide [n_gop] of each region */
static void move_to_sites(struct groom_fit *fit, const uint32_t *guide, const struct site *site, struct nearest *nearest,
                          const struct groom_context *context)
{
    for (uint32_t k = 0; k < fit->groom->n_operator_guides; k++)
        if (site[k].n > 0)
            move_root(fit, guide[k], site[k].at);
    find_coordinates(fit, nearest, context);
}

/* --- all --------------------------------------------------------------------------------------- */

static int winds(const struct groom_fit *fit)
{
    int any = 0;
    for (uint32_t o = 0; o < fit->options.n_operators; o++)
        any |= fit->options.operators[o] == GROOM_OPERATOR_CURL;
    return any;
}

static groom_status find(struct bundling *b, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = b->fit->n, n_op = b->fit->groom->n_operator_guides;
    size_t n_shape = (size_t)n_op * b->fit->m;
    uint32_t *guide = memory_array(allocator, n_op, 2 * sizeof *guide);
    float (*shape)[3] = memory_array(allocator, n_shape, sizeof *shape);
    struct site *site = memory_array(allocator, n_op, sizeof *site);
    struct nearest *nearest = memory_array(allocator, n_op, sizeof *nearest);
    groom_status st = guide && shape && site && nearest ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to name operator guides");
    if (st != GROOM_OK || (st = likeness_init(&b->likeness, b->fit, winds(b->fit), context, diag)) != GROOM_OK)
        goto out;
    if ((st = regions_merge(b->likeness.edge, (size_t)n * LIKENESS_NEIGHBOURS, n, n_op, b->region, allocator)) != GROOM_OK) {
        groom_fail(diag, st, "no memory to bundle %u strands", n);
        goto out;
    }
    measure_regions(b);
    if ((st = name_guides(b, guide, allocator)) != GROOM_OK) {
        groom_fail(diag, st, "no memory to name %u operator guides", n_op);
        goto out;
    }
    if ((st = sites_find(b->fit, b->region, n_op, site, context, diag)) != GROOM_OK)
        goto out;
    shape_guides(b, guide, shape);
    write_assignment(b, guide, guide + n_op);
    move_to_sites(b->fit, guide, site, nearest, context);
out:
    memory_release(allocator, guide, n_op, 2 * sizeof *guide);
    memory_release(allocator, shape, n_shape, sizeof *shape);
    memory_release(allocator, site, n_op, sizeof *site);
    memory_release(allocator, nearest, n_op, sizeof *nearest);
    return st;
}

groom_status bundles_find(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->n, n_op = fit->groom->n_operator_guides;
    struct bundling b = {.fit = fit};
    b.region = memory_array(allocator, n, sizeof *b.region);
    b.middle = memory_array(allocator, n_op, sizeof *b.middle);
    b.count = memory_array(allocator, n_op, sizeof *b.count);
    groom_status st = b.region && b.middle && b.count ? find(&b, context, diag)
                                                       : groom_fail(diag, GROOM_ENOMEM, "no memory to bundle %u strands", n);
    likeness_finish(&b.likeness);
    memory_release(allocator, b.region, n, sizeof *b.region);
    memory_release(allocator, b.middle, n_op, sizeof *b.middle);
    memory_release(allocator, b.count, n_op, sizeof *b.count);
    return st;
}
