#include "fit/draws.h"

double draws_excess(const struct bundle_mean *bundle, uint32_t n_bundles, double about, double drawn)
{
    double sum = 0, told = 0;
    for (uint32_t o = 0; o < n_bundles; o++)
        if (bundle[o].n > 0) {
            sum += (bundle[o].mean - about) * (bundle[o].mean - about) - drawn / bundle[o].n;
            told++;
        }
    return told > 0 ? fmax(sum / told, 0) : 0;
}
