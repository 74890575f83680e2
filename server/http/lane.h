/* Threads that may block, and the queue in front of them. The HTTP threads only move bytes; all else
 * runs in a lane: `fast` answers from the database, `slow` parses, converts, exports and draws, so
 * that a status is never behind an export.
 *
 * threads   any */
#ifndef HTTP_LANE_H
#define HTTP_LANE_H

#include <stdbool.h>
#include <stddef.h>

#include "groom/status.h"

/* Embedded in what is to be done; may be submitted again once `run` has begun. */
struct task {
    void (*run)(struct task *task);
    struct task *next; /* the lane's */
};

struct lane;

/* max_queued: tasks that may wait before lane_submit refuses. */
GROOM_MUST_CHECK groom_status lane_create(size_t n_threads, size_t max_queued, struct lane **lane);
/* Runs what is queued, then joins. Takes NULL. */
void lane_destroy(struct lane *lane);

/* false where max_queued tasks wait already. */
bool lane_submit(struct lane *lane, struct task *task);
/* Never refuses: for what has been taken on and goes on. */
void lane_continue(struct lane *lane, struct task *task);
size_t lane_queued(struct lane *lane);

#endif
