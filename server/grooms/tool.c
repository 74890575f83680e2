#include "server/grooms/tool.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "proto/json_text.h"
#include "proto/problem.h"
#include "server/launch/child.h"

#define WALL_MS 180000
#define MAX_OUTPUT ((size_t)128 << 20)
#define MEMORY ((uint64_t)8 << 30)

/* --- command lines -------------------------------------------------------------------------- */

void tool_arguments_init(struct tool_arguments *arguments, const struct grooms *grooms, const char *command)
{
    memset(arguments, 0, sizeof *arguments);
    arguments->argv[0] = grooms->options.worker_path;
    arguments->argv[1] = command;
    arguments->n = 2;
}

void tool_add(struct tool_arguments *arguments, const char *name, const char *format, ...)
{
    char *text = arguments->text + arguments->n_text;
    size_t room = sizeof arguments->text - arguments->n_text;
    va_list values;
    va_start(values, format);
    int n = vsnprintf(text, room, format, values);
    va_end(values);
    if (n < 0 || (size_t)n >= room || arguments->n + 3 > sizeof arguments->argv / sizeof arguments->argv[0])
        return;
    arguments->argv[arguments->n++] = name;
    arguments->argv[arguments->n++] = text;
    arguments->n_text += (size_t)n + 1;
}

void tool_add_head(struct tool_arguments *arguments, struct grooms *grooms, const char *of_id, const char *head_id)
{
    char path[4096], project[STORE_PROJECT_SIZE];
    struct store_asset head = {0};
    struct store *store = grooms->options.store;
    if (!*head_id || store_project_of(store, of_id, project, NULL) != GROOM_OK ||
        store_asset_get(store, project, STORE_HEAD, head_id, &head, NULL) != GROOM_OK)
        return;
    if (blobs_path(grooms->options.blobs, head.sha256, path, sizeof path) == GROOM_OK) {
        tool_add(arguments, "--head", "%s", path);
        tool_add(arguments, "--head-unit", "%.17g", head.unit_m);
        tool_add(arguments, "--head-up", "%c", head.up);
    }
    store_asset_finish(&head);
}

/* --- files ------------------------------------------------------------------------------------ */

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

groom_status tool_strands_file(struct grooms *grooms, const char *groom_id, uint32_t revision, bool drawn, int *out,
                               struct groom_diag *diag)
{
    struct grooms_export what = {.revision = revision, .write = {.format = GROOM_FORMAT_HAIR}, .drawn = drawn};
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

/* --- running ------------------------------------------------------------------------------------ */

/* A problem of the worker's as a status and its words. */
static groom_status read_problem(const struct child_result *result, struct groom_diag *diag)
{
    struct problem problem;
    cJSON *json = result->n_output ? json_text_parse(result->output, result->n_output, NULL) : NULL;
    bool found = json && problem_from_json(json, &problem);
    cJSON_Delete(json);
    for (int s = 0; found && s <= (int)GROOM_EINTERNAL; s++)
        if (!strcmp(groom_status_name((groom_status)s), problem.name))
            return problem.pointer[0] ? groom_fail_field(diag, (groom_status)s, problem.pointer, "%s", problem.detail)
                                      : groom_fail(diag, (groom_status)s, "%s", problem.detail);
    return GROOM_OK;
}

groom_status tool_output(const struct tool_arguments *arguments, int stdin_fd, const char *complaint, char **output,
                         size_t *n_output, struct groom_diag *diag)
{
    struct child_result result = {0};
    struct child_spec spec = {.argv = arguments->argv,
                              .stdin_fd = stdin_fd,
                              .stdout_fd = -1,
                              .max_output = MAX_OUTPUT,
                              .limits = {.memory_bytes = MEMORY, .file_bytes = LAUNCH_NO_FILES},
                              .wall_ms = WALL_MS};
    groom_status status = child_run(&spec, &result, diag);
    if (status != GROOM_OK)
        return status;
    if (result.exit_status == 0 && result.n_output > 0) {
        *output = result.output;
        *n_output = result.n_output;
        result.output = NULL;
    } else if (result.exit_status != 1 || (status = read_problem(&result, diag)) == GROOM_OK) {
        status = groom_fail(diag, GROOM_EINTERNAL, "%s%s: %.300s", complaint, result.timed_out ? " in time" : "",
                            result.words);
    }
    child_result_finish(&result);
    return status;
}
