/* The law of a curl's frequencies, off the frequencies that its operator guides were found to have.
 *
 * What strands tell is how often each curl winds, frequency + random_frequency u: from as many of these products as
 * there are operator guides, mean and spread of the law follow at once, while the statistics of stage `operators`
 * see them through all else that strands differ by. */
#ifndef FIT_FREQUENCIES_H
#define FIT_FREQUENCIES_H

#include "fit/state.h"

/* Whether there are operator guides enough, with strands enough, to tell a law. */
int frequencies_tell(const struct groom *groom);

/* Widens the range that frequencies are looked for in, which the law keeps numbers in; the frequencies stay.
 * A law from statistics may be far too narrow. */
void frequencies_widen(struct groom *groom, struct groom_operator *curl);

/* The law from the frequencies found, and numbers that have the spread that they have by it.
 * half  [n_operator_guides][2] numbers by one half of a curl's strands alone, and by the other, NAN where there are
 *       none: what these do not agree on is no difference of curls. Or NULL: roughly, by the middle three fifths of
 *       the curls alone, as others may have been taken for what they are not
 * returns GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status frequencies_restate(struct groom *groom, struct groom_operator *curl,
                                                 const float (*half)[2], const struct groom_allocator *allocator,
                                                 struct groom_diag *diag);

#endif
