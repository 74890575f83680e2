/* `real` as four doubles, one strand each: GCC's vector extension, so that the kernels read like
 * arithmetic. Included before curvature/vector.h, which then works on lanes.
 *
 * A kernel is a text (x_kernel.h) compiled once per instruction set by a file that sets
 * `#pragma GCC target` first: a wrapper with a target attribute comes too late, the vectors would
 * already have been split. Lanes never mix and nothing is contracted, so a strand's bits depend
 * neither on the instruction set nor on its neighbours. */
#ifndef CURVATURE_LANES_H
#define CURVATURE_LANES_H

#include <math.h>

/* Vectors pass between functions of one file only, by inlining: no ABI to warn about. */
#pragma GCC diagnostic ignored "-Wpsabi"

#define LANES 4

typedef double real __attribute__((vector_size(8 * LANES)));
typedef long long lane_mask __attribute__((vector_size(8 * LANES)));

static inline __attribute__((always_inline, unused)) int lanes_any(lane_mask m)
{
    return (m[0] | m[1] | m[2] | m[3]) != 0;
}

/* a where the mask is set, b elsewhere */
static inline __attribute__((always_inline, unused)) real lanes_select(lane_mask m, real a, real b)
{
    return (real)(((lane_mask)a & m) | ((lane_mask)b & ~m));
}

static inline __attribute__((always_inline, unused)) real lanes_sqrt(real x)
{
    return (real){sqrt(x[0]), sqrt(x[1]), sqrt(x[2]), sqrt(x[3])};
}

static inline __attribute__((always_inline, unused)) real lanes_all(double x) { return (real){x, x, x, x}; }

#endif
