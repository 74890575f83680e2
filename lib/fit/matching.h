/* A sub-sample of a fit's strands, and how well the groom's operators match the target on it. */
#ifndef FIT_MATCHING_H
#define FIT_MATCHING_H

#include "fit/moments.h"
#include "fit/state.h"

struct matching;

struct matching_wanted {
    uint32_t n_pairs; /* at most as many as there are strands */
    double floor;     /* of the statistics' standard deviations: moments_covariance */
    int known;        /* whether the groom's curls were found */
    int by_pairs;     /* whether the parameters that there are are near: pairs of the target are then compared with the same
                       * pairs as they are simulated, whose roots and base strands tell how far they are apart */
};

/* Pairs of neighbouring strands: strands drawn fairly, each with its nearest neighbour on the scalp that is
 * no duplicate of it. The groom's random numbers are replaced by the quantiles of their ranks, so that what
 * is simulated has the spread that the operators mean, not that of one draw; those of curls that were found are
 * kept. They stay the same for all parameters (common random numbers). A function of the fit's state alone.
 * returns  GROOM_OK, GROOM_ENOMEM. Owned by the caller */
GROOM_MUST_CHECK groom_status matching_create(const struct groom_fit *fit, const struct matching_wanted *wanted,
                                              const struct groom_context *context, struct matching **matching,
                                              struct groom_diag *diag);
void matching_destroy(struct matching *matching); /* takes NULL */

/* Statistics of one draw scatter as much as the target's own do. From now on residuals are of the mean of n_draws: of the draw
 * that is simulated, moved by how far it is from that mean at these operators, which changes little with them; but of few pairs one draw is
 * enough. n_draws > 0
 * returns    GROOM_OK, GROOM_ENOMEM: the matching is of no use then
 * threads    same bits for any pool */
GROOM_MUST_CHECK groom_status matching_average(struct matching *matching, const struct groom_operator *operators,
                                               const double axes[3][3], uint32_t n_draws, const struct groom_context *context,
                                               struct groom_diag *diag);

/* How far the statistics of the groom with these operators are from the target's, as independent numbers
 * of variance 1 where the operators are right (with guides that are right, too).
 * operators  of the fit's groom, of which the parameters are read
 * axes       rows: those that operators lean on
 * residual   [MOMENTS_COUNT] out
 * returns    GROOM_OK, GROOM_ENOMEM
 * threads    same bits for any pool */
GROOM_MUST_CHECK groom_status matching_residual(struct matching *matching, const struct groom_operator *operators,
                                                const double axes[3][3], double residual[MOMENTS_COUNT],
                                                const struct groom_context *context, struct groom_diag *diag);

#endif
