/* Frames: three axes as the rows of a rotation. */
#ifndef FIT_FRAME_H
#define FIT_FRAME_H

#include "geometry/vec.h"

/* x and y, and what is across both: all unit vectors, or nearly. */
void frame_of(struct vec x, struct vec y, double frame[3][3]);

/* out = a b: the axes a, told along the axes b, in space. out is neither. */
void frame_multiply(const double a[3][3], const double b[3][3], double out[3][3]);

/* The rotation about a vector by its length in radians. */
void frame_rotation(const double vector[3], double turn[3][3]);

/* A frame turned by such a vector, told along its own axes; by none it stays, to the bit. out is not the frame. */
void frame_turned(const double frame[3][3], const float vector[3], double out[3][3]);

/* As a groom holds it: {0} where it is that of space. */
void frame_store(const double frame[3][3], float axes[3][3]);

#endif
