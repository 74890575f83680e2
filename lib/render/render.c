#include "groom/render.h"

#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "render/scene.h"

#define LIGHT_CELLS 96

static const float brown[3] = {0.20f, 0.105f, 0.05f};

/* Small pictures get more samples: a hair is a smaller part of their pixels. */
static uint32_t samples_for(uint32_t size) { return size <= 640 ? 4 : size <= 1536 ? 3 : 2; }

/* More vertices than this add time, not detail: then every second, third .. strand stands for its
 * neighbours, a little wider. */
static uint32_t stride_for(const struct groom_strands *strands, uint32_t size)
{
    uint32_t most = size <= 1536 ? 4000000 : 12000000;
    return strands->n_vertices / most + 1;
}

static groom_status check(const struct groom_strands *strands, const struct groom_mesh *head,
                          const struct groom_render_options *options, struct groom_diag *diag)
{
    if (options->size < GROOM_RENDER_MIN_SIZE || options->size > GROOM_RENDER_MAX_SIZE)
        return groom_fail(diag, GROOM_EINVAL, "the size is %u; it must be %d..%d pixels", options->size, GROOM_RENDER_MIN_SIZE, GROOM_RENDER_MAX_SIZE);
    if (options->height && (options->height < GROOM_RENDER_MIN_SIZE || options->height > GROOM_RENDER_MAX_SIZE))
        return groom_fail(diag, GROOM_EINVAL, "the height is %u; it must be %d..%d pixels", options->height, GROOM_RENDER_MIN_SIZE, GROOM_RENDER_MAX_SIZE);
    if ((unsigned)options->view >= GROOM_VIEW_COUNT)
        return groom_fail(diag, GROOM_EINVAL, "there is no view %d", (int)options->view);
    if (strands->n_strands == 0 || (options->framed_as && options->framed_as->n_strands == 0))
        return groom_fail(diag, GROOM_EEMPTY, "there is no strand to draw");
    groom_status st = options->camera ? render_camera_check(options->camera, diag) : GROOM_OK;
    return st == GROOM_OK && head ? groom_mesh_validate(head, diag) : st;
}

groom_status groom_render_strands(const struct groom_strands *strands, const struct groom_mesh *head,
                                  const struct groom_render_options *options, uint8_t *rgba,
                                  const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = check(strands, head, options, diag);
    if (st != GROOM_OK)
        return st;
    const float *color = options->color;
    struct render_scene scene = {.strands = strands, .framed = options->framed_as ? options->framed_as : strands, .head = head,
                                 .context = context, .allocator = memory_allocator(context),
                                 .width_px = options->size, .height_px = options->height ? options->height : options->size,
                                 .samples = samples_for(options->size), .stride = stride_for(strands, options->size),
                                 .width = options->width_m};
    memcpy(scene.color, color[0] > 0 || color[1] > 0 || color[2] > 0 ? color : brown, sizeof scene.color);
    if ((st = render_frame(&scene, options, diag)) != GROOM_OK)
        return st;
    struct groom_light_options light = {LIGHT_CELLS, scene.stride, scene.width, {scene.key[0], scene.key[1], scene.key[2]}};
    st = groom_light_create(strands, &light, context, &scene.light, diag);
    if (st == GROOM_OK)
        st = render_shade(&scene, diag);
    if (st == GROOM_OK && progress_cancelled(context))
        st = groom_fail(diag, GROOM_ECANCELLED, "the picture was cancelled");
    if (st == GROOM_OK)
        st = render_raster(&scene, rgba, diag);
    groom_light_destroy(scene.light);
    memory_release(scene.allocator, scene.hair, strands->n_vertices, sizeof *scene.hair);
    memory_release(scene.allocator, scene.skin, head ? head->n_vertices : 0, sizeof *scene.skin);
    return st;
}
