/* What cameras see of strands (Chang et al. 2025, Section 5.7).
 *
 * Strands of which no camera sees enough were made up by the reconstruction and leave the fit: the target
 * keeps those that are seen, so that clusters, weights, guides, operators and random numbers know of no
 * others; the groom gets the rest back at the end, instanced by distance (unseen.h). */
#ifndef FIT_VISIBILITY_H
#define FIT_VISIBILITY_H

#include "groom/camera.h"
#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"

struct visibility_scene {
    const float (*points)[3];      /* [n * m] of the strands; metres = points * scale + centre */
    float scale, centre[3];
    uint32_t n, m;
    const struct groom_mesh *head; /* or NULL */
    float ordinary;                /* size of the head over an ordinary one's */
};

/* The share of each strand's vertices that some camera sees: those that lie, up to a tolerance (1 mm on an
 * ordinary head and the width of a pixel), in front of the head and all strands in a depth buffer. Captured strands
 * are fewer than hairs, with gaps that hair does not have: the buffer's pixels are so large that strands
 * cover what they are drawn on several times.
 * share    [n], the caller's
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status visibility_shares(const struct visibility_scene *scene, const struct groom_camera *cameras,
                                                uint32_t n_cameras, float *share, const struct groom_context *context,
                                                struct groom_diag *diag);

#endif
