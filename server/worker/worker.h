/* groom-worker: one process for one piece of work, so that whatever goes wrong in it ends it alone.
 *
 *   inspect, convert, check-groom,
 *   render, compare, hairline       parse untrusted bytes for the daemon: standard input to standard
 *                                   output, in a sandbox; exit 0, or 1 with a problem on standard output
 *   attempt                         run one attempt of one job, over HTTP (proto/work.h)
 *
 * Exit status 2 is wrong usage. */
#ifndef WORKER_WORKER_H
#define WORKER_WORKER_H

#include <stddef.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/io.h"

enum { WORKER_OK = 0, WORKER_FAILED = 1, WORKER_USAGE = 2 };

/* The commands: argv[0] is the command's own name. They return the exit status. */
int worker_inspect(int argc, char **argv);
int worker_convert(int argc, char **argv);
int worker_convert_head(int argc, char **argv);
int worker_check_groom(int argc, char **argv);
int worker_render(int argc, char **argv);
int worker_compare(int argc, char **argv);
int worker_hairline(int argc, char **argv);
int worker_attempt(int argc, char **argv);

/* --- what they share ---------------------------------------------------------- */

/* Threads that GROOM_WORK_THREADS asks for; 0 (all processors) where it is not set. */
unsigned worker_threads(void);

/* Give up what parsing does not need: no new privileges, no core file, and by a seccomp filter
 * no network, no other program, no other process's memory. A kernel that has no seccomp is said
 * on standard error and does not stop the work: rlimits of the launcher still hold. */
void worker_enter_sandbox(void);

/* What --format says: NULL where the bytes shall tell ("", "auto"). */
const char *worker_format_name(const char *text);
/* --unit and --up of a command line, either may be NULL. */
GROOM_MUST_CHECK groom_status worker_frame_parse(const char *unit, const char *up, struct groom_frame *frame,
                                                 struct groom_diag *diag);
/* A whole number of a command line; NULL is 0. */
GROOM_MUST_CHECK groom_status worker_count_parse(const char *option, const char *text, unsigned long long maximum,
                                                 unsigned long long *value, struct groom_diag *diag);

/* The failure as a line of JSON (proto/problem.h). malloc'ed; NULL where memory is out. */
char *worker_problem_text(groom_status status, const struct groom_diag *diag);
/* Print it on standard output; returns WORKER_FAILED. */
int worker_print_problem(groom_status status, const struct groom_diag *diag);

/* Standard input: mapped where it is a regular file, a stream otherwise. */
struct worker_input {
    struct groom_source source;
    struct groom_memory_source memory;
    void *map;
    size_t n_map;
};
void worker_input_open(int fd, struct worker_input *input);
void worker_input_close(struct worker_input *input); /* takes zeroed values */

/* A file that a command line names (NULL: nothing is opened), mapped; before the sandbox closes the way.
 * what     "the head", for the complaint: it must be a regular file that is not empty */
GROOM_MUST_CHECK groom_status worker_input_open_path(const char *path, const char *what, struct worker_input *input,
                                                     struct groom_diag *diag);

/* The commands that parse: enter the sandbox, open standard input and a pool of threads, run `body`,
 * print the problem where it fails. Returns the exit status. */
int worker_run_sandboxed(groom_status (*body)(void *request, struct worker_input *input,
                                              const struct groom_context *context, struct groom_diag *diag),
                         void *request);

/* All of an input as text with a zero behind it (malloc'ed), refused above `limit` bytes. */
GROOM_MUST_CHECK groom_status worker_input_text(struct worker_input *input, size_t limit, char **text,
                                                size_t *n_bytes, struct groom_diag *diag);

/* A sink that writes to a file descriptor; a broken pipe is GROOM_ECANCELLED. */
struct groom_sink worker_fd_sink(const int *fd);

/* For launchers that do not see how a process ends: this process forks. The child returns 0 and does
 * the work; the parent passes signals on, keeps the end of what the child says on standard error, and
 * where it dies tells the daemon.
 * returns  1 in the parent once all is over, with the exit status; 0 in the child, or where it cannot fork */
int worker_watch(const char *url, const char *token, int *status);

#endif
