/* What strands' random numbers have in common, and is not theirs: numbers are drawn one by one, around 0. */
#ifndef FIT_CENTRE_H
#define FIT_CENTRE_H

#include "groom/groom.h"

/* Scales' numbers, of all strands: what they have in common becomes the guides' length, so that strands are as long as they
 * were (but for clumps, which longer guides move). */
void centre_scales(struct groom *groom);

/* Scales' and bends' numbers, bundle by bundle: what those of a bundle have in common beyond what draws would be is taken off
 * them (by the expectation of a normal number that is measured with a normal error, whose variance is what bundles' means
 * have in excess of draws). Guides stay as they are: for those that are solved for these numbers next. Solved for numbers
 * that share what guides should be, they would stay as wrong as they are.
 * returns  GROOM_OK, GROOM_ENOMEM: nothing has changed */
GROOM_MUST_CHECK groom_status centre_bundles(struct groom *groom, const struct groom_allocator *allocator, struct groom_diag *diag);

#endif
