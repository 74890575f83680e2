/* Still pictures of hair, by a rasteriser of our own: what a preview shows without a graphics card.
 *
 * Strands are lines of the width of hair in a depth buffer of 4 to 16 samples a pixel, shaded by
 * Kajiya and Kay (1989) with the second, coloured highlight of Marschner et al. (2003) under a key
 * and a rim light, and darkened by the hair around them; the head is a shaded mesh in the same
 * buffer. Of more than 4 million vertices (12 for sizes above 1536) every second, third .. strand is
 * drawn, a little wider. Memory: 16 bytes a vertex and about 40 MB. */
#ifndef GROOM_RENDER_H
#define GROOM_RENDER_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/io.h"
#include "groom/mesh.h"
#include "groom/strands.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Where the camera stands, in the library's frame: y up, the face towards +z. The front view looks
 * along -z and has the person's left (+x) on the right of the picture; the side view looks from the person's left
 * (+x) along -x and has the face on the left; the back view looks along +z; the top view looks down
 * with the face at the bottom of the picture.
 * X(constant, name) */
#define GROOM_VIEW_LIST(X)                                                                         \
    X(GROOM_VIEW_FRONT, "front")                                                                   \
    X(GROOM_VIEW_SIDE,  "side")                                                                    \
    X(GROOM_VIEW_BACK,  "back")                                                                    \
    X(GROOM_VIEW_TOP,   "top")

typedef enum groom_view {
#define GROOM_VIEW_ENUM(name, slug) name,
    GROOM_VIEW_LIST(GROOM_VIEW_ENUM)
#undef GROOM_VIEW_ENUM
    GROOM_VIEW_COUNT
} groom_view;

const char *groom_view_name(groom_view view);
/* "front" ...; returns GROOM_OK or GROOM_EINVAL with the list of names in diag */
GROOM_MUST_CHECK groom_status groom_view_parse(const char *name, groom_view *view, struct groom_diag *diag);

#define GROOM_RENDER_MIN_SIZE 64
#define GROOM_RENDER_MAX_SIZE 4096

/* A camera of one's own. All zero: the front view. Azimuth and elevation (radians) say where it stands around
 * what it looks at: 0, 0 before the face, azimuth pi/2 at the person's left, elevation pi/2 above. */
struct groom_render_camera {
    int is_placed;       /* it stands at `eye`, whatever azimuth, elevation and distance say */
    double azimuth, elevation;
    double distance;     /* from the target, metres; 0: far enough for all of the hair */
    int has_target;      /* it looks at `target`; else at the middle of the hair */
    double eye[3], target[3];
    double fov_y;        /* radians from the lower to the upper edge; 0: 20 degrees */
    int all_around;      /* so far away that the hair stays in the picture at any azimuth: for a turntable */
    int light_stands;    /* the lights stand as they do for the front view; else they go with the camera */
};

struct groom_render_options {
    groom_view view;
    uint32_t size;      /* the picture is size pixels wide */
    uint32_t height;    /* and so many high; 0: size */
    const struct groom_render_camera *camera; /* in place of the view; borrowed for the call. NULL: the view */
    float width_m;      /* of a hair; 0: 0.08 mm on a full head, wider for fewer strands */
    float color[3];     /* of hair, linear 0..1; {0, 0, 0}: brown */
    /* Other strands whose picture's camera this one is taken with, so that the two can be laid side by side;
     * borrowed for the call. What of the drawn strands is outside of the picture is cut off. NULL: none */
    const struct groom_strands *framed_as;
};

/* Draw strands, on a head if there is one.
 * A view's camera is a long lens (20 degrees) at the height of the hair, framed so that the whole of
 * the hair and the part of the head around it fills the picture with a small margin.
 * strands  at least one; points that are not finite are not drawn
 * head     may be NULL
 * rgba     [height][size][4], the caller's: sRGB, opaque, top row first
 * returns  GROOM_OK, GROOM_EINVAL (size, view, camera), GROOM_EEMPTY (no strand), GROOM_ENOMEM, GROOM_ECANCELLED
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status groom_render_strands(const struct groom_strands *strands,
                                                   const struct groom_mesh *head,
                                                   const struct groom_render_options *options,
                                                   uint8_t *rgba, const struct groom_context *context,
                                                   struct groom_diag *diag);

/* --- light within hair ------------------------------------------------------------- */

/* For those who draw on their own, such as the page: how much light gets to a place through the hair
 * around it. Optical depth through a grid of hair density: to be looked up between cells' middles. */
struct groom_light_options {
    uint32_t cells;  /* along the longest side of the hair's box, 8..256 */
    uint32_t stride; /* every so many-th strand counts; 1: all */
    float width_m;   /* of a hair */
    float key[3];    /* unit vector towards the key light */
};

struct groom_light {
    uint32_t size[3];      /* cells; x runs fastest */
    float origin[3], cell; /* corner of the first; edge length (m) */
    float *key;            /* [cells] optical depth towards the key light: e^-depth of it arrives */
    float *ambient;        /* [cells] how much of the surroundings is seen, 0..1 */
    const struct groom_allocator *allocator;
};

/* strands  borrowed for the call; points that are not finite do not count
 * returns  GROOM_OK, GROOM_EINVAL (options), GROOM_EEMPTY (no finite point), GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status groom_light_create(const struct groom_strands *strands,
                                                 const struct groom_light_options *options,
                                                 const struct groom_context *context, struct groom_light **light,
                                                 struct groom_diag *diag);
void groom_light_destroy(struct groom_light *light); /* takes NULL */
/* At a place: the fraction of the key light and of the surroundings that reach it. */
void groom_light_at(const struct groom_light *light, const float p[3], float *key, float *ambient);

/* Encode a picture as PNG. Nothing in the bytes depends on time or machine.
 * returns  GROOM_OK, GROOM_EINVAL (a side of 0), GROOM_ENOMEM, what the sink answers */
GROOM_MUST_CHECK groom_status groom_png_write(const uint8_t *rgba, uint32_t width, uint32_t height,
                                              struct groom_sink sink, const struct groom_context *context,
                                              struct groom_diag *diag);

/* --- moving pictures ----------------------------------------------------------------- */

/* An animated PNG (APNG, PNG third edition): shown by every browser, and as its first frame by what knows
 * still PNGs alone. Frames are written as they come; memory: one frame. Nothing in the bytes depends on time or
 * machine. The context, the sink and what it writes to stay until the end. */
struct groom_animation;
struct groom_animation_options {
    uint32_t width, height;
    uint32_t n_frames;  /* that will come, 1..65535 */
    uint32_t frame_ms;  /* each is shown so long, 1..65535 */
};
/* returns  GROOM_OK, GROOM_EINVAL (a member out of its range), GROOM_ENOMEM, what the sink answers */
GROOM_MUST_CHECK groom_status groom_animation_create(const struct groom_animation_options *options, struct groom_sink sink,
                                                     const struct groom_context *context, struct groom_animation **animation,
                                                     struct groom_diag *diag);
/* rgba     [height][width][4]; alpha is left out
 * returns  GROOM_OK, GROOM_EINVAL (one frame too many), GROOM_ENOMEM, what the sink answers */
GROOM_MUST_CHECK groom_status groom_animation_add(struct groom_animation *animation, const uint8_t *rgba,
                                                  struct groom_diag *diag);
/* The file's end, once every frame is there. returns  GROOM_OK, GROOM_EINVAL (frames are missing), what the sink answers */
GROOM_MUST_CHECK groom_status groom_animation_finish(struct groom_animation *animation, struct groom_diag *diag);
void groom_animation_destroy(struct groom_animation *animation); /* takes NULL */

#ifdef __cplusplus
}
#endif
#endif
