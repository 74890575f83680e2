/* How alike strands are to their neighbours on the scalp. */
#ifndef FIT_LIKENESS_H
#define FIT_LIKENESS_H

#include "fit/regions.h"
#include "fit/state.h"

#define LIKENESS_NEIGHBOURS 8 /* on the scalp, that a strand is compared with */

struct likeness {
    uint32_t n;
    uint32_t *neighbour;      /* [n][LIKENESS_NEIGHBOURS]; UINT32_MAX: there are fewer strands */
    struct region_edge *edge; /* [n][LIKENESS_NEIGHBOURS] to each of them; a = b: to none */
    const struct groom_allocator *allocator;
};

/* Neighbours i and k that follow one operator guide differ by their roots, less towards the tip where they clump,
 *     x_is - x_ks = rest_s (root_i - root_k) + noise,
 * and by their lengths, which say nothing; those that follow two operator guides differ by these as well. An edge costs
 * the mean square of what is left of the difference, across the strands, without the roots' part. rest is found along:
 * from pairs that are alike, again and again, as in robust regression (Holland, Welsch 1977), beginning with those that
 * are at one place. With rest from all pairs, borders would take part and hide themselves.
 *
 * Strands are compared at equal parts of their lengths; where they wind at equal ways from the root, as far as both go,
 * for curls wind by the metre.
 * returns  GROOM_OK, GROOM_ENOMEM; finish it in any case
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status likeness_init(struct likeness *likeness, const struct groom_fit *fit, int winds,
                                            const struct groom_context *context, struct groom_diag *diag);
void likeness_finish(struct likeness *likeness);

#endif
