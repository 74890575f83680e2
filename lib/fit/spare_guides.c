#include "fit/spare_guides.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "fit/bundles.h"
#include "fit/sites.h"
#include "fit/strand_state.h"
#include "fit/weights.h"

#define WHOLE 0.95f /* weight of a guide that a strand cannot do without */

static float (*guide_points(struct groom *groom, uint32_t guide))[3]
{
    return groom->guides + (size_t)guide * groom->n_vertices;
}

/* --- one operator guide ------------------------------------------------------------------------ */

/* The mean root of the strands that follow it; returns how many do. */
static uint32_t find_middle(const struct groom *groom, uint32_t o, double middle[3])
{
    uint32_t n = 0;
    memset(middle, 0, 3 * sizeof *middle);
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        if (groom->operator_guide_of[i] != o)
            continue;
        n++;
        for (int c = 0; c < 3; c++)
            middle[c] += (double)groom->roots[i][c];
    }
    for (int c = 0; c < 3; c++)
        middle[c] /= n ? n : 1;
    return n;
}

/* Of its strands, from their roots on. */
static void mean_blend(struct groom *groom, uint32_t o, uint32_t n, double (*shape)[3])
{
    uint32_t k = groom->n_instancing, m = groom->n_vertices;
    memset(shape, 0, m * sizeof *shape);
    for (size_t i = 0; i < groom->n_strands; i++)
        for (uint32_t a = 0; groom->operator_guide_of[i] == o && a < k; a++) {
            const float (*x)[3] = (const float (*)[3])guide_points(groom, groom->instancing_guide[i * k + a]);
            double weight = (double)groom->instancing_weight[i * k + a] / n;
            for (uint32_t j = 0; weight > 0 && j < m; j++)
                for (int c = 0; c < 3; c++)
                    shape[j][c] += weight * ((double)x[j][c] - (double)x[0][c]);
        }
}

void spare_guide_stand(struct groom *groom, uint32_t spare, double (*shape)[3])
{
    float (*x)[3] = guide_points(groom, groom->operator_guide[spare]);
    double middle[3];
    uint32_t n = find_middle(groom, spare, middle);
    if (n == 0)
        return;
    mean_blend(groom, spare, n, shape);
    for (uint32_t j = 0; j < groom->n_vertices; j++)
        for (int c = 0; c < 3; c++)
            x[j][c] = (float)(middle[c] + shape[j][c]);
}

static int is_operator_guide(const struct groom *groom, uint32_t guide)
{
    int any = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        any |= groom->operator_guide[o] == guide;
    return any;
}

static uint32_t nearest_free(struct groom *groom, const struct groom *was, const double place[3])
{
    uint32_t best = UINT32_MAX;
    double least = INFINITY;
    for (uint32_t g = 0; g < groom->n_guides; g++) {
        const float *root = *guide_points(groom, g);
        double square = 0;
        for (int c = 0; c < 3; c++)
            square += ((double)root[c] - place[c]) * ((double)root[c] - place[c]);
        if (square < least && !is_operator_guide(groom, g) && !is_operator_guide(was, g)) {
            least = square;
            best = g;
        }
    }
    return best;
}

/* Strands that are blended from a guide that goes away are of their others. */
static void blend_without(struct groom *groom, uint32_t guide)
{
    uint32_t k = groom->n_instancing;
    for (size_t i = 0; i < groom->n_strands; i++)
        for (uint32_t a = 0; a < k; a++) {
            float *weight = groom->instancing_weight + i * k, of_it = weight[a];
            if (groom->instancing_guide[i * k + a] != guide || of_it >= WHOLE)
                continue;
            weight[a] = 0;
            for (uint32_t b = 0; b < k; b++)
                weight[b] /= 1 - of_it;
        }
}

void spare_guide_take(struct groom *groom, const struct groom *was, uint32_t spare, double (*shape)[3])
{
    double middle[3];
    if (find_middle(groom, spare, middle) == 0)
        return;
    uint32_t guide = nearest_free(groom, was, middle);
    if (guide != UINT32_MAX)
        groom->operator_guide[spare] = guide;
    else
        blend_without(groom, groom->operator_guide[spare]);
    spare_guide_stand(groom, spare, shape);
}

void spare_guide_put_back(struct groom *groom, const struct groom *was, uint32_t spare)
{
    uint32_t taken = groom->operator_guide[spare], own = was->operator_guide[spare], m = groom->n_vertices;
    size_t k = groom->n_instancing;
    memcpy(guide_points(groom, taken), was->guides + (size_t)taken * m, m * sizeof *groom->guides);
    groom->operator_guide[spare] = own;
    for (size_t at = 0; taken == own && at < groom->n_strands * k; at++)
        if (groom->instancing_guide[at] == own)
            memcpy(groom->instancing_weight + at / k * k, was->instancing_weight + at / k * k, k * sizeof *groom->instancing_weight);
}

/* --- all that have traded places ------------------------------------------------------------------ */

static void move_root(struct groom *groom, uint32_t o, const struct site *site)
{
    float (*x)[3] = guide_points(groom, groom->operator_guide[o]);
    for (int c = 0; c < 3 && site->n > 0; c++) {
        float move = (float)site->at[c] - x[0][c];
        for (uint32_t j = 0; j < groom->n_vertices; j++)
            x[j][c] += move;
    }
}

static groom_status go_to_sites(struct groom_fit *fit, const struct trades *trades, const uint8_t *kept,
                                const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom *groom = fit->groom;
    struct site *site = memory_array(allocator, groom->n_operator_guides, sizeof *site);
    groom_status st = site ? sites_find(fit, groom->operator_guide_of, groom->n_operator_guides, site, context, diag)
                           : groom_fail(diag, GROOM_ENOMEM, "no memory for the places of operator guides");
    for (uint32_t t = 0; st == GROOM_OK && t < trades->n; t++)
        if (kept[t]) {
            move_root(groom, trades->trade[t].bundle, &site[trades->trade[t].bundle]);
            move_root(groom, trades->trade[t].spare, &site[trades->trade[t].spare]);
        }
    memory_release(allocator, site, groom->n_operator_guides, sizeof *site);
    return st == GROOM_OK ? bundles_coordinates(fit, context, diag) : st;
}

/* The mean of the clusters of its strands: centroid [m] */
static void mean_cluster(const struct groom_fit *fit, uint32_t o, float (*centroid)[3], double (*sum)[3])
{
    uint32_t n = 0, m = fit->m;
    memset(sum, 0, m * sizeof *sum);
    for (uint32_t i = 0; i < fit->n; i++) {
        const float (*x)[3] = (const float (*)[3])fit->centroids + (size_t)fit->cluster_of[i] * m;
        if (fit->groom->operator_guide_of[i] != o)
            continue;
        n++;
        for (uint32_t j = 0; j < m; j++)
            for (int c = 0; c < 3; c++)
                sum[j][c] += (double)x[j][c] - (double)x[0][c];
    }
    for (uint32_t j = 1; n > 0 && j < m; j++)
        for (int c = 0; c < 3; c++)
            centroid[j][c] = (float)((double)centroid[0][c] + sum[j][c] / n);
}

static float (*centroid_of(const struct groom_fit *fit, uint32_t o))[3]
{
    return fit->centroids + (size_t)fit->groom->operator_guide[o] * fit->m;
}

/* Guides that stand elsewhere now. moved [n_guides] */
static void mark_moved(const struct groom *groom, const struct trades *trades, const uint8_t *kept, uint8_t *moved)
{
    memset(moved, 0, groom->n_guides);
    for (uint32_t t = 0; t < trades->n; t++)
        if (kept[t])
            moved[groom->operator_guide[trades->trade[t].bundle]] = moved[groom->operator_guide[trades->trade[t].spare]] = 1;
}

static int is_of_moved(const uint32_t *guide, uint32_t k, const uint8_t *moved)
{
    int any = 0;
    for (uint32_t a = 0; a < k; a++)
        any |= moved[guide[a]];
    return any;
}

/* Blends of strands that had or would have one of the moved guides. */
static groom_status blend_anew(struct groom_fit *fit, const uint8_t *moved, const struct groom_context *context,
                               struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom *groom = fit->groom;
    uint32_t k = groom->n_instancing;
    struct weights_loss loss = {0};
    struct strand_state before;
    groom_status st = strand_state_init(&before, groom, NULL, 0, fit->n, allocator, diag);
    if (st == GROOM_OK)
        st = weights_solve(fit, 0, fit->n, context, &loss, diag);
    for (uint32_t i = 0; st == GROOM_OK && i < fit->n; i++)
        if (!is_of_moved(before.guide + (size_t)i * k, k, moved) && !is_of_moved(groom->instancing_guide + (size_t)i * k, k, moved))
            strand_state_give_back(&before, groom, i);
    strand_state_finish(&before, allocator);
    return st;
}

static void mean_clusters(struct groom_fit *fit, const struct trades *trades, const uint8_t *kept, double (*sum)[3])
{
    for (uint32_t t = 0; t < trades->n; t++)
        if (kept[t])
            mean_cluster(fit, trades->trade[t].spare, centroid_of(fit, trades->trade[t].spare), sum);
}

groom_status spare_guides_settle(struct groom_fit *fit, const struct trades *trades, const uint8_t *kept,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t m = fit->m, n_was = trades->n * m;
    float (*was)[3] = memory_array(allocator, n_was, sizeof *was);
    double (*sum)[3] = memory_array(allocator, m, sizeof *sum);
    uint8_t *moved = memory_array(allocator, fit->n_guides, 1);
    groom_status st = was && sum && moved ? go_to_sites(fit, trades, kept, context, diag)
                                          : groom_fail(diag, GROOM_ENOMEM, "no memory for the clusters of %u guides", trades->n);
    if (st == GROOM_OK) {
        for (uint32_t t = 0; t < trades->n; t++)
            memcpy(was + t * m, centroid_of(fit, trades->trade[t].spare), m * sizeof *was);
        mean_clusters(fit, trades, kept, sum);
        mark_moved(fit->groom, trades, kept, moved);
        st = blend_anew(fit, moved, context, diag);
        for (uint32_t t = 0; st != GROOM_OK && t < trades->n; t++)
            memcpy(centroid_of(fit, trades->trade[t].spare), was + t * m, m * sizeof *was);
    }
    memory_release(allocator, was, n_was, sizeof *was);
    memory_release(allocator, sum, m, sizeof *sum);
    memory_release(allocator, moved, fit->n_guides, 1);
    return st;
}
