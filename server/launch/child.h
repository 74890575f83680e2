/* Run a tool to its end: how untrusted bytes are parsed, outside the daemon.
 *
 * The child gets standard input and output and nothing else: an empty environment (unless one is given),
 * no other descriptor, a process group of its own, resource limits, a wall clock. It dies with the calling
 * thread.
 *
 * threads   any; blocks the caller until the child has ended */
#ifndef LAUNCH_CHILD_H
#define LAUNCH_CHILD_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

#include "server/launch/launch.h"

#define CHILD_WORDS_SIZE 2048

struct child_spec {
    const char *const *argv;      /* NULL-terminated; argv[0] is the program's path */
    const char *const *env;       /* NULL-terminated "NAME=value"; NULL: empty */
    int stdin_fd;                 /* read from; -1: empty */
    int stdout_fd;                /* written to; -1: captured into memory */
    size_t max_output;            /* of captured output; 0: 1 MiB. More of it is GROOM_ETOOBIG */
    struct launch_limits limits;
    uint32_t wall_ms;             /* 0: 60 000 */
    const atomic_bool *give_up;   /* true: stop it now, as if its time were up; NULL: never */
};

struct child_result {
    int exit_status;              /* 0..255; -1: ended by a signal */
    int signal;                   /* 0: none */
    bool timed_out;               /* it was stopped by the wall clock or the CPU limit */
    char *output;                 /* captured, zero-terminated beyond n_output; NULL where not captured */
    size_t n_output;
    char words[CHILD_WORDS_SIZE]; /* the tail of its standard error */
};

/* returns  GROOM_OK where it ran to an end, whatever that was: see the result;
 *          GROOM_EIO (it could not be started), GROOM_ETOOBIG, GROOM_ENOMEM
 * result   the caller's, child_result_finish; set on GROOM_OK only */
GROOM_MUST_CHECK groom_status child_run(const struct child_spec *spec, struct child_result *result,
                                        struct groom_diag *diag);
/* A started child that writes to a pipe which the caller reads: for streamed answers. stdout_fd and
 * max_output are not used; *output_fd is the caller's to close (closing it early ends the child's
 * writing). child_wait must be called once, from any thread; what the spec points to must live until then.
 * The wall clock runs while the caller reads: a reader that is slower than wall_ms ends the child. */
struct child;
GROOM_MUST_CHECK groom_status child_start(const struct child_spec *spec, struct child **child, int *output_fd,
                                          struct groom_diag *diag);
GROOM_MUST_CHECK groom_status child_wait(struct child *child, struct child_result *result,
                                         struct groom_diag *diag);
void child_result_finish(struct child_result *result); /* takes zeroed */

#endif
