/* Some strands of a fit's groom beside their targets. */
#ifndef FIT_GATHER_H
#define FIT_GATHER_H

#include "fit/state.h"

/* Evaluated as the groom stands, and resampled as the target was; both in metres.
 * strand          [n] indices
 * fitted, target  [n * m] out; target: NULL where it is not wanted
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status gather_strands(const struct groom_fit *fit, const uint32_t *strand, uint32_t n,
                                             float (*fitted)[3], float (*target)[3],
                                             const struct groom_context *context, struct groom_diag *diag);

/* The same as the groom has them, vertex by vertex: what is in the head is told of these.
 * points   [n * m] out
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status gather_evaluated(const struct groom_fit *fit, const uint32_t *strand, uint32_t n,
                                               float (*points)[3], const struct groom_context *context,
                                               struct groom_diag *diag);

/* target  [n * m] out */
void gather_targets(const struct groom_fit *fit, const uint32_t *strand, uint32_t n, float (*target)[3]);

#endif
