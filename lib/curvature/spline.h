/* The C2 cubic through a polyline's vertices, not-a-knot, by chord length; and its arc length. */
#ifndef CURVATURE_SPLINE_H
#define CURVATURE_SPLINE_H

#include <stdint.h>

#include "curvature/vector.h"

struct spline {
    uint32_t n;       /* knots, at least 2, no two neighbours equal */
    vec3 *point;      /* [n] */
    vec3 *slope;      /* [n] derivative with respect to the chord length */
    double *h;        /* [n] chord of the segment that begins here; the last is unused */
    double *arc;      /* [n] arc length from the root */
    double *work;     /* [n] of the solver */
};

/* From point and h: slope and arc. Pure arithmetic on the caller's arrays. */
void spline_solve(struct spline *s);

/* Point and unit tangent at an arc length; *segment is a hint that only moves forward (start at 0). */
void spline_at(const struct spline *s, double arc, uint32_t *segment, vec3 *point, vec3 *tangent);

#endif
