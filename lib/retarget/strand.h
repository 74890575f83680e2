/* One strand by itself: the quadratic programme of Section 4.6, to its exact solution.
 *
 * Unknown is the movement d of each particle but the root. The matrix is tridiagonal and the same for x, y
 * and z: diagonal[i] d_i - w_(i-1) d_(i-1) - w_i d_(i+1) = force_i, subject to normal . d >= height where a
 * particle has a half-space. */
#ifndef RETARGET_STRAND_H
#define RETARGET_STRAND_H

#include "retarget/job.h"

enum plane_state { PLANE_UNKNOWN, PLANE_KNOWN, PLANE_ACTIVE };

struct strand {
    uint32_t n;
    double *w;            /* [n] of the segment from i to i + 1: 1 / length^2 */
    double *diagonal;     /* [n] */
    double (*force)[3];   /* [n] */
    double (*d)[3];       /* [n] the movement; the root's is 0 */
    double *pivot;        /* [n] scratch */
    double (*block)[9];   /* [n] scratch: S^-1 C of the block elimination */
    double (*middle)[3];  /* [n] scratch */
    struct plane *plane;  /* [n] */
    uint8_t *state;       /* [n] enum plane_state */
};

int strand_init(struct strand *strand, uint32_t longest, const struct groom_allocator *allocator);
void strand_finish(struct strand *strand, uint32_t longest, const struct groom_allocator *allocator); /* takes {0} */

/* d without half-spaces. */
void strand_solve(const struct strand *strand);
/* d with the half-spaces that are active as equations. */
void strand_solve_active(const struct strand *strand);
/* How hard an active half-space pushes; negative: it pulls and should let go. */
double strand_push(const struct strand *strand, uint32_t i);

#endif
