/* One polyline to one super-helix, in memory that was sized beforehand. */
#ifndef CURVATURE_CONVERT_STRAND_H
#define CURVATURE_CONVERT_STRAND_H

#include <stdint.h>

#include "curvature/refine.h"
#include "curvature/spline.h"
#include "groom/curvature.h"

/* A fit and what it came from; two of them, so that the best is kept while another count is tried. */
struct convert_fit {
    struct refine_strand strand;
    double worst, sum;
};

/* Scratch of one thread, for strands of at most so many vertices and elements. */
struct convert_space {
    uint32_t max_vertices, max_elements;
    struct spline spline;
    vec3 *vertex;        /* [max_vertices] relative to the root */
    uint32_t *knot;      /* [max_vertices] the spline knot of each vertex */
    double *breaks;      /* [max_elements + 1] arc lengths */
    double *flips;       /* [max_vertices] arc lengths where handedness changes */
    vec3 *p, *t;         /* [max_elements + 1] */
    double *work;        /* [2 max_elements] */
    struct refine_space refine;
    struct convert_fit fits[2];
    struct convert_fit *best;
};

/* Elements that a strand of n vertices may come to have. */
uint32_t convert_max_elements(const struct groom_conversion_options *options, uint32_t n_vertices);

/* Convert points[n]; the result is space->best->strand (relative to points[0]). */
void convert_strand(struct convert_space *space, const struct groom_conversion_options *options,
                    const float (*points)[3], uint32_t n, struct groom_conversion_report *report);

#endif
