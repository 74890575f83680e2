/* The edit of a hairline on a target: where roots grow from then on, and which of them are given up. */
#ifndef WORKER_RETARGET_HAIRLINE_H
#define WORKER_RETARGET_HAIRLINE_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"
#include "groom/skeleton.h"

struct cJSON;

/* Zeroed where there is no edit. */
struct retarget_hairline {
    float (*roots)[3];     /* [n] where they are now, or NULL */
    float *density;        /* [n] relative change of density of the triangle that each root stands in */
    unsigned char *bald;   /* [n] 1: balding gives this strand up */
    uint32_t n, n_bald;
    struct cJSON *report;  /* {"edit":{…},"density":{"l1","linf"},…} */
};

/* asked    the target's "hairline", or NULL: nothing is edited
 * place    of it, for complaints: "/targets/0/hairline"
 * roots    [n] as they are carried to the body, on its surface
 * returns  what groom_hairline_relocate returns, with pointers below `place` */
GROOM_MUST_CHECK groom_status retarget_hairline_edit(const struct cJSON *asked, const char *place,
                                                     const struct groom_mesh *body, const struct groom_skeleton *skeleton,
                                                     const float (*roots)[3], uint32_t n,
                                                     const struct groom_context *context,
                                                     struct retarget_hairline *hairline, struct groom_diag *diag);
void retarget_hairline_finish(struct retarget_hairline *hairline); /* takes zeroed */

#endif
