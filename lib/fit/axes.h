/* The axes that hair was made along.
 *
 * Noise shifts strands along three axes, and bends and curls begin at directions that are taken off them: turned against
 * these, hair is of another kind. The statistics tell so, sharply where hair falls: off by 15 degrees, straight, wavy and
 * bent hair is 4 to 15 times as far from its target; coily and short hair tells less. Parameters that are told along wrong
 * axes are off by 5 to 20 %.
 * Hair from the model lies along the axes of its file, unless somebody has turned it: then along none that a file
 * could name. Hair that was captured lies along none at all: where it is far from any that the model makes, the file's do.
 * Statistics leave a few degrees in doubt, which strands tell later (align.h). */
#ifndef FIT_AXES_H
#define FIT_AXES_H

#include "fit/state.h"

/* Sets fit->frame and fit->axes by which axes bring the statistics nearest to the target's: the file's own, where they are
 * about as good as any; these by quarter turns, where another axis was up; or others, near those that the hair itself tells
 * (canonical.h). The first time parameters are rough, and are left as they are; later, what may be best is tried with
 * parameters that go along, which it takes with it where the axes change: told along other axes, parameters speak for those.
 * n_pairs  that tell whether the file's do; which of others do, all pairs of stage `operators` tell
 * returns  GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED; the fit is untouched on error */
GROOM_MUST_CHECK groom_status axes_choose(struct groom_fit *fit, uint32_t n_pairs, const struct groom_context *context,
                                          struct groom_diag *diag);

/* Has the fit's groom lean on the axes that were found. */
void axes_give(struct groom_fit *fit);

#endif
