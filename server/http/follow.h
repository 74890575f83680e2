/* Answers that come later: a request that waits for a job's end, and a stream of its events. Neither
 * holds a thread: a follower is called in the fast lane whenever its job has changed, its time has
 * come, or the server closes. */
#ifndef HTTP_FOLLOW_H
#define HTTP_FOLLOW_H

#include <stdbool.h>
#include <stdint.h>

#include "server/jobs/jobs.h"

struct followers;
struct follower;
struct lane;

/* Both borrowed. NULL: out of memory. */
struct followers *followers_create(struct jobs *jobs, struct lane *lane);
void followers_destroy(struct followers *followers); /* takes NULL; none may be left */
void followers_tick(struct followers *followers);    /* call those whose time has come */
void followers_wake(struct followers *followers);    /* call all of them */
int64_t follow_now_ms(void);                         /* monotonic */

/* act      runs in the lane, never twice at a time and never after follower_end
 * release  runs once, when nothing can call any more; may be NULL; not where this fails
 * The first call of act comes by itself, and may end the follower before this returns: *follower is
 * then for those alone who know that their act does not. */
GROOM_MUST_CHECK groom_status follower_create(struct followers *followers, const char *job_id,
                                              void (*act)(struct follower *follower, void *user),
                                              void (*release)(void *user), void *user,
                                              struct follower **follower);
void follower_poke(struct follower *follower);
/* From act: call again at this time, whatever happens. */
void follower_due(struct follower *follower, int64_t due_ms);
/* The owner lets go; may be called from act. */
void follower_end(struct follower *follower);

#endif
