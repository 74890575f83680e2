/* The linear system whose solution is the guides: what their strands want, against smoothness along
 * each guide and across the scalp. */
#ifndef FIT_GUIDE_SYSTEM_H
#define FIT_GUIDE_SYSTEM_H

#include "fit/mean_strands.h"
#include "fit/sparse.h"

/* Minimise over shapes s (s_g0 = 0) and moves t of operator guides' roots, towards which strands close in,
 *     sum_i |E[x_i] - target_i|^2  +  nu sum_g,j along_j |s_g,j-1 - 3 s_gj + 3 s_g,j+1 - s_g,j+2|^2
 *                                  +  nu across sum_j |(L s_j)|^2  +  sum_gj hold_gj |s_gj - place_gj|^2
 * where nu = n / n_guides, so that the weights mean the same for any number of strands. Where vectors have a row for
 * each vertex, row 0 is t, of guides that are no operator guide 0; `hold` and `place` of row 0 are t's. */
struct guide_system {
    uint32_t n_guides, m;
    struct sparse matrix;     /* of the data: own shapes, own and clumped, clumped and own, clumped; across */
    double (*power)[3];       /* [m] rest^2, rest clump, clump^2 */
    double *along;            /* [m] of the third difference that begins at j, nu included */
    double *hold;             /* [n_guides * m] */
    double (*pull)[3];        /* [n_guides * m] right-hand side, `hold` included */
    double (*band)[4];        /* [n_guides * (m - 1)] Cholesky factor of each guide's own block: (j, j-3..j) */
    double *arrow;            /* [n_guides * m] of the root's move with it */
    double (*r)[3], (*z)[3], (*p)[3], (*q)[3]; /* [n_guides * m] of the solver */
    double *partial;          /* [n_guides] */
    const struct groom_allocator *allocator;
};

/* laplacian  [n_guides] rows; entry 0 counts
 * along      of all vertices, to begin with
 * returns    GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status guide_system_init(struct guide_system *system, const struct mean_strands *mean,
                                                const struct sparse *laplacian, double along, double across,
                                                const struct groom_context *context, struct groom_diag *diag);
void guide_system_finish(struct guide_system *system);

/* out = matrix * shape */
void guide_system_apply(struct guide_system *system, const double (*shape)[3], double (*out)[3],
                        const struct groom_context *context);

/* Conjugate gradients from `shape`, until the residual is `tolerance` of the right-hand side's norm.
 * The preconditioner solves for each guide alone, exactly. A cancelled context ends it early.
 * returns  how many iterations it took: most_iterations at most */
uint32_t guide_system_solve(struct guide_system *system, double (*shape)[3], double tolerance, uint32_t most_iterations,
                            const struct groom_context *context);

#endif
