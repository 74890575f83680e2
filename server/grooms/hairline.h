/* Today's front hairline of strands or a groom, carried to another head (groom/hairline.h). */
#ifndef GROOMS_HAIRLINE_H
#define GROOMS_HAIRLINE_H

#include "server/grooms/grooms.h"

struct cJSON;

struct grooms_hairline_wish {
    const char *project;       /* where all that is named is looked for */
    const char *target;        /* a head */
    const struct cJSON *inputs; /* as a retargeting has them: strands or groom and revision, source, targets[0] */
    uint32_t points;           /* of the answer */
};

/* {"front":[[x,y,z],…],"ears":[…],"area","roots_outside"}; made by `groom-worker hairline`, which takes a second or so.
 * returns  GROOM_ENOTFOUND, and what that answers, with its pointer */
GROOM_MUST_CHECK groom_status grooms_hairline(struct grooms *grooms, const struct grooms_hairline_wish *wish, char **json,
                                              size_t *n_bytes, struct groom_diag *diag);

#endif
