/* Pictures of a groom. The daemon evaluates; `groom-worker render` draws, since the head is an
 * uploaded file and parsed nowhere else. */
#include <stdio.h>
#include <unistd.h>

#include "server/grooms/tool.h"

groom_status grooms_preview(struct grooms *grooms, const char *groom_id, uint32_t revision, groom_view view,
                            uint32_t size, char **png, size_t *n_bytes, struct groom_diag *diag)
{
    struct tool_arguments arguments;
    struct model *model = NULL;
    int strands_fd = -1;
    groom_status status = models_acquire(grooms, groom_id, revision, &model, diag);
    if (status != GROOM_OK)
        return status;
    tool_arguments_init(&arguments, grooms, "render");
    tool_add(&arguments, "--view", "%s", groom_view_name(view));
    tool_add(&arguments, "--size", "%u", size);
    tool_add_head(&arguments, grooms, model->groom_id, model->head);
    status = tool_strands_file(grooms, groom_id, model->revision, false, &strands_fd, diag);
    models_release(grooms, model);
    if (status != GROOM_OK)
        return status;
    status = tool_output(&arguments, strands_fd, "the picture could not be drawn", png, n_bytes, diag);
    close(strands_fd);
    return status;
}
