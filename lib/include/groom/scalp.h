/* Scalp coordinates: a chart of the scalp in which distance means distance on the scalp.
 *
 * Guides are instanced by nearness in this chart (Chang et al. 2025, Eq. 3), so what counts is
 * that near roots are near in it, far ones far, and all directions alike. */
#ifndef GROOM_SCALP_H
#define GROOM_SCALP_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/spatial.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Where scalp coordinates came from; recorded in the document. */
typedef enum groom_scalp_source {
    GROOM_SCALP_MESH_UV,  /* the head's own texture coordinates */
    GROOM_SCALP_COMPUTED, /* computed on a head that has none, or none that serve */
    GROOM_SCALP_ROOTS,    /* from the roots alone; no head was given */
    GROOM_SCALP_FILE      /* the strands' file brought them */
} groom_scalp_source;

const char *groom_scalp_source_name(groom_scalp_source source); /* "mesh_uv", "computed", "roots", "file" */

struct groom_scalp;

/* Draw a chart of the region of the roots.
 *
 * Roots are brought to the closest point of the head's surface (captures start off the scalp). The
 * head's texture coordinates are taken where they serve: they cover the roots, neighbours on the
 * scalp are neighbours in them and the other way round (no seam, no mirrored or stacked charts),
 * and their scale varies little. Where they do not, or there are none, the chart is the azimuthal
 * equidistant map of a sphere fitted to the roots (Snyder 1987, p. 191; a plane where they fit none):
 * the pole is in the middle of the roots, v grows towards the back of the head (-z) or, where the
 * pole looks to the front or back, upwards, and u to the right of v as seen from outside. Either
 * way it is moved and scaled, by one number, to fill [0,1]^2 centred.
 *
 * roots    [n] metres; those that are not finite are left out of account
 * head     NULL: from the roots alone; borrowed until groom_scalp_destroy
 * returns  GROOM_OK (one root is enough), GROOM_EEMPTY (no finite root), GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status groom_scalp_create(const float (*roots)[3], uint32_t n,
                                                 const struct groom_bvh *head,
                                                 const struct groom_context *context,
                                                 struct groom_scalp **scalp, struct groom_diag *diag);
void groom_scalp_destroy(struct groom_scalp *scalp); /* takes NULL */

groom_scalp_source groom_scalp_source_of(const struct groom_scalp *scalp);
/* Metres of scalp that one unit of the chart stands for (its median scale). */
float groom_scalp_metres(const struct groom_scalp *scalp);
/* A sentence for the person who uploaded: which coordinates were taken and why. */
const char *groom_scalp_note(const struct groom_scalp *scalp);

/* Scalp coordinates of any points (roots, guides, new roots). The roots of the chart are within
 * [0,1]^2; others may fall outside of it and are clamped to it. A point that is not finite gets (0.5, 0.5).
 * uv       [n], the caller's */
void groom_scalp_coordinates(const struct groom_scalp *scalp, const float (*points)[3], uint32_t n,
                             float (*uv)[2], const struct groom_context *context);

#ifdef __cplusplus
}
#endif
#endif
