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

/* What an attempt is expected to need, for a launcher that has to ask for it. 0: not known. */
struct launch_size {
    uint32_t threads;
    uint64_t memory_bytes;
    uint64_t wall_s;
};

/* Everything borrowed for the call. */
struct launch_spec {
    const char *const *argv; /* NULL-terminated; argv[0] is the program's path */
    const char *const *env;  /* NULL-terminated "NAME=value"; the whole environment */
    const char *name;        /* "job_….2": no two are the same */
    const char *log_path;    /* stdout and stderr go there */
    struct launch_limits limits;
    struct launch_size size;
};

enum launch_state { LAUNCH_RUNNING, LAUNCH_ENDED };

struct launch_status {
    enum launch_state state;
    bool unknown;    /* ended, or never begun: there is no trace of it */
    bool over_time;  /* ended for having used more processor time than its limits allow */
    char words[320]; /* how it ended, for people: "exit status 1", "signal 9 (Killed)" */
};

enum launch_stop { LAUNCH_TERMINATE, LAUNCH_KILL };

struct launcher;
struct launcher_table {
    const char *name; /* "local" */
    /* The handle of what is launched under this name. NULL: known only once it has been started, and it
     * dies with the daemon. Else it lives on without, and the next daemon finds it by its name. */
    void (*handle_of)(const char *name, char handle[LAUNCH_HANDLE_SIZE]);
    /* Milliseconds between two polls while something runs. */
    uint32_t poll_interval_ms;
    groom_status (*start)(struct launcher *launcher, const struct launch_spec *spec,
                          char handle[LAUNCH_HANDLE_SIZE], struct groom_diag *diag);
    /* A launcher that takes its time says GROOM_OK at once, and what went wrong with the next poll.
     * poll and stop do not block. A handle that is not known (any more) has ended. */
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

/* Batch jobs of a Slurm cluster, by its programs sbatch, squeue and scancel: one for an attempt, with its
 * name, which is all that this has to know of it. Slurm starts it again where a node fails (the worker
 * then is the next run of the same attempt); everything else that ends it ends the attempt.
 *
 * A thread of its own runs the programs, so that a controller that does not answer holds up nobody: what
 * could not be submitted or stopped for that reason is tried again until it can be. */
struct launch_slurm_options {
    const char *folder;     /* for the batch script; it is there */
    const char *log_folder; /* the folder of log_path as the nodes see it; NULL or "": they do not */
    const char *arguments;  /* more of sbatch's, blanks between: "--partition=hair --qos=low"; NULL: none */
    const char *path;       /* where the programs are, as in $PATH; NULL: $PATH */
    uint32_t interval_ms;   /* between two squeue; 0: 2000 */
    uint32_t wall_ms;       /* for each program; 0: 15 000 */
    /* Is what runs under this name of a job of ours that does not want it any more? Asked once, at the
     * first squeue, from the launcher's thread; those are cancelled. NULL: nobody is asked. */
    bool (*stale)(void *user, const char *name);
    void *user;
};

/* returns  GROOM_EINVAL where a program is missing (the detail names it), GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status launch_slurm_create(const struct launch_slurm_options *options,
                                                  struct launcher **launcher, struct groom_diag *diag);

void launch_destroy(struct launcher *launcher); /* takes NULL */

#endif
