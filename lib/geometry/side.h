/* Which side of a surface the points of a polyline are on, one after the other: sides change only where the line
 * crosses the surface, and a ray is a hundred times cheaper than the question inside or outside. */
#ifndef GEOMETRY_SIDE_H
#define GEOMETRY_SIDE_H

#include <string.h>

#include "groom/spatial.h"

struct side_walk {
    const struct groom_bvh *bvh; /* borrowed */
    float at[3];
    int known, inside;
};

static inline struct side_walk side_walk_begin(const struct groom_bvh *bvh) { return (struct side_walk){.bvh = bvh}; }

/* Goes straight on to a point; returns whether it is inside, as groom_bvh_inside says. */
static inline int side_walk(struct side_walk *walk, const float point[3])
{
    float way[3] = {point[0] - walk->at[0], point[1] - walk->at[1], point[2] - walk->at[2]};
    if (!walk->known || groom_bvh_occluded(walk->bvh, walk->at, way, 0, 1))
        walk->inside = groom_bvh_inside(walk->bvh, point);
    memcpy(walk->at, point, sizeof walk->at);
    walk->known = 1;
    return walk->inside;
}

#endif
