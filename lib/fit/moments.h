/* Statistics of strands that tell the operators' parameters apart.
 *
 * The losses of Chang et al. 2025, Section 5.5, hardly see some parameters (their notes: scale and
 * clump) and mix up others. What is compared here instead are means, over pairs of neighbouring
 * strands, of some 190 numbers a pair, each of which answers to few parameters:
 *
 *   spectra     logarithms of the power of a strand's segments at fixed turns per metre of its base
 *               strand, over the whole strand and over thirds: curl and frizz, and where they set in
 *   coherence   the same of the difference between the two strands of a pair: curls that share an
 *               operator guide cancel, frizz does not, and what scale and bend tell apart stays
 *   spread      mean absolute deviations of the spectra, the strands' mean frequency, and its
 *               difference within pairs: random frequency
 *   phase       how far the strongest wave runs ahead of its frequency from window to window: the frequency of
 *               one strand, finer than its spectrum tells, and how it differs between strands
 *   lengths     and their difference within pairs: scale
 *   stretch     how differently the strands of a pair have gone from their roots, at six places: along their
 *               way (scale) and aside (bend)
 *   distances   between the strands of a pair at six places, apart for pairs of one operator guide and of two,
 *               and along the distance of their roots: clump; the same to the operator guide, which hardly
 *               counts
 *
 * Differences within pairs do not lean on the guides: what is wrong with these is much the same for neighbours,
 * and cancels.
 *
 * Logarithms and absolute deviations keep a few odd strands from deciding. Nothing depends on the unit,
 * nor on the axes. */
#ifndef FIT_MOMENTS_H
#define FIT_MOMENTS_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

#define MOMENTS_FREQUENCIES 16 /* of the whole strand */
#define MOMENTS_COARSE 8       /* of a third */
#define MOMENTS_WINDOWS 5      /* thirds that overlap by half */
#define MOMENTS_PLACES 6
#define MOMENTS_MOST_VERTICES 1000

enum moments_index {
    MOMENTS_SPECTRUM,
    MOMENTS_SPREAD = MOMENTS_SPECTRUM + MOMENTS_FREQUENCIES,
    MOMENTS_COHERENCE = MOMENTS_SPREAD + MOMENTS_FREQUENCIES,
    MOMENTS_LOCAL = MOMENTS_COHERENCE + MOMENTS_FREQUENCIES,
    MOMENTS_LOCAL_COHERENCE = MOMENTS_LOCAL + MOMENTS_WINDOWS * MOMENTS_COARSE,
    MOMENTS_CENTROID = MOMENTS_LOCAL_COHERENCE + MOMENTS_WINDOWS * MOMENTS_COARSE,
    MOMENTS_PHASE = MOMENTS_CENTROID + 3,
    MOMENTS_LENGTH = MOMENTS_PHASE + 3,
    MOMENTS_DISTANCE = MOMENTS_LENGTH + 4,
    MOMENTS_BORDER = MOMENTS_DISTANCE + MOMENTS_PLACES,
    MOMENTS_STRETCH = MOMENTS_BORDER + MOMENTS_PLACES,
    MOMENTS_ASIDE = MOMENTS_STRETCH + MOMENTS_PLACES,
    MOMENTS_ALONG = MOMENTS_ASIDE + MOMENTS_PLACES,
    MOMENTS_GUIDE_DISTANCE = MOMENTS_ALONG + MOMENTS_PLACES,
    MOMENTS_GUIDE_ALONG = MOMENTS_GUIDE_DISTANCE + MOMENTS_PLACES,
    MOMENTS_COUNT = MOMENTS_GUIDE_ALONG + MOMENTS_PLACES
};

/* What strands are compared against: fixed while parameters change. Pairs are strands i and n_pairs + i. */
struct moments_plan {
    uint32_t n_pairs, m;        /* m at most MOMENTS_MOST_VERTICES */
    const float (*base)[3];   /* [2 n_pairs][m] strands without operators */
    const float (*guide)[3];  /* [2 n_pairs][m] their operator guides */
    const uint32_t *bundle;   /* [2 n_pairs] which these are */
    double frequency[MOMENTS_FREQUENCIES]; /* turns per metre, or of whatever unit the points have */
    double apart, off_guide;  /* median squared distances: of pairs' roots, of base strands from operator guides */
    double level[MOMENTS_FREQUENCIES];     /* of the target's spectrum, from which spread is measured */
    double centroid, phase;                /* of the target */
    uint32_t peak;                         /* which frequency is the target's strongest */
};

/* Fills frequency, apart and off_guide from base and guide; level, centroid and phase are 0, and the peak is where hair usually curls.
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status moments_plan_init(struct moments_plan *plan, const struct groom_context *context,
                                                struct groom_diag *diag);

/* The statistics of each pair: values [n_pairs][MOMENTS_COUNT]; NAN where a pair has nothing to say,
 * which depends on its base strands alone.
 * points   [2 n_pairs][m][3]
 * threads  same bits for any pool */
void moments_measure(const struct moments_plan *plan, const float (*points)[3], float *values,
                     const struct groom_context *context);

/* Means over pairs, NANs left out; 0 where there is nothing but NANs. */
void moments_mean(const float *values, uint32_t n_pairs, double mean[MOMENTS_COUNT]);

/* The covariance of the means, of which bundles are the independent draws: per-pair correlations, shrunk, with variances of
 * sums over bundles and a floor, as its Cholesky factor. Of differences between two sets of strands of the same base
 * strands, what these scatter by cancels: it is the operators' random numbers that are left.
 * values      [n_pairs][MOMENTS_COUNT] or their differences; NANs become the mean, and all become deviations from it.
 *             A statistic that few pairs have weighs nothing
 * bundle      [n_pairs] 0..n_bundles-1
 * size        [MOMENTS_COUNT] of the statistics themselves
 * floor       how finely the model is taken to tell a statistic, as a standard deviation: of logarithms and
 *             shares as it is, of absolute deviations as a part of their size; more where base strands and
 *             guides have a say
 * cholesky    [MOMENTS_COUNT][MOMENTS_COUNT] lower triangle
 * returns     GROOM_OK, GROOM_ENOMEM, GROOM_EINTERNAL (not positive definite: cannot be) */
GROOM_MUST_CHECK groom_status moments_covariance(float *values, uint32_t n_pairs, const uint32_t *bundle,
                                                 uint32_t n_bundles, const double size[MOMENTS_COUNT], double floor,
                                                 double *cholesky, const struct groom_context *context,
                                                 struct groom_diag *diag);

#endif
