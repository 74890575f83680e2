/* Numbers that operators draw from -1 to 1, and what those of a bundle have in common beyond chance. */
#ifndef FIT_DRAWS_H
#define FIT_DRAWS_H

#include <math.h>
#include <stdint.h>

/* Standard deviation of N(0, 1) truncated to -1..1, which scales, bends and frequencies draw from. */
#define DRAWS_DEVIATION 0.5396

struct bundle_mean { double n, mean; }; /* strands, and the mean of a value of theirs */

/* The variance of bundles' means around `about` beyond that of means of draws, whose own is `drawn`; at least 0. Bundles of
 * no strands say nothing. */
double draws_excess(const struct bundle_mean *bundle, uint32_t n_bundles, double about, double drawn);

static inline float draws_in_range(double number) { return (float)fmin(fmax(number, -1), 1); }

#endif
