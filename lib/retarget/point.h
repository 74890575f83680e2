/* Points as vectors of four floats of which three count, for kernels. */
#ifndef RETARGET_POINT_H
#define RETARGET_POINT_H

#include "model/quad.h"

LANES_INLINE quad point_load(const float p[3]) { return (quad){p[0], p[1], p[2], 0}; }

LANES_INLINE void point_store(float p[3], quad q)
{
    p[0] = q[0];
    p[1] = q[1];
    p[2] = q[2];
}

LANES_INLINE float point_dot(quad a, quad b)
{
    quad product = a * b;
    return product[0] + product[1] + product[2];
}

#endif
