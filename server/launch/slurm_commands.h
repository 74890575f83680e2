/* Slurm's three programs, run one at a time by the launcher's thread. Arguments go to them as they are:
 * no shell reads them, and the batch script is the same for every job. */
#ifndef LAUNCH_SLURM_COMMANDS_H
#define LAUNCH_SLURM_COMMANDS_H

#include <stdatomic.h>
#include <stddef.h>

#include "server/launch/launch.h"

#define SLURM_NAME_SIZE  56
#define SLURM_WORDS_SIZE 320

/* What a launch is made of, owned. */
struct slurm_order {
    char **argv, **env;      /* NULL-terminated */
    char log_path[1024];
    struct launch_limits limits;
    struct launch_size size;
};
/* NULL where memory is out. */
struct slurm_order *slurm_order_copy(const struct launch_spec *spec);
void slurm_order_destroy(struct slurm_order *order); /* takes NULL */

struct slurm_commands {
    char *sbatch, *squeue, *scancel; /* paths */
    char *script;                    /* path of the batch script */
    char *log_folder;                /* as the nodes see it, or "" */
    char **arguments;                /* more of sbatch's, NULL-terminated */
    char **env;                      /* of the programs: PATH, HOME, SLURM_…, NULL-terminated */
    uint32_t wall_ms;
    atomic_bool give_up;             /* the daemon ends: stop the program that runs */
};

/* Find the programs, write the batch script. */
GROOM_MUST_CHECK groom_status slurm_commands_init(const struct launch_slurm_options *options,
                                                  struct slurm_commands *commands, struct groom_diag *diag);
void slurm_commands_finish(struct slurm_commands *commands); /* takes zeroed */

/* returns  GROOM_OK: it is in the queue; GROOM_EIO: it may be, or not (no answer in time);
 *          GROOM_ECANCELLED: it is not, but may be tried again (no controller); GROOM_EINVAL: refused */
GROOM_MUST_CHECK groom_status slurm_submit(struct slurm_commands *commands, const char *name,
                                           const struct slurm_order *order, struct groom_diag *diag);

/* One row of squeue. A job stays listed for some minutes (MinJobAge) after its end. */
struct slurm_row {
    char name[SLURM_NAME_SIZE], state[24], node[64], reason[64], id[24];
    int exit_code;           /* as waitpid has it */
};
struct slurm_rows {
    struct slurm_row *items;
    size_t n;
};
/* names    separated by commas; NULL: all of this user's */
GROOM_MUST_CHECK groom_status slurm_list(struct slurm_commands *commands, const char *names,
                                         struct slurm_rows *rows, struct groom_diag *diag);
/* Waiting to run, running, or somewhere between the two. */
bool slurm_row_lives(const struct slurm_row *row);

/* Out of the queue where it waits; else SIGTERM or SIGKILL to all its processes. One that is not there is
 * fine. */
GROOM_MUST_CHECK groom_status slurm_cancel(struct slurm_commands *commands, const char *name, enum launch_stop how,
                                           struct groom_diag *diag);

#endif
