/* How far from a body a point is, and on which side: a grid of distances that spares most closest-point queries,
 * and triangles whose own side is known to tell inside from outside, which spares most winding numbers. */
#ifndef RETARGET_FIELD_H
#define RETARGET_FIELD_H

#include <math.h>

#include "groom/spatial.h"

struct field {
    const struct groom_bvh *bvh; /* borrowed */
    float low[3], high[3];       /* box of the body */
    float origin[3], spacing;    /* of the grid's first node */
    uint32_t size[3];
    float *value;                /* [size[2]][size[1]][size[0]] metres: distance from the surface, negative inside */
    int closed;                  /* no rims: what is far from the surface is on the side of the node beside it */
    uint8_t *side;               /* [triangles of the body] enum field_side; found when first asked for */
    const struct groom_allocator *allocator;
};

/* What the pseudo-normal on a triangle is good for. */
enum field_side {
    FIELD_NOT_LOOKED_AT,
    FIELD_SIDE_TELLS,  /* outside is in front of it, inside behind it */
    FIELD_SIDE_IS_NONE /* at a hole's rim, of an inner shell, doubled: ask the winding number */
};

/* A field over the body where it is within `margin` of the box low..high, of about n_nodes nodes.
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED */
groom_status field_init(struct field *field, const struct groom_bvh *bvh, const float low[3], const float high[3],
                        float margin, uint32_t n_nodes, const struct groom_context *context, struct groom_diag *diag);
void field_finish(struct field *field); /* takes {0} */

/* The nearest point of the surface. returns the distance, negative inside (as groom_bvh_inside says); INFINITY where
 * p is not finite: *near is untouched then. */
double field_signed(const struct field *field, const float p[3], struct groom_surface_point *near);

/* A length that the surface is away from p at least, where p is outside; 0 or less where it may be inside or
 * nothing is known. Distances change no faster than places. */
static inline float field_away(const struct field *field, const float p[3])
{
    float outside = 0, off = 0;
    size_t node = 0;
    for (int c = 2; c >= 0; c--) {
        float past = fmaxf(field->low[c] - p[c], p[c] - field->high[c]);
        outside += past > 0 ? past * past : 0;
        float at = (p[c] - field->origin[c]) / field->spacing;
        if (!(at > -0.5f && at < (float)field->size[c] - 0.5f))
            at = -1;
        float nearest = floorf(at + 0.5f), d = (at - nearest) * field->spacing;
        off = at < -0.5f ? INFINITY : off + d * d;
        node = node * field->size[c] + (nearest > 0 ? (size_t)nearest : 0);
    }
    float by_grid = off < INFINITY ? field->value[node] - sqrtf(off) : 0;
    return fmaxf(by_grid, sqrtf(outside)) * 0.99999f;
}

#endif
