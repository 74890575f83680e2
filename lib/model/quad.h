/* Vectors of four floats, which every processor we build for has, written with the compiler's own
 * vector type; the arithmetic is element by element, so that the bits do not depend on it. */
#ifndef MODEL_QUAD_H
#define MODEL_QUAD_H

#include <string.h>

#include "model/lanes.h"

#define QUAD 4

typedef float quad __attribute__((vector_size(16)));

LANES_INLINE quad quad_load(const float *from)
{
    quad q;
    memcpy(&q, from, sizeof q);
    return q;
}

LANES_INLINE void quad_store(float *to, quad q) { memcpy(to, &q, sizeof q); }

LANES_INLINE quad quad_of(float f) { return (quad){f, f, f, f}; }

LANES_INLINE void quad_transpose(quad r[QUAD])
{
    quad a = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5), b = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7);
    quad c = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5), d = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
    r[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
    r[1] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
    r[2] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
    r[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

#endif
