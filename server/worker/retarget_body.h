/* The bodies of a retargeting, read and made ready: right side out, with a skeleton, and a target with the
 * source's triangles. What is wrong with one is said with its place in the job ("/targets/0/skeleton"). */
#ifndef WORKER_RETARGET_BODY_H
#define WORKER_RETARGET_BODY_H

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"
#include "groom/skeleton.h"
#include "server/worker/order.h"
#include "server/worker/work_link.h"

struct cJSON;

struct retarget_body {
    struct groom_mesh *mesh;
    struct groom_skeleton skeleton;
};

/* asked    the request's "source": its skeleton, where it has one; else one is made of the mesh */
GROOM_MUST_CHECK groom_status retarget_body_source(struct work_link *link, const struct order_input *input,
                                                   const struct cJSON *asked, const struct groom_context *context,
                                                   struct retarget_body *body, struct groom_diag *diag);
/* A mesh of other triangles is registered: by the landmarks of `asked`, or by the texture coordinates that both
 * have. The skeleton is given, or the source's carried over.
 * index    of the target, for complaints */
GROOM_MUST_CHECK groom_status retarget_body_target(struct work_link *link, const struct order_input *input,
                                                   const struct cJSON *asked, unsigned index,
                                                   const struct retarget_body *source,
                                                   const struct groom_context *context, struct retarget_body *body,
                                                   struct groom_diag *diag);
/* The same of a body whose mesh has been read (with by_faces_alone).
 * place    of the target: "/targets/0" */
GROOM_MUST_CHECK groom_status retarget_body_open_source(const struct cJSON *asked, const struct groom_context *context,
                                                        struct retarget_body *body, struct groom_diag *diag);
GROOM_MUST_CHECK groom_status retarget_body_open_target(const struct cJSON *asked, const char *place,
                                                        const struct retarget_body *source,
                                                        const struct groom_context *context, struct retarget_body *body,
                                                        struct groom_diag *diag);
/* The complaint with its place in the job before the library's own pointer; st. */
groom_status retarget_complain(groom_status st, const char *place, struct groom_diag *diag);
void retarget_body_finish(struct retarget_body *body); /* takes zeroed */

#endif
