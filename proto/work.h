/* The work protocol: what one attempt of one job (groom-worker attempt) says to the daemon.
 * server/jobs/work.h is the daemon's side of it.
 *
 * The launcher gives the process two environment variables; everything else it asks for over HTTP,
 * with `Authorization: Bearer <token>`. The token is one attempt's: it names the job. Once another
 * attempt has begun, or this one has ended, every call with it answers 409 (fenced) and the process
 * leaves quietly; so it does on 401 and 410.
 *
 *   GET  /v1/work/job                  200 the order (below)
 *   GET  /v1/work/blobs/{sha256}       200 the bytes of an input, as uploaded, or of the checkpoint
 *   PUT  /v1/work/checkpoint?stage=N   2xx; body application/octet-stream, N stages are done.
 *                                      Acknowledged = durable
 *   POST /v1/work/progress             200 {"cancel":bool}; body: the progress message (below)
 *   POST /v1/work/result               2xx; body: the groom document, with a member "quality" where there is
 *                                      a report (groom/quality.h). Ends the attempt
 *   POST /v1/work/failed               2xx; body: a problem (proto/problem.h). Ends the attempt
 *   POST /v1/work/ended                2xx; body: {"words":"..."}: the process ends without either, and
 *                                      why; for launchers that learn late, or never, how it ended
 *
 * Of an edit (kind "ruffle", "sculpt", "interpolate", "curl_scale"):
 *   GET  /v1/work/layer                200 the layer as in a document, its arrays inline
 *   GET  /v1/work/strands              200 the strands that come into it (proto/strand_stream.h)
 *   POST /v1/work/result               2xx; body: a line {"report":{…},"contact":{…}?}, then the strands
 *                                      that come out of it, the same way. The report's numbers, each optional:
 *                                      strands changed conversion_error seconds energy_before energy_after
 *                                      anchors anchor_error_mean anchor_error_max iterations_median
 *                                      iterations_max unfinished contact_checked contact_entered
 *                                      contact_inside contact_depth_before contact_depth_after
 *
 * Of a retargeting (kind "retarget"):
 *   GET  /v1/work/groom                200 the groom document that is carried, its arrays inline
 *   GET  /v1/work/strands              200 the groom's strands, where it is carried "dense": HAIR, metres
 *   PUT  /v1/work/preparation          2xx; body application/octet-stream: what the attempt has worked out of
 *                                      its source alone, where the order's "preparation" is null
 *   POST /v1/work/result               2xx; body: for each target, in their order, a line
 *                                      {"kind":"strands"|"groom","bytes":N,"report":{…},
 *                                       "source_skeleton":{…},"skeleton":{…},"hairline":{…}?,
 *                                       "strands":{"movement","depth","stretch": f32[n]}}
 *                                      and behind it N bytes: the strands as HAIR, or a groom document.
 *                                      Skeletons are those that were used, made or given
 *
 * The order:
 *   {"job":"job_...","kind":"fit","attempt":1,"options":{...},"request":{...},
 *    "inputs":{"strands":{"id","sha256","bytes","format","unit_m","up","name","path"?},
 *              "head":{the same}|null,
 *              "source":{the same},"targets":[{the same},...]},   of a retargeting
 *    "checkpoint":{"sha256","bytes","stage","path"?}|null,
 *    "preparation":{"sha256","bytes","path"?}|null}               of jobs that keep one
 * `format` may be "" or missing: recognise it. `path` is the file where daemon and worker share a
 * folder. Bytes are verified against sha256 wherever they come from.
 *
 * The progress message (any member may be missing):
 *   {"stage":{"name","index","count"},"progress":0..1,"eta_s":seconds,
 *    "losses":[{"stage","iteration","name","value"},...]}
 *
 * A cluster that loses a node may start the same attempt elsewhere, with the same environment. Each
 * start is a run, numbered by GROOM_WORK_RUN from 0; the nth says `Bearer <token>.<n>`. Once a run has
 * asked for its order, the runs before it are fenced off.
 *
 * A process that gets SIGTERM saves a checkpoint and exits with WORK_EXIT_STOPPED: the attempt may
 * be begun again, from there. */
#ifndef PROTO_WORK_H
#define PROTO_WORK_H

#define WORK_ENV_URL     "GROOM_WORK_URL"     /* http://127.0.0.1:8080 */
#define WORK_ENV_TOKEN   "GROOM_WORK_TOKEN"
#define WORK_ENV_THREADS "GROOM_WORK_THREADS" /* missing or 0: one for each processor */
#define WORK_ENV_RUN     "GROOM_WORK_RUN"     /* missing: 0 */
/* Seconds that a daemon which does not answer is waited for; missing: 60. */
#define WORK_ENV_PATIENCE "GROOM_WORK_PATIENCE"

#define WORK_PATH_JOB        "/v1/work/job"
#define WORK_PATH_LAYER      "/v1/work/layer"
#define WORK_PATH_STRANDS    "/v1/work/strands"
#define WORK_PATH_BLOBS      "/v1/work/blobs" /* "/{sha256}" */
#define WORK_PATH_GROOM      "/v1/work/groom"
#define WORK_PATH_CHECKPOINT "/v1/work/checkpoint"
#define WORK_PATH_PREPARATION "/v1/work/preparation"
#define WORK_PATH_PROGRESS   "/v1/work/progress"
#define WORK_PATH_RESULT     "/v1/work/result"
#define WORK_PATH_FAILED     "/v1/work/failed"
#define WORK_PATH_ENDED      "/v1/work/ended"

/* How an attempt's process ends. Anything else (a signal, another status) is a crash. */
#define WORK_EXIT_DONE    0  /* the result was acknowledged */
#define WORK_EXIT_FAILED  1  /* the failure was acknowledged */
#define WORK_EXIT_USAGE   2
#define WORK_EXIT_STOPPED 75 /* stopped: SIGTERM, a cancelled job, or fenced off */

#endif
