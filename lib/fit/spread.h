/* The law that things are of, off measurements some of which are better than others.
 *
 * value = mean + N(0, variance) + N(0, error size^2): how far things differ is told from how far measurements of them
 * are off by those of small size, which are good, and by how much farther apart those of large size are. */
#ifndef FIT_SPREAD_H
#define FIT_SPREAD_H

#include <stdint.h>

struct spread_sample {
    double value, weight;
    double size; /* of its error, over that of the others */
};

struct spread_law {
    double mean, variance;
    double error; /* variance of what is measured at size 1 */
};

/* Likeliest, by steps of expectation and maximisation (Dempster, Laird and Rubin 1977), smooth in all that goes in.
 * error    what is known of `error` otherwise, as if a few of the samples had told it
 * n        0: a law of nothing */
void spread_find(const struct spread_sample *sample, uint32_t n, double error, struct spread_law *law);

/* What is expected of a thing that was measured so. */
double spread_expect(const struct spread_law *law, const struct spread_sample *sample);

#endif
