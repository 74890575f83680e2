/* The supervisor: one thread with N slots that turns queued jobs into attempts.
 *
 * It takes the next job, makes an attempt with a one-time token, launches a worker, and watches for
 * its end. A worker that ends without a result has died: the job is queued again after a back-off and
 * goes on from its last checkpoint, until too many attempts in a row have died without a new one; then
 * it has failed, with its history and the worker's last words (a problem "worker-died" with
 * "attempts":[{"attempt","state","started_at","last_words"},…]). One that has taken more time than it may
 * fails at once ("time-limit", with the same history): another attempt would take as long. A job that is to be cancelled: the worker hears it with its next
 * report, gets SIGTERM after a second and SIGKILL after another.
 *
 * Where the launcher's processes outlive the daemon (a cluster), draining leaves them alone and the next
 * daemon takes them up again by their names; a process that ends says so itself (POST /v1/work/ended).
 *
 * The thread that launches is the one that lives as long as the workers do: local workers are told by
 * the kernel to die with it (PR_SET_PDEATHSIG is per thread). */
#ifndef JOBS_SUPERVISOR_H
#define JOBS_SUPERVISOR_H

#include "server/jobs/jobs.h"
#include "server/launch/launch.h"

struct supervisor;

struct supervisor_options {
    uint32_t n_slots;               /* attempts at a time; 0: 1 */
    uint32_t max_deaths;            /* in a row, before a job has failed; 0: 3 */
    uint32_t backoff_ms;            /* after the first death, doubled with each; 0: 500 */
    uint32_t backoff_max_ms;        /* 0: 60 000 */
    uint32_t cancel_grace_ms;       /* until SIGTERM, and again until SIGKILL; 0: 1000 */
    struct launcher *launcher;      /* borrowed */
    const char *const *worker_argv; /* NULL-terminated: {"…/groom-worker", "attempt", NULL}; borrowed */
    const char *const *worker_env;  /* more of its environment, NULL-terminated "NAME=value"; NULL: none */
    const char *work_url;           /* "http://127.0.0.1:PORT"; borrowed */
    const char *log_folder;         /* stderr of attempts: <log_folder>/<job>.<attempt>.log; is made */
    struct launch_limits limits;    /* of each attempt */
    uint32_t wall_s;                /* by the clock, of each attempt of this machine; 0: no limit */
    struct launch_size size;        /* of each attempt; what is 0 there is estimated from its job */
};

/* End what a former daemon left running (its jobs go on from their checkpoints), or take it up where the
 * launcher outlives the daemon; then start the thread.
 * options are copied; what they point to must outlive the supervisor. */
GROOM_MUST_CHECK groom_status supervisor_start(struct jobs *jobs, const struct supervisor_options *options,
                                               struct supervisor **supervisor, struct groom_diag *diag);
/* Launch nothing more, SIGTERM the workers, SIGKILL after grace_ms; their jobs are queued again, which
 * does not count as a death. Blocks until all are gone. Takes NULL; may be called twice. */
void supervisor_drain(struct supervisor *supervisor, uint32_t grace_ms);
/* Drains where that has not been done. Takes NULL. */
void supervisor_destroy(struct supervisor *supervisor);

struct supervisor_counts {
    uint32_t n_slots, n_running;
    uint64_t n_launched, n_died; /* since the start of the daemon */
};
void supervisor_count(struct supervisor *supervisor, struct supervisor_counts *counts);

#endif
