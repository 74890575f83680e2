/* The computed chart of a scalp: azimuthal equidistant about a sphere, or a plane. */
#ifndef GEOMETRY_CHART_H
#define GEOMETRY_CHART_H

#include <stdint.h>

#include "geometry/vec.h"

struct chart {
    int planar;
    struct vec centre, u, v, n; /* orthonormal; n through the pole, outwards */
    double radius;              /* of the sphere */
};

/* Fit to n >= 1 finite points. outward is the mean normal of the surface under them, or zero where
 * no surface is known; then the sphere, or +y, tells the outside. */
void chart_fit(struct chart *chart, const float (*points)[3], uint32_t n, struct vec outward);

/* Metres from the pole, along u and v. */
void chart_map(const struct chart *chart, struct vec point, double out[2]);

#endif
