/* Which operator guide each strand follows (Chang et al. 2025, Section 5.2). */
#ifndef FIT_ASSIGN_H
#define FIT_ASSIGN_H

#include "groom/groom.h"
#include "groom/spatial.h"

struct assign_counts {
    uint32_t n_reassigned;  /* got another than the nearest one */
    uint32_t n_penetrating; /* no near operator guide keeps them out: they keep the nearest */
};

/* Fills operator_guide_of: the nearest operator guide in scalp coordinates (ties to the lower index).
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status assign_nearest(struct groom *groom, const struct groom_context *context,
                                             struct groom_diag *diag);

/* Strands first .. first+count-1 that the nearest operator guide pulls into the head get the next
 * nearest that does not. What is tested is the instanced strand, clumped to the operator guide by
 * 1 - exp(-profile v): the operators' random numbers are left out of account.
 * clearance  metres inside the head that do not count
 * counts     added to */
GROOM_MUST_CHECK groom_status assign_out_of_head(struct groom *groom, const struct groom_bvh *head, float profile,
                                                 float clearance, uint32_t first, uint32_t count,
                                                 const struct groom_context *context, struct assign_counts *counts,
                                                 struct groom_diag *diag);

/* The strongest clump of the chain, 1 at least if there is any: what pulls strands across. 0: nothing does. */
float assign_clump_profile(const struct groom *groom);

/* How many vertices of a polyline, the root left out, are more than `clearance` inside the head. A way
 * in through an opening of the mesh does not count. */
uint32_t assign_buried(const struct groom_bvh *head, const float (*points)[3], uint32_t n, float clearance);

#endif
