/* A frame that turns with the hair, so that what a fit finds does not depend on how the capture lay.
 *
 * The model leans on the axes: noise shifts strands along x, y and z, bends and curls begin at directions that are
 * taken off them (model/frames.h). Its parameters mean the same in any frame, its random numbers do not: the same
 * hair turned is, to the statistics that parameters are told by, the same hair with other random numbers, which moves
 * those that the strands hardly tell by a fifth. So these statistics begin in the hair's own frame, and tell in which one
 * they end (axes.h). */
#ifndef FIT_CANONICAL_H
#define FIT_CANONICAL_H

#include "fit/state.h"

/* Rows are the axes, right-handed: y against the way the hair goes on the whole from its roots, so that it is
 * nearly up where hair falls; z to where roots reach out farthest, by their third moment, across y. Where either
 * is not defined (hair that goes evenly to all sides; roots alike on opposite sides), by the axis x, y or z that is
 * the farthest from what is.
 * strands that are outliers are left out; at least one is none */
void canonical_frame(const struct groom_fit *fit, const unsigned char *outlier, double frame[3][3]);

#endif
