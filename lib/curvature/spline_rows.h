/* Arc lengths and stations of a spline (curvature/spline.h), four at a time. */
#ifndef CURVATURE_SPLINE_ROWS_H
#define CURVATURE_SPLINE_ROWS_H

#include <stdint.h>

/* A solved spline as rows of doubles. */
struct spline_curve {
    uint32_t n;               /* knots */
    const double *rate, *h, *arc;
    const double (*point)[3];
};

/* arc [n]: the running arc length at the knots, five points of Gauss and Legendre a segment. */
typedef void spline_arcs_function(uint32_t n, const double *rate, const double *h, double *arc);
/* Points and unit tangents at n_at rising arc lengths. */
typedef void spline_stations_function(const struct spline_curve *curve, const double *at, uint32_t n_at,
                                      double (*point)[3], double (*tangent)[3]);

/* Every variant gives the same bits. */
spline_arcs_function spline_arcs_generic, spline_arcs_avx2;
spline_stations_function spline_stations_generic, spline_stations_avx2;

#endif
