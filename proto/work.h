/* The work protocol: what one attempt of one job (groom-worker attempt) says to the daemon.
 *
 * The launcher gives the process two environment variables; everything else it asks for over HTTP,
 * with `Authorization: Bearer <token>`. The token is one attempt's: it names the job, and once
 * another attempt has begun every call with it answers 409 (fenced) and the process leaves quietly.
 * 410 says that the job is no more.
 *
 *   GET  /v1/work                   200 the order (below)
 *   GET  /v1/work/inputs/{sha256}   200 the bytes of an input, as uploaded
 *   GET  /v1/work/checkpoint        200 the bytes of the last checkpoint, 404 where there is none
 *   PUT  /v1/work/checkpoint        204; body application/octet-stream. Acknowledged = durable
 *   POST /v1/work/progress          200 {"cancel":bool}; body: the progress message (below)
 *   PUT  /v1/work/result            201 {"groom":"grm_..."}; body: the groom document. Ends the attempt
 *   POST /v1/work/failed            204; body: a problem (proto/problem.h). Ends the attempt
 *
 * The order:
 *   {"job":"job_...","kind":"fit","attempt":1,"options":{...},
 *    "inputs":{"strands":{"id","sha256","size","format","unit_m","up","path"?},
 *              "head":{"id","sha256","size","format","unit_m","up","path"?}|null},
 *    "checkpoint":{"sha256","size"}|null}
 * `format` may be "auto" or missing; `path` is the input's file where daemon and worker share a
 * folder. Bytes are verified against sha256 wherever they come from.
 *
 * The progress message (any member but progress may be missing):
 *   {"stage":{"name","index","count"},"progress":0..1,"eta_s":seconds|null,
 *    "losses":[{"stage","iteration","name","value"},...],"warnings":["...",...]}
 *
 * A process that gets SIGTERM saves a checkpoint and exits with WORK_EXIT_STOPPED: the attempt may
 * be begun again, from there. */
#ifndef PROTO_WORK_H
#define PROTO_WORK_H

#define WORK_ENV_URL     "GROOM_WORK_URL"     /* http://127.0.0.1:8080 */
#define WORK_ENV_TOKEN   "GROOM_WORK_TOKEN"
#define WORK_ENV_THREADS "GROOM_WORK_THREADS" /* missing or 0: one for each processor */

#define WORK_PATH            "/v1/work"
#define WORK_PATH_INPUTS     "/v1/work/inputs"
#define WORK_PATH_CHECKPOINT "/v1/work/checkpoint"
#define WORK_PATH_PROGRESS   "/v1/work/progress"
#define WORK_PATH_RESULT     "/v1/work/result"
#define WORK_PATH_FAILED     "/v1/work/failed"

/* How an attempt's process ends. Anything else (a signal, another status) is a crash. */
#define WORK_EXIT_DONE    0  /* the result, or that the job is cancelled, was acknowledged */
#define WORK_EXIT_FAILED  1  /* the failure was acknowledged */
#define WORK_EXIT_USAGE   2
#define WORK_EXIT_STOPPED 75 /* stopped from outside (SIGTERM) or fenced off: nothing to report */

#endif
