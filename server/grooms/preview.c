/* Pictures of a groom. The daemon evaluates; `groom-worker render` draws, since the head is an
 * uploaded file and parsed nowhere else. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "server/grooms/room.h"
#include "server/launch/child.h"

#define RENDER_WALL_MS 60000
#define RENDER_MAX_PNG ((size_t)64 << 20)
#define RENDER_MEMORY ((uint64_t)8 << 30)

static groom_status write_to_fd(void *user, const void *bytes, size_t n_bytes)
{
    int fd = *(const int *)user;
    const char *at = bytes;
    while (n_bytes > 0) {
        ssize_t n = write(fd, at, n_bytes);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return errno == ENOSPC ? GROOM_ENOSPC : GROOM_EIO;
        at += n;
        n_bytes -= (size_t)n;
    }
    return GROOM_OK;
}

/* The strands as a HAIR file without a name, read from its start. */
static groom_status write_strands_file(struct grooms *grooms, const char *groom_id, uint32_t revision, int *out,
                                       struct groom_diag *diag)
{
    struct grooms_export what = {.revision = revision, .write = {.format = GROOM_FORMAT_HAIR}};
    int fd = open(grooms->options.temporary_folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd < 0)
        return groom_fail(diag, GROOM_EIO, "no temporary file in %s: %s", grooms->options.temporary_folder,
                          strerror(errno));
    groom_status status =
        grooms_write_strands(grooms, groom_id, &what, (struct groom_sink){write_to_fd, &fd}, diag);
    if (status == GROOM_OK && lseek(fd, 0, SEEK_SET) != 0)
        status = groom_fail(diag, GROOM_EIO, "temporary file: %s", strerror(errno));
    if (status != GROOM_OK) {
        close(fd);
        return status;
    }
    *out = fd;
    return GROOM_OK;
}

/* Arguments that live as long as the call. */
struct render_arguments {
    const char *argv[20];
    size_t n;
    char size[16], head_path[4096], head_unit[32], head_up[2];
};

static void add(struct render_arguments *arguments, const char *name, const char *value)
{
    arguments->argv[arguments->n++] = name;
    if (value)
        arguments->argv[arguments->n++] = value;
}

/* A groom whose head is not here (imported from elsewhere, removed) is drawn without one. */
static void add_head(struct grooms *grooms, const char *head_id, struct render_arguments *arguments)
{
    struct store_asset head = {0};
    if (!*head_id || store_asset_get(grooms->options.store, STORE_HEAD, head_id, &head, NULL) != GROOM_OK)
        return;
    if (blobs_path(grooms->options.blobs, head.sha256, arguments->head_path, sizeof arguments->head_path) ==
        GROOM_OK) {
        snprintf(arguments->head_unit, sizeof arguments->head_unit, "%.17g", head.unit_m);
        arguments->head_up[0] = head.up;
        add(arguments, "--head", arguments->head_path);
        add(arguments, "--head-unit", arguments->head_unit);
        add(arguments, "--head-up", arguments->head_up);
    }
    store_asset_finish(&head);
}

static groom_status run_render(struct grooms *grooms, struct render_arguments *arguments, int strands_fd,
                               char **png, size_t *n_bytes, struct groom_diag *diag)
{
    struct child_result result = {0};
    struct child_spec spec = {.argv = arguments->argv,
                              .stdin_fd = strands_fd,
                              .stdout_fd = -1,
                              .max_output = RENDER_MAX_PNG,
                              .limits = {.memory_bytes = RENDER_MEMORY, .file_bytes = LAUNCH_NO_FILES},
                              .wall_ms = RENDER_WALL_MS};
    groom_status status = child_run(&spec, &result, diag);
    if (status != GROOM_OK)
        return status;
    if (result.exit_status == 0 && result.n_output > 0) {
        *png = result.output;
        *n_bytes = result.n_output;
        result.output = NULL;
    } else {
        status = groom_fail(diag, GROOM_EINTERNAL, "the picture could not be drawn%s: %.300s",
                            result.timed_out ? " in time" : "", result.words);
    }
    child_result_finish(&result);
    return status;
}

groom_status grooms_preview(struct grooms *grooms, const char *groom_id, uint32_t revision, groom_view view,
                            uint32_t size, char **png, size_t *n_bytes, struct groom_diag *diag)
{
    struct render_arguments arguments = {0};
    struct model *model = NULL;
    int strands_fd = -1;
    groom_status status = models_acquire(grooms, groom_id, revision, &model, diag);
    if (status != GROOM_OK)
        return status;
    snprintf(arguments.size, sizeof arguments.size, "%u", size);
    add(&arguments, grooms->options.worker_path, NULL);
    add(&arguments, "render", NULL);
    add(&arguments, "--view", groom_view_name(view));
    add(&arguments, "--size", arguments.size);
    add_head(grooms, model->head, &arguments);
    status = write_strands_file(grooms, groom_id, model->revision, &strands_fd, diag);
    models_release(grooms, model);
    if (status != GROOM_OK)
        return status;
    status = run_render(grooms, &arguments, strands_fd, png, n_bytes, diag);
    close(strands_fd);
    return status;
}
