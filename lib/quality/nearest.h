/* Places of one set of strands, and what of another is near them. */
#ifndef QUALITY_NEAREST_H
#define QUALITY_NEAREST_H

#include "groom/quality.h"
#include "quality/segment_grid.h"

extern const double quality_tolerances[GROOM_QUALITY_TOLERANCES][2]; /* metres, radians */

/* Shares of the places that pass each tolerance: by any near segment, by the nearest alone. */
struct nearest_result {
    struct groom_quality_nearest nearest;
    double any[GROOM_QUALITY_TOLERANCES], strict[GROOM_QUALITY_TOLERANCES];
};

/* n_places  at equal steps along all strands of `from`
 * returns   GROOM_OK, GROOM_ENOMEM
 * threads   same bits for any pool */
GROOM_MUST_CHECK groom_status quality_nearest(const struct quality_set *from, const struct segment_grid *to,
                                              uint32_t n_places, const struct groom_context *context,
                                              struct nearest_result *result, struct groom_diag *diag);

#endif
