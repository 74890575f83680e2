/* Starting values of the operators, read off the strands. */
#ifndef FIT_ESTIMATE_H
#define FIT_ESTIMATE_H

#include "fit/state.h"

/* What a look at the strands tells; lengths in metres. Each is the size of an effect as it shows in
 * the strands, so that the groom starts with the look of the capture; where operators hide each
 * other's effects (clump shrinks curls and evens out lengths) they are too small. Sane on anything.
 *   scale   spread of the lengths of a cluster's strands about their mean: sd / 0.54, the standard
 *           deviation of N(0,1) truncated to [-1,1]
 *   bend    angle between the last third of a strand and that of its cluster's mean
 *   curl    strongest frequency of what smoothing as of guides takes off strands, and its size
 *   clump   decay of the spread of a cluster's strands, from root to tip
 *   frizz   frequency and size of what is left beside the curl */
struct estimates {
    double scale;
    double bend_angle;
    double curl_radius, curl_frequency;
    double clump_profile;
    double frizz_frequency, frizz_amplitude;
    double wave_power; /* mean square of what smoothing takes off strands, square metres */
};

/* Needs clusters. */
GROOM_MUST_CHECK groom_status estimate_operators(const struct groom_fit *fit, const struct groom_context *context,
                                                 struct estimates *estimates, struct groom_diag *diag);

/* Puts them into an operator of the chain, within its parameters' ranges. */
void estimate_apply(const struct estimates *estimates, struct groom_operator *op);

#endif
