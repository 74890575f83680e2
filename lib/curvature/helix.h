/* Helices through points with tangents: Derouet-Jourdan et al. 2013, "Floating tangents for
 * approximating spatial curves with G1 piecewise helices". */
#ifndef CURVATURE_HELIX_H
#define CURVATURE_HELIX_H

#include <stdint.h>

#include "curvature/vector.h"

/* Move points 1..n as little as possible (least squares, one tridiagonal solve) so that every pair
 * of neighbours is co-helical: (p1 - p0).(t1 - t0) = 0. Point 0 stays.
 * p, t     [n + 1] points and unit tangents
 * work     [2 n] */
void helix_float_points(uint32_t n, vec3 *p, const vec3 *t, double *work);

/* The shortest helix from (p0, t0) to (p1, t1), a co-helical pair with p0 != p1: its Darboux vector in
 * the world and its length. Where tangents and chord contradict each other (the helix would take a
 * loop longer than twice the chord's share), the arc that turns t0 into t1 and is as long as the chord
 * asks. */
struct helix {
    vec3 omega;
    double length;
};
struct helix helix_through(vec3 p0, vec3 t0, vec3 p1, vec3 t1);

/* The arc that turns t0 into t1 the short way, as long as the chord asks. */
struct helix helix_plain_arc(double chord, vec3 t0, vec3 t1);

#endif
