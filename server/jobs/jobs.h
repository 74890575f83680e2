/* The queue as the HTTP side sees it: submit, look, cancel, watch.
 *
 * State lives in the store; this adds the one function that moves a job (move.h), wakers for those
 * who wait, and the nudge to the supervisor. See store.h for the states.
 *
 * threads   any. Nothing here waits for a worker; writes wait for the disk. */
#ifndef JOBS_JOBS_H
#define JOBS_JOBS_H

#include "server/blobs/blobs.h"
#include "server/store/store.h"

struct cJSON;
struct jobs;

/* Both borrowed and must outlive it. */
GROOM_MUST_CHECK groom_status jobs_create(struct store *store, struct blobs *blobs, struct jobs **jobs,
                                          struct groom_diag *diag);
void jobs_destroy(struct jobs *jobs); /* takes NULL; no watch may be left */
/* Workers see the folder of blobs at this path and may read there what they would else be sent.
 * Before the supervisor starts. */
void jobs_share_blobs(struct jobs *jobs, const char *folder);

/* What the HTTP side has checked and filled in. */
struct jobs_request {
    const char *kind;            /* "fit" */
    const char *inputs;          /* JSON object of ids: {"strands":"str_…","head":"head_…"} */
    const char *options;         /* JSON object, complete */
    int32_t priority;
    const struct store_webhook_new *webhook; /* who is told of its end, or NULL */
    const char *project, *owner;  /* NULL: the default; see store.h */
    uint32_t max_queued, max_queued_of_owner; /* 0: no limit */
};

/* Queue a job.
 * job      as it is now; the caller's, store_job_finish
 * returns  GROOM_ELIMIT (a queue is full), GROOM_ECONFLICT (another request with the same
 *          Idempotency-Key came first) */
GROOM_MUST_CHECK groom_status jobs_submit(struct jobs *jobs, const struct jobs_request *request,
                                          struct store_job *job, struct groom_diag *diag);
/* Who is told of every job's end besides; the texts are borrowed and outlive the jobs. Before any is submitted. */
void jobs_set_webhook(struct jobs *jobs, const struct store_webhook_new *webhook);
/* returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status jobs_get(struct jobs *jobs, const char *id, struct store_job *job,
                                       struct groom_diag *diag);
GROOM_MUST_CHECK groom_status jobs_list(struct jobs *jobs, const char *project,
                                        const enum store_job_state *state, struct store_page page, struct store_job_list *list,
                                        struct groom_diag *diag);
/* A queued job is cancelled when this returns; a running one once its worker has stopped (within
 * about 2 s: watch it); a job in an end state stays what it is.
 * job      as it is now. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status jobs_cancel(struct jobs *jobs, const char *id, struct store_job *job,
                                          struct groom_diag *diag);
GROOM_MUST_CHECK groom_status jobs_events_since(struct jobs *jobs, const char *id, int64_t after, uint32_t limit,
                                                struct store_event_list *list, struct groom_diag *diag);

/* Remove the blobs that no row refers to; a running daemon may call it any time. */
GROOM_MUST_CHECK groom_status jobs_collect_blobs(struct jobs *jobs, uint64_t *n_removed, struct groom_diag *diag);

/* Is "job_….2" an attempt of a job of ours that no longer runs? user: the struct jobs. */
bool jobs_attempt_is_stale(void *user, const char *name);

/* --- waiting without blocking ------------------------------------------------------------ */

/* Called after every change of the job that leaves an event (state, stage, progress, loss). From any
 * thread, with no lock of the store held; it must be short (resume a connection) and must not call
 * jobs_* or work_*. Register first, then read the job, then suspend: no change is missed. */
typedef void (*jobs_waker)(void *user);
struct jobs_watch;

GROOM_MUST_CHECK groom_status jobs_watch(struct jobs *jobs, const char *id, jobs_waker waker, void *user,
                                         struct jobs_watch **watch);
/* When this returns the waker is not running and never will again. Takes NULL. */
void jobs_unwatch(struct jobs *jobs, struct jobs_watch *watch);
/* How long stages take, and how many are watching, for /metrics. */
struct stage_clock *jobs_stage_clock(struct jobs *jobs);
size_t jobs_watching(struct jobs *jobs);
/* Wake everybody: for the daemon's end, so that suspended connections can be closed. */
void jobs_wake_all(struct jobs *jobs);

/* --- as JSON (job_json.c) ------------------------------------------------------------------- */

/* The job as the contract names it; the caller's, cJSON_Delete. NULL: out of memory. */
struct cJSON *jobs_json(const struct store_job *job);
/* {"<stage>":[{"iteration","name","value"},…],…} of GET /v1/jobs/{id}/losses; malloc'ed text. */
GROOM_MUST_CHECK groom_status jobs_losses_json(struct jobs *jobs, const char *id, char **text,
                                               struct groom_diag *diag);

#endif
