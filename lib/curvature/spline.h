/* The C2 cubic through a polyline's vertices, not-a-knot, by chord length; and its arc length. */
#ifndef CURVATURE_SPLINE_H
#define CURVATURE_SPLINE_H

#include <stdint.h>

#include "curvature/vector.h"

struct spline {
    uint32_t n;       /* knots, at least 2, no two neighbours equal */
    vec3 *point;      /* [n] */
    vec3 *slope;      /* [n] derivative with respect to the chord length */
    double *h;        /* [n + 3] chord of the segment that begins here; the rest is unused */
    double *arc;      /* [n] arc length from the root */
    double *work;     /* [n] of the solver */
    double *rate;     /* [9][n + 3] the derivative in a segment, a + b u + c u^2: x, y, z of a, of b, of c */
};

/* From point and h: slope, rate and arc. Pure arithmetic on the caller's arrays. */
void spline_solve(struct spline *s);

/* Points and unit tangents at n rising arc lengths. */
void spline_at(const struct spline *s, const double *arc, uint32_t n, vec3 *point, vec3 *tangent);

#endif
