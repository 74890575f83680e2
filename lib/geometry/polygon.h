/* Cutting a polygon into triangles. */
#ifndef GEOMETRY_POLYGON_H
#define GEOMETRY_POLYGON_H

#include <stddef.h>
#include <stdint.h>

/* Scratch for polygons of up to `capacity` corners: the caller's arrays. */
struct polygon_scratch {
    double (*flat)[2];  /* corners in the polygon's plane */
    uint32_t *next, *previous;
    size_t capacity;
    uint64_t effort;    /* corner tests left before concave polygons are fanned, so that a hostile file ends */
};

/* Triangles of the polygon with these corners, as indices 0..n-1 into them: out[n - 2][3].
 * Convex ones are fanned (quads cut along the shorter sound diagonal), concave ones lose their ears
 * one by one (Meisters 1975) in the plane of Newell's normal; any input gives n - 2 triangles, some
 * perhaps of no area.
 * n is at least 3 and at most the scratch's capacity */
void polygon_triangulate(const float (*points)[3], const uint32_t *corners, uint32_t n,
                         struct polygon_scratch *scratch, uint32_t (*out)[3]);

#endif
