/* The expectation of a strand over the random numbers of its operators (Chang et al. 2025, Section 5.4),
 * and the least squares in it.
 *
 * Scale, bend, curl and frizz keep a strand where it is on average; clump has no random numbers:
 *     E[x_ij] = rest_j (r_i + sum_k w_ik s_kj) + clump_j (r_h + s_hj),  s_gj = g_j - g_1,
 * with the strand's root r_i, its guides k, its operator guide h, and
 *     clump_j = 1 - rest_j = 1 - exp(-a v_j),  v_j = j / (m - 1),  a: all clumps' profiles.
 * The expectation is linear in the shapes s of the guides,
 * vertex by vertex and coordinate by coordinate. (A bend of 0.8 radians really takes 6 % of the length
 * away on average; that is left to the guides.)
 */
#ifndef FIT_MEAN_STRANDS_H
#define FIT_MEAN_STRANDS_H

#include "fit/state.h"

/* A guide's part in a strand: rest_j * shape + clump_j * clumped. */
struct mean_part { uint32_t guide; float shape, clumped; };

struct mean_strands {
    uint32_t n, m, n_guides, n_parts;
    const float (*target)[3];  /* [n * m], borrowed */
    float (*given)[3];         /* [n * m] what shapes must sum up to, or NULL: as follows from target and origin */
    struct mean_part *part;    /* [n][n_parts] */
    double (*origin)[3];       /* [n] root of the operator guide, in the target's frame */
    double *rest;              /* [m] */
    uint32_t *first;           /* [n_guides + 1] of each guide's strands in `member` */
    uint32_t *member;          /* [n * n_parts] i * n_parts + part, by guide, strands in order */
    const struct groom_allocator *allocator;
};

/* Of the fit's groom as it stands; only the roots of its guides are used, not their shapes.
 * returns GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status mean_strands_init(struct mean_strands *mean, const struct groom_fit *fit,
                                                const struct groom_context *context, struct groom_diag *diag);
/* The same of strands as they stand, random numbers and all, in place of their expectation: to first order
 * in the shapes of the guides around those that the groom has. Scales, clumps and weights are in it; that
 * curls and bends turn with the guides is not. Strands that are far from their targets weigh less. */
GROOM_MUST_CHECK groom_status mean_strands_init_known(struct mean_strands *mean, const struct groom_fit *fit,
                                                      const struct groom_context *context, struct groom_diag *diag);
void mean_strands_finish(struct mean_strands *mean);

/* Mean square distance of a vertex from its target (Eq. 7 over m), in the target's frame.
 * shape    [n_guides][m][3]; rows 0: how far the roots of operator guides are moved
 * partial  [pieces of mean_strands_pieces(n)] scratch */
double mean_strands_loss(const struct mean_strands *mean, const double (*shape)[3], double *partial,
                         const struct groom_context *context);
uint32_t mean_strands_pieces(uint32_t n);

/* What the strands would have the guides be, times their weights: right-hand side of the normal
 * equations. out [n_guides][m][3], rows 0: for the roots of operator guides */
void mean_strands_pull(const struct mean_strands *mean, double (*out)[3], const struct groom_context *context);

#endif
