#include "fit/centre.h"

#include <math.h>

#include "base/memory.h"
#include "fit/draws.h"

enum { RANDOM_SCALE = 0 }; /* of a scale's parameters */

static int is_centred(const struct groom_operator *op)
{
    return op->enabled && op->parameter[0] != 0 && (op->type == GROOM_OPERATOR_SCALE || op->type == GROOM_OPERATOR_BEND);
}

/* --- all strands --------------------------------------------------------------------------------- */

static void stretch_guides(struct groom *groom, double by)
{
    for (uint32_t g = 0; g < groom->n_guides; g++) {
        float (*x)[3] = groom->guides + (size_t)g * groom->n_vertices;
        for (uint32_t j = 1; j < groom->n_vertices; j++)
            for (int c = 0; c < 3; c++)
                x[j][c] = (float)(x[0][c] + by * ((double)x[j][c] - x[0][c]));
    }
}

static void centre_scale(struct groom *groom, struct groom_operator *op)
{
    double sum = 0, random_scale = (double)op->parameter[RANDOM_SCALE];
    for (uint32_t i = 0; i < groom->n_strands; i++)
        sum += 1 + random_scale * (double)op->random[0][i];
    double common = sum / groom->n_strands;
    if (!(common > 0))
        return;
    for (uint32_t i = 0; i < groom->n_strands; i++)
        op->random[0][i] = draws_in_range(((1 + random_scale * (double)op->random[0][i]) / common - 1) / random_scale);
    stretch_guides(groom, common);
}

void centre_scales(struct groom *groom)
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (groom->operators[o].type == GROOM_OPERATOR_SCALE && is_centred(&groom->operators[o]))
            centre_scale(groom, &groom->operators[o]);
}

/* --- bundles --------------------------------------------------------------------------------------- */

static void measure(const struct groom *groom, const float *number, struct bundle_mean *bundle)
{
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        bundle[o] = (struct bundle_mean){0};
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        bundle[groom->operator_guide_of[i]].n++;
        bundle[groom->operator_guide_of[i]].mean += (double)number[i];
    }
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        bundle[o].mean /= fmax(bundle[o].n, 1);
}

/* The variance of numbers around their bundles' means. */
static double variance_within(const struct groom *groom, const float *number, const struct bundle_mean *bundle)
{
    double sum = 0, degrees = groom->n_strands;
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        double off = (double)number[i] - bundle[groom->operator_guide_of[i]].mean;
        sum += off * off;
    }
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        degrees -= bundle[o].n > 0;
    return degrees > 0 ? sum / degrees : 0;
}

static void centre_numbers(const struct groom *groom, float *number, struct bundle_mean *bundle)
{
    measure(groom, number, bundle);
    double within = variance_within(groom, number, bundle);
    double excess = draws_excess(bundle, groom->n_operator_guides, 0, within);
    for (uint32_t i = 0; excess > 0 && i < groom->n_strands; i++) {
        const struct bundle_mean *own = &bundle[groom->operator_guide_of[i]];
        number[i] = draws_in_range((double)number[i] - own->mean * excess / (excess + within / own->n));
    }
}

groom_status centre_bundles(struct groom *groom, const struct groom_allocator *allocator, struct groom_diag *diag)
{
    struct bundle_mean *bundle = memory_array(allocator, groom->n_operator_guides, sizeof *bundle);
    if (!bundle)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the numbers of %u bundles", groom->n_operator_guides);
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (is_centred(&groom->operators[o]))
            centre_numbers(groom, groom->operators[o].random[0], bundle);
    memory_release(allocator, bundle, groom->n_operator_guides, sizeof *bundle);
    return GROOM_OK;
}
