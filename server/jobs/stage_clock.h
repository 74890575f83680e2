/* How long the stages of jobs take, for /metrics: counted from an attempt's first report of a stage to its first
 * report of the next, or to the job's success. What a worker that died had begun is not counted.
 *
 * threads   any */
#ifndef JOBS_STAGE_CLOCK_H
#define JOBS_STAGE_CLOCK_H

#include "server/histogram.h"
#include "server/store/store.h"

#define STAGE_NAME_SIZE 40

struct stage_clock;

struct stage_clock *stage_clock_create(void); /* NULL: out of memory */
void stage_clock_destroy(struct stage_clock *clock); /* takes NULL */

/* The attempt says that it is in this stage. */
void stage_clock_enter(struct stage_clock *clock, const struct store_attempt_ref *ref, const char *kind, const char *stage);
/* The job's attempt has ended; done: its last stage with it. */
void stage_clock_leave(struct stage_clock *clock, const char *job_id, bool done);

extern const struct histogram_bounds stage_clock_bounds;
struct stage_times {
    char kind[STAGE_NAME_SIZE], stage[STAGE_NAME_SIZE];
    struct histogram histogram;
};
/* In the order in which they were first seen; index from 0. NULL: there are no more. Valid as long as the clock. */
const struct stage_times *stage_clock_times(struct stage_clock *clock, size_t index);

#endif
