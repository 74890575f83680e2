/* Untrusted bytes go through groom-worker, a process of their own; and the small things that handlers
 * of files share. */
#ifndef HTTP_TOOL_H
#define HTTP_TOOL_H

#include "groom/format.h"
#include "server/http/request.h"

/* Run `groom-worker arguments...` (NULL-terminated, at most 14).
 * stdin_fd   read from its beginning
 * stdout_fd  takes its output; -1: *output, malloc'ed and zero-terminated
 * returns    false where it failed: the problem that it printed, or that it was stopped, is answered */
bool tool_run(struct request *request, const char *const *arguments, int stdin_fd, int stdout_fd,
              char **output, size_t *n_output);

/* A file without a name on the disk of the data; -1 where it was refused (and answered). */
int tool_temporary(struct request *request);

/* A sink into a file descriptor, buffered; flush before use. */
struct tool_sink {
    int fd;
    size_t n;
    uint64_t n_written;
    char buffer[1 << 16];
};
struct groom_sink tool_sink(struct tool_sink *sink, int fd);
GROOM_MUST_CHECK groom_status tool_flush(struct tool_sink *sink);

/* format=, unit= and up= of the query. `format` and `frame` keep what they hold where absent.
 * returns  false where one was refused (and answered) */
bool tool_query_format(struct request *request, bool writing, groom_format *format);
bool tool_query_frame(struct request *request, struct groom_frame *frame);

/* Answer with a file to be kept: Content-Type, Content-Disposition "<name>.<extension>", ETag. */
void tool_respond_file(struct request *request, groom_format format, const char *name, const char *etag,
                       int fd, uint64_t n_bytes);

#endif
