/* Start a process that has nothing of the daemon but what it is given: three descriptors, an
 * environment, limits, a process group of its own. It is killed when the calling thread ends. */
#ifndef LAUNCH_SPAWN_H
#define LAUNCH_SPAWN_H

#include <sys/types.h>

#include "server/launch/launch.h"

struct spawn_spec {
    const char *const *argv;
    const char *const *env;  /* NULL: empty */
    int fd[3];               /* standard input, output, error; borrowed */
    struct launch_limits limits;
    int nice;                /* added to ours: it gives way to the daemon */
};

/* Returns once the program has been executed. The caller waits for `*pid`.
 * returns  GROOM_EIO with what failed (no such program, a limit that may not be set) */
GROOM_MUST_CHECK groom_status spawn_process(const struct spawn_spec *spec, pid_t *pid, struct groom_diag *diag);
/* "exit status 1", "signal 9 (Killed)" of a status of waitpid. */
void spawn_words(int wait_status, char *words, size_t size);

#endif
