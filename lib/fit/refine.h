/* Curves through the vertices of strands that have few. */
#ifndef FIT_REFINE_H
#define FIT_REFINE_H

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/strands.h"

/* Strands of at most m / 2 vertices get vertices in between, on the Catmull-Rom curve through theirs (centripetal: no loops
 * and no overshoot at uneven steps; Yuksel et al. 2011). Sampled as polylines they would be straight but for corners, which
 * the fit would take for frizz. Segments that end in a turn of more than 30 degrees are less of a curve, from 60 on none:
 * crimps go from vertex to vertex. Strands of more vertices, of two, and those that hardly turn stay as they are.
 * in       each strand has at least 2 vertices
 * out      a container of its own, for the caller to destroy
 * returns  GROOM_OK, GROOM_ETOOBIG, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status refine_strands(const struct groom_strands *in, uint32_t m, const struct groom_context *context,
                                             struct groom_strands **out, struct groom_diag *diag);

#endif
