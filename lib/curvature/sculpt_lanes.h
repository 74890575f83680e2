/* Strands through the vectorised solver: the way in and out for code that works with plain doubles. */
#ifndef CURVATURE_SCULPT_LANES_H
#define CURVATURE_SCULPT_LANES_H

#include <stdint.h>

#include "groom/context.h"

/* A control point on its element. On a junction it belongs to the next one, with s = 0. */
struct located_anchor {
    uint32_t element;
    double s;
    double target[3];
};

/* One strand, relative to its root; borrowed for the call. */
struct lane_input {
    uint32_t n, m;                   /* elements; anchors, rising along the strand */
    const double (*frame)[3];        /* [3] t, u, v */
    const double *length;            /* [n] */
    const double (*q)[3], (*rest)[3];/* [n] */
    const struct located_anchor *anchor; /* [m] */
    double c;                        /* of Eq. 15 */
    double least_energy;             /* as good as 0 */
};

struct lane_output {
    double energy_before, energy;
    uint32_t iterations;
    double miss_max, miss_mean; /* of its anchors */
    int active; /* still going downhill when the steps ran out */
};

struct sculpt_settings {
    uint32_t n_steps;
    double tolerance;     /* stop where the model promises less than this share of the energy */
    double most_turning;  /* radians a step, over the whole strand */
};

struct sculpt_group;

/* For strands of at most so many elements and anchors; NULL where memory is out. */
struct sculpt_group *sculpt_group_create(uint32_t max_elements, uint32_t max_anchors,
                                         const struct groom_allocator *allocator);
void sculpt_group_destroy(struct sculpt_group *group); /* takes NULL */

/* Any number of strands: the lanes take one after the other. q[i] receives strand i's result; it may
 * be the input's q. A strand's result does not depend on its company. */
void sculpt_group_solve(struct sculpt_group *group, const struct lane_input *in, uint32_t n_in,
                        const struct sculpt_settings *settings, double (*const q[])[3], struct lane_output *out);

#endif
