#include "fit/lengths.h"

#include <math.h>

#include "base/memory.h"
#include "fit/draws.h"

enum { RANDOM_SCALE = 0 };              /* of a scale's parameters, */
enum { FREQUENCY = 1, RANDOM_FREQUENCY }; /* of a curl's */


static double scale_of(const struct groom_operator *scale, uint32_t strand)
{
    return 1 + (double)scale->parameter[RANDOM_SCALE] * (double)scale->random[0][strand];
}

static double frequency_of(const struct groom_operator *curl, uint32_t guide)
{
    return (double)curl->parameter[FREQUENCY] + (double)curl->parameter[RANDOM_FREQUENCY] * (double)curl->random[0][guide];
}

/* Means over bundles, as parts of the mean over all strands. */
static void measure(const struct groom *groom, const struct groom_operator *scale, struct bundle_mean *bundle)
{
    double sum = 0;
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        bundle[groom->operator_guide_of[i]].n++;
        bundle[groom->operator_guide_of[i]].mean += scale_of(scale, i);
        sum += scale_of(scale, i);
    }
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        bundle[o].mean = bundle[o].n > 0 && sum > 0 ? bundle[o].mean / bundle[o].n * (groom->n_strands / sum) : 1;
}

/* Frequencies `ratio` times what they were, as far as their range lets them; ratio becomes what it was. */
static void move_frequency(struct groom_operator *curl, uint32_t guide, double *ratio)
{
    double was = frequency_of(curl, guide), random = (double)curl->parameter[RANDOM_FREQUENCY];
    *ratio = random > 0 && was > 0 ? *ratio : 1;
    if (*ratio == 1)
        return;
    curl->random[0][guide] = draws_in_range((was * *ratio - (double)curl->parameter[FREQUENCY]) / random);
    *ratio = frequency_of(curl, guide) / was;
}

groom_status lengths_settle(struct groom *groom, struct groom_operator *curl, struct groom_operator *scale,
                            const struct groom_allocator *allocator, struct groom_diag *diag)
{
    uint32_t n = groom->n_operator_guides;
    double eta = (double)scale->parameter[RANDOM_SCALE], drawn = pow(eta * DRAWS_DEVIATION, 2);
    struct bundle_mean *bundle = memory_array_zero(allocator, n, sizeof *bundle);
    if (!bundle)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the lengths of %u curls", n);
    measure(groom, scale, bundle);
    double excess = draws_excess(bundle, n, 1, drawn);
    for (uint32_t o = 0; o < n; o++) { /* from here on `mean` is what strands are shortened by */
        double error = bundle[o].n > 0 && excess > 0 ? excess / (excess + drawn / bundle[o].n) : 0;
        bundle[o].mean = 1 + error * (bundle[o].mean - 1);
        move_frequency(curl, o, &bundle[o].mean);
    }
    for (uint32_t i = 0; i < groom->n_strands && eta > 0; i++)
        scale->random[0][i] = draws_in_range((scale_of(scale, i) / bundle[groom->operator_guide_of[i]].mean - 1) / eta);
    memory_release(allocator, bundle, n, sizeof *bundle);
    return GROOM_OK;
}
