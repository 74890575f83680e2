#include "server/http/tool.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "proto/json_text.h"
#include "server/http/server.h"
#include "server/launch/child.h"
#include "server/log.h"

#define MAX_ARGUMENTS 24
#define MAX_PROBLEM   65536

/* --- groom-worker ------------------------------------------------------------------------ */

/* The problem that it printed: in memory, or at the beginning of the file that was its output. */
static bool read_problem(const struct child_result *result, int stdout_fd, struct problem *problem)
{
    char *text = result->output;
    size_t n = result->n_output;
    char *own = NULL;
    if (stdout_fd >= 0 && (own = malloc(MAX_PROBLEM))) {
        ssize_t got = pread(stdout_fd, own, MAX_PROBLEM, 0);
        text = own;
        n = got > 0 ? (size_t)got : 0;
    }
    cJSON *json = text && n ? json_text_parse(text, n, NULL) : NULL;
    bool found = json && problem_from_json(json, problem);
    cJSON_Delete(json);
    free(own);
    return found;
}

static void respond_child_failure(struct request *request, const struct child_result *result, int stdout_fd)
{
    struct problem problem;
    char words[CHILD_WORDS_SIZE * 2], members[CHILD_WORDS_SIZE * 2 + 200];
    if (result->timed_out) {
        problem_set(&problem, 422, "too-slow", "reading it takes too long",
                    "it was given up after %llu s (--parse-time)",
                    (unsigned long long)request->service->config->parse_time_s);
    } else if (result->exit_status != 1 || !read_problem(result, stdout_fd, &problem)) {
        snprintf(members, sizeof members,
                 "\"request\":\"%s\",\"exit_status\":%d,\"signal\":%d,\"words\":\"%s\"", request->id,
                 result->exit_status, result->signal, log_escape(result->words, words, sizeof words));
        log_members(CONFIG_LOG_ERROR, "groom-worker did not do its work", members);
        problem_set(&problem, 500, "internal", "a part of the service failed in a way it should not",
                    "groom-worker ended with %s %d", result->signal ? "signal" : "exit status",
                    result->signal ? result->signal : result->exit_status);
    }
    respond_problem(request, &problem);
}

bool tool_run(struct request *request, const char *const *arguments, int stdin_fd, int stdout_fd,
              char **output, size_t *n_output)
{
    const struct config *config = request->service->config;
    const char *argv[MAX_ARGUMENTS] = {request->service->worker_path};
    struct child_result result = {0};
    struct groom_diag diag = {0};
    for (size_t n = 1; *arguments && n + 1 < MAX_ARGUMENTS; n++)
        argv[n] = *arguments++;
    struct child_spec spec = {
        .argv = argv,
        .stdin_fd = stdin_fd,
        .stdout_fd = stdout_fd,
        .wall_ms = (uint32_t)config->parse_time_s * 1000,
        .limits = {.memory_bytes = config->parse_memory,
                   .file_bytes = stdout_fd < 0 ? LAUNCH_NO_FILES : config->max_upload * 16}};
    if (stdin_fd >= 0 && lseek(stdin_fd, 0, SEEK_SET) < 0) {
        respond_failure(request, GROOM_EIO, NULL);
        return false;
    }
    groom_status status = child_run(&spec, &result, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return false;
    }
    bool done = result.exit_status == 0 && !result.timed_out;
    if (!done)
        respond_child_failure(request, &result, stdout_fd);
    if (done && output) {
        *output = result.output;
        *n_output = result.n_output;
        result.output = NULL;
    }
    child_result_finish(&result);
    return done;
}

/* --- files --------------------------------------------------------------------------------- */

int tool_temporary(struct request *request)
{
    int fd = open(request->service->temporary_folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd < 0) {
        struct groom_diag diag = {0};
        groom_status status = groom_fail(&diag, errno == ENOSPC ? GROOM_ENOSPC : GROOM_EIO,
                                         "no temporary file: %s", strerror(errno));
        respond_failure(request, status, &diag);
    }
    return fd;
}

static groom_status write_all(int fd, const char *bytes, size_t n)
{
    while (n) {
        ssize_t written = write(fd, bytes, n);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return errno == ENOSPC ? GROOM_ENOSPC : GROOM_EIO;
        bytes += written;
        n -= (size_t)written;
    }
    return GROOM_OK;
}

groom_status tool_flush(struct tool_sink *sink)
{
    size_t n = sink->n;
    sink->n = 0;
    return write_all(sink->fd, sink->buffer, n);
}

static groom_status sink_write(void *user, const void *bytes, size_t n)
{
    struct tool_sink *sink = user;
    sink->n_written += n;
    if (sink->n + n > sizeof sink->buffer) {
        groom_status status = tool_flush(sink);
        if (status != GROOM_OK)
            return status;
        if (n >= sizeof sink->buffer)
            return write_all(sink->fd, bytes, n);
    }
    memcpy(sink->buffer + sink->n, bytes, n);
    sink->n += n;
    return GROOM_OK;
}

struct groom_sink tool_sink(struct tool_sink *sink, int fd)
{
    sink->fd = fd;
    sink->n = 0;
    sink->n_written = 0;
    return (struct groom_sink){sink_write, sink};
}

/* --- the query ------------------------------------------------------------------------------- */

bool tool_query_format(struct request *request, bool writing, groom_format *format)
{
    struct groom_diag diag = {0};
    const char *text = request_query(request, "format");
    if (!text || (!writing && !strcmp(text, "auto")))
        return true;
    if (groom_format_parse(text, format, &diag) != GROOM_OK)
        respond_bad_query(request, "format", "%s", diag.detail);
    else if (!(writing ? groom_format_writable(*format) : groom_format_readable(*format)))
        respond_bad_query(request, "format", "%s can be %s, not %s", groom_format_name(*format),
                          writing ? "read" : "written", writing ? "written" : "read");
    else
        return true;
    return false;
}

bool tool_query_frame(struct request *request, struct groom_frame *frame)
{
    struct groom_diag diag = {0};
    const char *unit = request_query(request, "unit"), *up = request_query(request, "up");
    if (unit && groom_unit_parse(unit, &frame->unit_m, &diag) != GROOM_OK) {
        respond_bad_query(request, "unit", "%s", diag.detail);
        return false;
    }
    if (up && groom_up_parse(up, &frame->up, &diag) != GROOM_OK) {
        respond_bad_query(request, "up", "%s", diag.detail);
        return false;
    }
    return true;
}

void tool_respond_file(struct request *request, groom_format format, const char *name, const char *etag,
                       int fd, uint64_t n_bytes)
{
    respond_file(request, groom_format_media_type(format), fd, n_bytes);
    respond_header(request, "Content-Disposition", "attachment; filename=\"%s.%s\"", name,
                   groom_format_extension(format));
    respond_etag(request, "%s", etag);
}
