/* The engine's gradient against central differences of the double-precision reference. */
#ifndef SUPPORT_DIFFERENCES_H
#define SUPPORT_DIFFERENCES_H

#include "groom/groom.h"

/* What both sides differentiate: the sum of fixed random coefficients times all coordinates. */
struct groom_adjoint test_linear_adjoint(const struct groom *groom);

/* Worst difference of each group of numbers, divided by the largest true derivative of the group, each
 * strand's part taken by its absolute value (at least 1e-5); NaN anywhere gives INFINITY. */
struct gradient_error {
    double guides, weights;
    double parameters, randoms; /* the worst operator's */
};

/* strand  [count] those that are visited, or NULL for all */
struct gradient_error test_gradient_error(const struct groom *groom, const uint32_t *strand, uint32_t count);

#endif
