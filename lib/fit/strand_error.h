/* How far strands are from their targets, strand by strand: what random numbers are chosen by.
 *
 * The terms of Chang et al. 2025, Eq. 19, that tell strands apart point by point, as means over arc length,
 * so that two polylines along one curve agree however their vertices are spread:
 *     direction (1 - mean of <d, d^>) + vertex mean |x - x^|^2 + length (l - l^)^2
 *         + depth mean of depth in the head^2
 * at equal fractions of arc length; d, x: the strand, d^, x^: its target. Continuous in both. */
#ifndef FIT_STRAND_ERROR_H
#define FIT_STRAND_ERROR_H

#include "model/kernel.h"

struct strand_error_weights { float direction, vertex, length, depth; }; /* 1, 1 / m^2, 1 / m^2, 1 / m^2 */

/* Targets of a block's strands, relative to their roots, metres. */
struct strand_error_target {
    lanes *point;         /* [3m] */
    lanes length;         /* of the polyline */
    lanes *plane;         /* [4 * head_planes_of(m)] normals and offsets (head_planes.h), or NULL: there is no head */
};

/* Fills length. */
void strand_error_measure(uint32_t m, struct strand_error_target *target);

#define STRAND_ERROR_SCRATCH(m) ((size_t)2 * (m))

/* x [3m]; scratch [STRAND_ERROR_SCRATCH(m)]; error: one a lane. The same bits for any variant. */
void strand_error(enum kernel_variant variant, uint32_t m, const lanes *x, const struct strand_error_target *target,
                  const struct strand_error_weights *weights, lanes *scratch, float *error);

#endif
