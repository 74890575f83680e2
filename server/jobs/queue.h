/* Shared by the files of this room: the queue's own struct, and the one way to move a job. */
#ifndef JOBS_QUEUE_H
#define JOBS_QUEUE_H

#include <pthread.h>

#include "server/jobs/jobs.h"
#include "server/jobs/stage_clock.h"

struct jobs_watch {
    char job_id[STORE_ID_SIZE];
    jobs_waker waker;
    void *user;
    struct jobs_watch *next;
};

struct jobs {
    struct store *store;
    struct blobs *blobs;
    struct stage_clock *clock;
    struct store_webhook_new webhook; /* url NULL: none */
    char shared_blobs[1024];      /* where workers see the folder of blobs; "": they do not */
    pthread_mutex_t lock;         /* of what follows; never held while the store is asked */
    struct jobs_watch *watches;
    void (*nudge)(void *user);    /* the supervisor's: there is something to see to */
    void *nudge_user;
};

/* Move a job in the store, collect the blob that this leaves, wake who watches, nudge the supervisor.
 * Every change of a state but the taking goes through here. returns  what store_job_move returns */
GROOM_MUST_CHECK groom_status jobs_move(struct jobs *jobs, const struct store_job_move *move,
                                        struct groom_diag *diag);
/* Remove a blob where no row refers to it; "" is fine. What fails is left to jobs_collect_blobs. */
void jobs_drop_blob(struct jobs *jobs, const char *sha256);
/* A job has a new event. */
void jobs_notify(struct jobs *jobs, const char *job_id);
/* Tell the supervisor that there is something to see to. */
void jobs_nudge(struct jobs *jobs);
/* NULL takes it away; when this returns, the former is not running. */
void jobs_set_nudge(struct jobs *jobs, void (*nudge)(void *user), void *user);

#endif
