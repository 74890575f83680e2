/* Pictures of a groom. The daemon evaluates; `groom-worker render` draws, since the head is an
 * uploaded file and parsed nowhere else. */
#include <stdio.h>
#include <unistd.h>

#include "server/grooms/tool.h"

static void add_camera(struct tool_arguments *arguments, const struct groom_render_camera *camera)
{
    tool_add(arguments, "--azimuth", "%.17g", camera->azimuth);
    tool_add(arguments, "--elevation", "%.17g", camera->elevation);
    tool_add(arguments, "--distance", "%.17g", camera->distance);
    tool_add(arguments, "--fov", "%.17g", camera->fov_y);
    tool_add(arguments, "--light", "%s", camera->light_stands ? "front" : "camera");
    if (camera->is_placed)
        tool_add(arguments, "--eye", "%.17g,%.17g,%.17g", camera->eye[0], camera->eye[1], camera->eye[2]);
    if (camera->has_target)
        tool_add(arguments, "--target", "%.17g,%.17g,%.17g", camera->target[0], camera->target[1], camera->target[2]);
}

static void add_turntable(struct tool_arguments *arguments, const struct grooms_turntable *turntable)
{
    tool_add(arguments, "--frames", "%u", turntable->n_frames);
    tool_add(arguments, "--frame-ms", "%u", turntable->frame_ms);
    if (turntable->one_frame)
        tool_add(arguments, "--frame", "%u", turntable->frame);
}

groom_status grooms_preview(struct grooms *grooms, const char *groom_id, uint32_t revision, const struct grooms_shot *shot,
                            const struct grooms_turntable *turntable, char **png, size_t *n_bytes, struct groom_diag *diag)
{
    struct tool_arguments arguments;
    struct model *model = NULL;
    int strands_fd = -1;
    groom_status status = models_acquire(grooms, groom_id, revision, &model, diag);
    if (status != GROOM_OK)
        return status;
    tool_arguments_init(&arguments, grooms, "render");
    tool_add(&arguments, "--size", "%u", shot->width);
    tool_add(&arguments, "--height", "%u", shot->height);
    if (shot->camera)
        add_camera(&arguments, shot->camera);
    else
        tool_add(&arguments, "--view", "%s", groom_view_name(shot->view));
    if (turntable)
        add_turntable(&arguments, turntable);
    tool_add_head(&arguments, grooms, model->groom_id, model->head);
    status = tool_strands_file(grooms, groom_id, model->revision, false, &strands_fd, diag);
    models_release(grooms, model);
    if (status != GROOM_OK)
        return status;
    status = tool_output(&arguments, strands_fd, "the picture could not be drawn", png, n_bytes, diag);
    close(strands_fd);
    return status;
}
