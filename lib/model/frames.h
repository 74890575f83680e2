/* The frames that operators take from an operator guide: the curl's normal and binormal at every
 * vertex, the bend's two axes at the root (Chang et al. 2025, Appendix A). They depend on the guides
 * alone, so they are worked out once a guide, in double precision, and shared by its strands.
 * Both lean on the axes, which are those of space, or the groom's own: guides are then seen along these, and the frames are
 * turned back.
 *
 * Where a guide has no direction (vertices in one place), its direction is taken as the axis y with no
 * derivative. The curl's frame is singular for guides along +-z, as published: within 1e-4 of them the
 * normal is the axis x. */
#ifndef MODEL_FRAMES_H
#define MODEL_FRAMES_H

#include <stdint.h>

/* guide    [m][3]
 * axes     [3] unit vectors, or NULL: those of space
 * frame    [m][FRAME_WIDTH] (model/kernel.h) */
void frames_curl(const float (*guide)[3], uint32_t m, const float (*axes)[3], float *frame);
/* Add to d_guide [m][3] what comes through the frame. */
void frames_curl_backward(const float (*guide)[3], uint32_t m, const float (*axes)[3], const float *d_frame, float (*d_guide)[3]);

/* axis     [AXIS_WIDTH] (model/kernel.h) */
void frames_bend(const float (*guide)[3], const float (*axes)[3], float *axis);
void frames_bend_backward(const float (*guide)[3], const float (*axes)[3], const float *d_axis, float (*d_guide)[3]);

#endif
