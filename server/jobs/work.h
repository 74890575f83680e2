/* The daemon's side of the worker protocol: what one attempt may ask and tell.
 *
 * A worker is launched with GROOM_WORK_URL and GROOM_WORK_TOKEN and speaks HTTP with
 * `Authorization: Bearer <token>`; the HTTP side authenticates and calls these:
 *
 *   GET  /v1/work/job                what is to be done                       work_begin, work_describe
 *   GET  /v1/work/blobs/{sha256}     an input, or the checkpoint              work_may_read, blobs_read
 *   POST /v1/work/progress           where it stands; answers {"cancel":b}    work_progress
 *   PUT  /v1/work/checkpoint?stage=N bytes to go on from                      blobs_…, work_checkpoint
 *   PUT  /v1/work/preparation        bytes that the next job with these inputs may start from
 *                                                                             blobs_…, work_preparation
 *   POST /v1/work/result             the groom, or what else was made         work_result, work_edited, work_made
 *   POST /v1/work/failed             a problem object: it cannot be done      work_failed
 *   POST /v1/work/ended              {"words"}: the process ends without one  work_ended
 *
 * Every call is fenced: once the attempt has ended or another has begun it is refused with
 * GROOM_ECONFLICT, and nothing is written. The worker then exits.
 * threads   any */
#ifndef JOBS_WORK_H
#define JOBS_WORK_H

#include "server/jobs/jobs.h"

#define WORK_TOKEN_SIZE 65 /* 64 hexadecimal digits */
#define WORK_MAX_WORDS  4096

/* A one-time token of 256 random bits and the hash under which the store knows it. */
GROOM_MUST_CHECK groom_status work_token_make(char token[WORK_TOKEN_SIZE], char hash[STORE_HASH_SIZE]);
/* SHA-256 of any bytes, in hexadecimal. */
void work_hash(const void *bytes, size_t n_bytes, char hash[STORE_HASH_SIZE]);

/* token    as it was sent: "<token>", or "<token>.<run>" of an attempt that a cluster started again
 * returns  GROOM_ENOTFOUND (no such token: HTTP 401), GROOM_ECONFLICT (fenced: 409) */
GROOM_MUST_CHECK groom_status work_authenticate(struct jobs *jobs, const char *token,
                                                struct store_attempt_ref *ref, struct groom_diag *diag);

/* A run of the attempt begins to work: those before it are fenced off. returns  GROOM_ECONFLICT */
GROOM_MUST_CHECK groom_status work_begin(struct jobs *jobs, const struct store_attempt_ref *ref,
                                         struct groom_diag *diag);
/* {"job","kind","attempt","options":{…},"request":{…},
 *  "inputs":{"strands":{"id","sha256","bytes","format","unit_m","up","name"[,"path"]},"head":{…},
 *            "source":{…},"targets":[{…},…]},                  those that the job has
 *  "checkpoint":{"sha256","bytes","stage"[,"path"]} or null,
 *  "preparation":{"sha256","bytes"[,"path"]} or null}          of jobs that keep one; null: hand it in
 * with the paths where jobs_share_blobs said that workers see the folder of blobs.
 * *text is malloc'ed. */
GROOM_MUST_CHECK groom_status work_describe(struct jobs *jobs, const struct store_attempt_ref *ref, char **text,
                                            struct groom_diag *diag);
/* GROOM_OK where this blob is an input of the attempt's job, its checkpoint or its preparation; else
 * GROOM_ENOTFOUND. */
GROOM_MUST_CHECK groom_status work_may_read(struct jobs *jobs, const struct store_attempt_ref *ref,
                                            const char *sha256, struct groom_diag *diag);
/* body     {"stage":{"name","index","count"},"progress":0..1,"eta_s":N,
 *           "losses":[{"iteration","name","value"[,"stage"]},…]}, each member optional
 * *cancel  the worker is to stop now
 * returns  GROOM_EINVAL with the pointer of what is wrong, GROOM_ECONFLICT */
GROOM_MUST_CHECK groom_status work_progress(struct jobs *jobs, const struct store_attempt_ref *ref,
                                            const char *body, size_t n_body, bool *cancel,
                                            struct groom_diag *diag);
/* A committed, pinned blob becomes the job's checkpoint; it is unpinned here, whatever is returned, and
 * the one before it is collected. stage: number of stages that are done. */
GROOM_MUST_CHECK groom_status work_checkpoint(struct jobs *jobs, const struct store_attempt_ref *ref,
                                              const char *sha256, uint64_t n_bytes, uint32_t stage,
                                              struct groom_diag *diag);
/* The job has succeeded: its groom's first revision and its end are one transaction. The job's result
 * is {"groom":"grm_…","revision":1}.
 * returns  GROOM_ECONFLICT, GROOM_ECANCELLED, and what store_groom_create returns */
GROOM_MUST_CHECK groom_status work_result(struct jobs *jobs, const struct store_attempt_ref *ref,
                                          const struct store_revision_new *groom, struct groom_diag *diag);
/* The same of an edit: its result is this JSON object, and `groom` the revision after `expected`, or a new
 * groom where that is 0. */
GROOM_MUST_CHECK groom_status work_edited(struct jobs *jobs, const struct store_attempt_ref *ref,
                                          const struct store_revision_new *groom, uint32_t expected, const char *result,
                                          struct groom_diag *diag);
/* A committed, pinned blob is what the job has worked out of its inputs alone; it is unpinned here, whatever is
 * returned. returns  GROOM_ECONFLICT, GROOM_EINVAL (jobs of this kind keep none) */
GROOM_MUST_CHECK groom_status work_preparation(struct jobs *jobs, const struct store_attempt_ref *ref,
                                               const char *sha256, uint64_t n_bytes, struct groom_diag *diag);
/* New grooms and the uploads that they stand on; borrowed. */
struct work_made {
    const struct store_revision_new *grooms;
    size_t n_grooms;
    const struct store_asset *assets; /* their blobs are pinned, the caller's to unpin */
    size_t n_assets;
};
/* As work_result, with several; the result is this JSON object. */
GROOM_MUST_CHECK groom_status work_made(struct jobs *jobs, const struct store_attempt_ref *ref,
                                        const struct work_made *made, const char *result, struct groom_diag *diag);
/* The job has failed for good with this problem object (JSON). returns  GROOM_EINVAL, GROOM_ECONFLICT,
 *          GROOM_ECANCELLED (it was told to stop: it has only to exit) */
GROOM_MUST_CHECK groom_status work_failed(struct jobs *jobs, const struct store_attempt_ref *ref,
                                          const char *body, size_t n_body, struct groom_diag *diag);
/* The process ends without a result: {"words":"…"}, what it said last. The supervisor hears it before
 * the launcher may know. returns  GROOM_EINVAL, GROOM_ECONFLICT */
GROOM_MUST_CHECK groom_status work_ended(struct jobs *jobs, const struct store_attempt_ref *ref,
                                         const char *body, size_t n_body, struct groom_diag *diag);

#endif
