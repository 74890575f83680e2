/* What a retargeting has made, taken from its worker: a groom for each target, and where strands were carried over
 * the upload that each stands on.
 *
 *     grooms_retargeted_take → work_made → grooms_retargeted_finish */
#ifndef GROOMS_RETARGETED_H
#define GROOMS_RETARGETED_H

#include "server/grooms/grooms.h"

#define GROOMS_MOST_TARGETS 16

struct grooms_retargeted {
    size_t n;
    struct grooms_prepared prepared[GROOMS_MOST_TARGETS];
    struct store_revision_new grooms[GROOMS_MOST_TARGETS]; /* the same, in a row */
    size_t n_assets;
    struct store_asset assets[GROOMS_MOST_TARGETS];        /* their blobs are pinned */
    char *result;  /* JSON: the job's */
    struct blobs *blobs;
};

/* bytes  for each target a line of JSON and the bytes that it announces (proto/work.h)
 * job    of kind "retarget"
 * returns  GROOM_EINVAL where they are not what a worker hands in */
GROOM_MUST_CHECK groom_status grooms_retargeted_take(struct grooms *grooms, const struct store_job *job, const char *bytes,
                                                     size_t n_bytes, struct grooms_retargeted *made,
                                                     struct groom_diag *diag);
void grooms_retargeted_finish(struct grooms_retargeted *made); /* takes zeroed; unpins */

/* The head that a revision was made with ("" where it had none); *revision 0 becomes the latest.
 * returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status grooms_head_of(struct grooms *grooms, const char *groom_id, uint32_t *revision,
                                             char head[STORE_ID_SIZE], struct groom_diag *diag);

#endif
