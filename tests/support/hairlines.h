/* Hairlines on heads, drawn relative to the one that is there. */
#ifndef SUPPORT_HAIRLINES_H
#define SUPPORT_HAIRLINES_H

#include "groom/hairline.h"

struct groom_mesh;

/* The head of lib/sample, 1.64 m above the ground, and n roots on its scalp; the caller's: groom_mesh_destroy, free(). */
struct groom_mesh *hairlines_sample(uint32_t n, float (**roots)[3]);

typedef enum hairlines_shape {
    HAIRLINES_SAME,     /* today's line, drawn after */
    HAIRLINES_STRAIGHT, /* the height over the forehead evened out */
    HAIRLINES_WIDOW,    /* a peak in the middle, 12 mm down, temples 8 mm up */
    HAIRLINES_ROUND,    /* 15 mm up over the forehead */
    HAIRLINES_RECEDING  /* temples 25 mm up */
} hairlines_shape;

/* A front edit with n points. */
void hairlines_draw(const struct groom_scalp_region *region, hairlines_shape shape, uint32_t n, struct groom_hairline *hairline);

#endif
