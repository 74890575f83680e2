/* How sharply strands turn. */
#ifndef FIT_MEAN_CURVATURE_H
#define FIT_MEAN_CURVATURE_H

#include <stdint.h>

/* Mean curvature, 1 over the unit of the points, beyond the first sixth of each strand, where guides turn out of the
 * scalp; between vertices two apart, for a polyline that was resampled has lost corners next to one another, and how many
 * depends on how its vertices stood. A turn counts by the difference of two directions, which of small ones is the angle;
 * one half of a turn counts 2 in place of pi.
 * points   [n][m][3]
 * returns  0 where there are too few vertices, or nothing but straight strands */
double mean_curvature(const float (*points)[3], uint32_t n, uint32_t m);

#endif
