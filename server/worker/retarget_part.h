/* What a retargeting hands in for one target: a line of JSON, and behind it the strands or the groom. */
#ifndef WORKER_RETARGET_PART_H
#define WORKER_RETARGET_PART_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/groom.h"
#include "groom/retarget.h"
#include "groom/strands.h"

struct cJSON;

/* Numbers of each strand, for colours; members may be NULL. */
struct retarget_colours {
    float *movement; /* mean over its vertices, metres, from the initial transfer */
    float *depth;    /* how far below the clearance the initial transfer was at the deepest, metres */
    float *stretch;  /* its length over the source's */
    float *density;  /* relative change of the density of roots around it, by a hairline edit */
};

/* All borrowed. */
struct retarget_part {
    const struct groom_strands *strands;       /* what was carried; or NULL: */
    const struct groom *groom;
    uint32_t n_strands;
    const struct groom_retarget_report *report;
    const struct groom_skeleton *source_skeleton, *skeleton;
    const struct cJSON *hairline;              /* what its edit did, or NULL */
    struct retarget_colours colours;
};

/* Append it to the file. returns  GROOM_ENOMEM, GROOM_EIO */
GROOM_MUST_CHECK groom_status retarget_part_write(const struct retarget_part *part, int fd,
                                                  const struct groom_context *context, struct groom_diag *diag);

#endif
