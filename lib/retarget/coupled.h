/* The system behind coupled.c: strands that pull on each other, and conjugate gradients on it. */
#ifndef RETARGET_COUPLED_H
#define RETARGET_COUPLED_H

#include "retarget/links.h"

enum coupled_state { COUPLED_FREE, COUPLED_KNOWN, COUPLED_ACTIVE, COUPLED_FIXED };

/* The matrix A of Eq. 1 with the lengths of segments held: shape's tridiagonal and K of links.h. Unknown is the movement x; A x = b where no half-space holds. */
struct system {
    struct job *job;
    const struct coupled *hair;
    uint32_t n_pieces;
    struct links links;
    float *w;                         /* [n] of the segment from i to i + 1: 1 / length^2; 0 at tips */
    float *pivot;                     /* [n] of the tridiagonal preconditioner */
    float (*b)[3], (*x)[3], (*r)[3], (*d)[3], (*ad)[3], (*f)[3]; /* [n] */
    float *away;                      /* [n] the surface is so far from p at least */
    uint8_t *state;                   /* [n] */
    struct plane *plane;              /* [n] where state is KNOWN or ACTIVE */
    double *sums;                     /* [n_pieces] */
};

#define COUPLED_PIECE 32 /* strands */

/* A vector where half-spaces hold: 0 at roots, without its normal part at active particles. */
static inline void system_project(const struct system *s, uint32_t i, float v[3])
{
    if (s->state[i] == COUPLED_FIXED) {
        v[0] = v[1] = v[2] = 0;
    } else if (s->state[i] == COUPLED_ACTIVE) {
        const double *n = s->plane[i].normal;
        double along = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        for (int c = 0; c < 3; c++)
            v[c] = (float)(v[c] - along * n[c]);
    }
}

/* The strands of a piece: first and last + 1. */
static inline uint32_t system_piece_end(const struct system *s, uint32_t piece)
{
    uint32_t end = (piece + 1) * COUPLED_PIECE;
    return end < s->hair->n_strands ? end : s->hair->n_strands;
}

groom_status system_init(struct system *s, struct job *job, const struct coupled *hair, struct groom_diag *diag);
void system_finish(struct system *s);
/* out = A v. */
void system_apply(struct system *s, float (*v)[3], float (*out)[3]);
/* Lengths, matrix, preconditioner and b at p. */
void system_linearise(struct system *s);
/* Improves x until its error, in the norm of the preconditioner, is `share` of `scale`, or most_steps are over.
 * scale  0: of b itself
 * returns  that of b */
double system_solve(struct system *s, double scale, double share, uint32_t most_steps);

#endif
