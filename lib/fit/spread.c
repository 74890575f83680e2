#include "fit/spread.h"

#include <math.h>

#define STEPS 200
#define TOLD_OTHERWISE 4.0 /* samples that what is known of the error counts for */

/* How much of what a sample is off the mean is the thing's own. */
static double own_share(const struct spread_law *law, double size)
{
    double error = law->error * size * size, all = law->variance + error;
    return all > 0 ? law->variance / all : 1;
}

double spread_expect(const struct spread_law *law, const struct spread_sample *sample)
{
    return law->mean + own_share(law, sample->size) * (sample->value - law->mean);
}

/* Mean and variance as if nothing were an error. */
static struct spread_law begin(const struct spread_sample *sample, uint32_t n, double error)
{
    struct spread_law law = {.error = error};
    double all = 0, square = 0;
    for (uint32_t i = 0; i < n; i++) {
        all += sample[i].weight;
        law.mean += sample[i].weight * sample[i].value;
        square += sample[i].weight * sample[i].value * sample[i].value;
    }
    law.mean = all > 0 ? law.mean / all : 0;
    law.variance = all > 0 ? fmax(square / all - law.mean * law.mean, 0) : 0;
    return law;
}

/* The mean by what each sample is good for. */
static double mean_of(const struct spread_sample *sample, uint32_t n, const struct spread_law *law)
{
    double all = 0, sum = 0;
    for (uint32_t i = 0; i < n; i++) {
        double good = sample[i].weight * own_share(law, sample[i].size);
        all += good;
        sum += good * sample[i].value;
    }
    return all > 0 ? sum / all : law->mean;
}

/* Variances by what is expected to be the things' own, and what their errors. */
static void step(const struct spread_sample *sample, uint32_t n, double known, struct spread_law *law)
{
    double all = 0, own = 0, errors = 0;
    law->mean = mean_of(sample, n, law);
    for (uint32_t i = 0; i < n; i++) {
        double weight = sample[i].weight, share = own_share(law, sample[i].size), off = sample[i].value - law->mean;
        double unsure = law->variance * (1 - share), rest = (1 - share) * off;
        all += weight;
        own += weight * (share * off * share * off + unsure);
        if (sample[i].size > 0)
            errors += weight * (rest * rest + unsure) / (sample[i].size * sample[i].size);
    }
    if (!(all > 0))
        return;
    double told = TOLD_OTHERWISE * all / n; /* weights need not be 1 */
    law->variance = own / all;
    law->error = (errors + told * known) / (all + told);
}

void spread_find(const struct spread_sample *sample, uint32_t n, double error, struct spread_law *law)
{
    *law = begin(sample, n, error);
    for (int k = 0; k < STEPS; k++)
        step(sample, n, error, law);
}
