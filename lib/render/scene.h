/* What the steps of drawing a picture hand to each other. */
#ifndef RENDER_SCENE_H
#define RENDER_SCENE_H

#include "groom/camera.h"
#include "groom/render.h"

#define RENDER_PIECE 4096u /* strands or vertices of one piece of a parallel loop */

/* A vertex as the rasteriser sees it: x and y in samples from the upper left corner, depth in metres. */
struct render_vertex {
    float x, y, depth;
    uint32_t color; /* of hair: of the segment that begins here. Packed by color_pack */
};

struct render_scene {
    const struct groom_strands *strands;
    const struct groom_strands *framed; /* those that the camera is placed for: the same, or others */
    const struct groom_mesh *head; /* or NULL */
    const struct groom_context *context;
    const struct groom_allocator *allocator;
    struct groom_camera camera;    /* in samples */
    uint32_t width_px, height_px;  /* of the picture */
    uint32_t samples;              /* a side of a pixel */
    uint32_t stride;               /* every so many-th strand is drawn */
    float width;                   /* of a drawn hair, metres */
    float nearest;                 /* least depth of the hair's box, metres; hair nearer than this is not drawn .. */
    int culls;                     /* .. where some may be: the camera was not placed for these strands */
    float color[3];
    float key[3], rim[3];          /* unit vectors towards the lights */
    float eye[3];                  /* where the camera stands */
    struct groom_light *light;
    struct render_vertex *hair;    /* [strands->n_vertices] */
    struct render_vertex *skin;    /* [head->n_vertices] */
};

struct render_axes {
    double right[3], up[3], back[3]; /* unit vectors of a camera; back: towards it */
};

/* stand.c: which way a camera looks */
void render_axes_of_view(groom_view view, struct render_axes *axes);
void render_axes_of_camera(const struct groom_render_camera *camera, struct render_axes *axes);
GROOM_MUST_CHECK groom_status render_camera_check(const struct groom_render_camera *camera, struct groom_diag *diag);

/* frame.c: the camera, the lights that go with it, the hair's box and width */
GROOM_MUST_CHECK groom_status render_frame(struct render_scene *scene, const struct groom_render_options *options,
                                           struct groom_diag *diag);

/* shade.c: fill scene->hair and scene->skin */
GROOM_MUST_CHECK groom_status render_shade(struct render_scene *scene, struct groom_diag *diag);

/* raster.c: the picture */
GROOM_MUST_CHECK groom_status render_raster(struct render_scene *scene, uint8_t *rgba, struct groom_diag *diag);

/* Linear 0..1 in ten bits of its square root each: finer than an eye tells apart. */
uint32_t color_pack(const float linear[3]);
void color_unpack(uint32_t packed, float linear[3]);

static inline int render_is_finite(const float p[3])
{
    return __builtin_isfinite(p[0]) && __builtin_isfinite(p[1]) && __builtin_isfinite(p[2]);
}

#endif
