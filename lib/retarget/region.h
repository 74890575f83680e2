/* The inside of struct groom_scalp_region. */
#ifndef RETARGET_REGION_H
#define RETARGET_REGION_H

#include "groom/hairline.h"
#include "groom/spatial.h"
#include "retarget/flat.h"
#include "retarget/surface.h"

/* A stretch of the boundary: vertices one after the other, and a smooth line along them. */
struct stretch {
    uint32_t n;
    uint32_t *vertex;    /* [n] of the scalp */
    struct vec *point;   /* [n] where they are */
    struct vec *smooth;  /* [n] the line beside them, on the surface; the ends are their own */
    struct vec *normal;  /* [n] of the surface there */
    double *arc;         /* [n] 0..1 along the smooth line */
    double length;       /* of it, metres */
    uint32_t capacity;
    const struct groom_allocator *allocator;
};

struct groom_scalp_region {
    const struct groom_mesh *mesh;
    struct surface surface;
    struct groom_bvh *bvh;
    struct sheet scalp;                 /* triangles with roots */
    struct sheet patch;                 /* those and what lies around, which the edit may use */
    struct flat flat;                   /* of the patch */
    uint32_t *patch_vertex;             /* [scalp.n_vertices] the same vertex in the patch */
    uint32_t n_roots;
    struct groom_surface_point *hosts;  /* [n_roots] the nearest point of the surface */
    float *heights;                     /* [n_roots] of roots above it */
    struct vec ears[2];                 /* left, right */
    uint32_t ear_at[2];                 /* places in scalp.loop */
    int forward;                        /* the front runs from the left ear with the loop (1) or against it (-1) */
    struct stretch front;
    const struct groom_allocator *allocator;
};

/* The stretch of the loop from place `from` to place `to`, walking by step (1 or -1).
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status stretch_init(struct stretch *stretch, const struct groom_scalp_region *region, uint32_t from,
                                           uint32_t to, int step, struct groom_diag *diag);
void stretch_finish(struct stretch *stretch); /* takes what is zeroed */

/* The place in the scalp's loop that is nearest to a point, and how far. */
uint32_t region_loop_nearest(const struct groom_scalp_region *region, struct vec point, double *distance);

#endif
