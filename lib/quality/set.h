/* A set of strands as it is compared: all with the same number of vertices. */
#ifndef QUALITY_SET_H
#define QUALITY_SET_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/strands.h"

struct quality_set {
    uint32_t n, m;
    float (*points)[3]; /* [n * m] uniform in arc length */
    double *start;      /* [n + 1] arc length of the strands before each; start[n]: of all */
    const struct groom_allocator *allocator;
};

/* A point of a strand, and where the strand goes there; direction 0 where it has no length. */
struct quality_place { float position[3], direction[3]; };

/* Resamples to m vertices; finish it in any case.
 * returns  GROOM_OK, GROOM_EINVAL (a value that is not finite, a strand of fewer than 2 vertices), GROOM_EEMPTY
 *          (fewer than 2 strands, no length), GROOM_ETOOBIG, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status quality_set_init(struct quality_set *set, const struct groom_strands *strands, uint32_t m,
                                               const struct groom_context *context, struct groom_diag *diag);
/* Some strands of a set, in this order. */
GROOM_MUST_CHECK groom_status quality_set_select(struct quality_set *set, const struct quality_set *from,
                                                 const uint32_t *strand, uint32_t n,
                                                 const struct groom_context *context, struct groom_diag *diag);
void quality_set_finish(struct quality_set *set);

double quality_set_length(const struct quality_set *set); /* metres of all strands */
/* The place at `arc` metres along all strands, one after another. */
void quality_set_place(const struct quality_set *set, double arc, struct quality_place *place);

#endif
