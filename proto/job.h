/* The words of a job, as they stand in JSON, in event streams and in the database. */
#ifndef PROTO_JOB_H
#define PROTO_JOB_H

/* X(constant, name, whether it is an end state) */
#define JOB_STATE_LIST(X)                     \
    X(JOB_STATE_QUEUED,    "queued",    0)    \
    X(JOB_STATE_RUNNING,   "running",   0)    \
    X(JOB_STATE_SUCCEEDED, "succeeded", 1)    \
    X(JOB_STATE_FAILED,    "failed",    1)    \
    X(JOB_STATE_CANCELLED, "cancelled", 1)

typedef enum job_state {
#define JOB_STATE_ENUM(constant, name, is_end) constant,
    JOB_STATE_LIST(JOB_STATE_ENUM)
#undef JOB_STATE_ENUM
    JOB_STATE_COUNT
} job_state;

const char *job_state_name(job_state state);     /* "queued"; "unknown" out of range */
job_state job_state_parse(const char *name);     /* JOB_STATE_COUNT for NULL or another name */
int job_state_is_end(job_state state);

/* Events of GET /v1/jobs/{id}/events; each carries a JSON object and an increasing id.
 *   stage     {"name","index","count"}
 *   progress  {"stage":"name","progress":0..1,"eta_s":seconds?}
 *   loss      {"stage":"name","losses":[{"stage"?,"iteration","name","value"},...]}
 *   state     {"state",...} */
#define JOB_EVENT_STAGE    "stage"
#define JOB_EVENT_PROGRESS "progress"
#define JOB_EVENT_LOSS     "loss"
#define JOB_EVENT_STATE    "state"

#endif
