/* Where attempts run: one interface, so that a cluster fits beside this machine.
 *
 * A launcher starts a process and names it by a text handle, which means the same after a restart of
 * the daemon. It knows nothing of jobs.
 *
 * threads   one: the supervisor's */
#ifndef LAUNCH_LAUNCH_H
#define LAUNCH_LAUNCH_H

#include <stdbool.h>
#include <stdint.h>

#include "groom/diag.h"

#define LAUNCH_HANDLE_SIZE 64

/* 0: no limit. Under a sanitizer the address space is not limited (it reserves terabytes). */
struct launch_limits {
    uint64_t memory_bytes; /* address space */
    uint64_t cpu_s;
    uint64_t file_bytes;   /* the largest file it may write; LAUNCH_NO_FILES: none at all */
};
#define LAUNCH_NO_FILES UINT64_MAX

/* Everything borrowed for the call. */
struct launch_spec {
    const char *const *argv; /* NULL-terminated; argv[0] is the program's path */
    const char *const *env;  /* NULL-terminated "NAME=value"; the whole environment */
    const char *name;        /* for people: "job_….2" */
    const char *log_path;    /* stdout and stderr go there */
    struct launch_limits limits;
};

enum launch_state { LAUNCH_RUNNING, LAUNCH_ENDED };

struct launch_status {
    enum launch_state state;
    char words[64]; /* how it ended, for people: "exit status 1", "signal 9 (Killed)" */
};

enum launch_stop { LAUNCH_TERMINATE, LAUNCH_KILL };

struct launcher;
struct launcher_table {
    const char *name; /* "local" */
    /* Milliseconds between two polls while something runs. */
    uint32_t poll_interval_ms;
    groom_status (*start)(struct launcher *launcher, const struct launch_spec *spec,
                          char handle[LAUNCH_HANDLE_SIZE], struct groom_diag *diag);
    /* Does not block. A handle that is not known (any more) has ended. */
    groom_status (*poll)(struct launcher *launcher, const char *handle, struct launch_status *status,
                         struct groom_diag *diag);
    /* Ask it, or force it, to end. Does not wait; one that has ended is fine. */
    groom_status (*stop)(struct launcher *launcher, const char *handle, enum launch_stop how,
                         struct groom_diag *diag);
    void (*destroy)(struct launcher *launcher);
};

/* What every launcher starts with. */
struct launcher {
    const struct launcher_table *table;
};

/* Supervised child processes of this machine, each in a process group of its own, that die when the
 * thread that started them does. A handle is "local:PID:START:BOOT": with the process's start time and
 * the machine's boot, a reused pid is never taken for it. */
GROOM_MUST_CHECK groom_status launch_local_create(struct launcher **launcher, struct groom_diag *diag);
void launch_destroy(struct launcher *launcher); /* takes NULL */

#endif
