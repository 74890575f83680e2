/* Nonlinear conjugate gradients on Eq. 1 for many strands at once.
 *
 * Section 4.6 holds the lengths of segments during an iteration and solves for all particles; with strands that
 * pull on each other that is a system of millions of unknowns, solved a dozen times over, and each solution is
 * thrown away for the next lengths. Here every step of conjugate gradients sees the lengths as they are: what is
 * quadratic (K of links.h) is carried along and costs one product a step, what is not concerns a strand alone and
 * is worked out anew while the strand is in the cache. Lengths are free to change, as Eq. 7 has it, and a handful
 * of steps gets below what the iterations with held lengths reach.
 *
 * A particle that comes through its half-space (Eq. 13) is put back on the plane and slides on it until it is
 * pulled off. The preconditioner is the exact solution for each strand with its neighbours held: tridiagonal, and
 * block-tridiagonal where some of its particles slide. */
#ifndef RETARGET_DESCENT_H
#define RETARGET_DESCENT_H

#include "retarget/links.h"
#include "retarget/strand.h"

#define DESCENT_PIECE 32 /* strands */

/* A segment as Eq. 7 sees it. */
struct segment {
    quad along, rest;   /* unit, now and on the source; or 0 */
    float least;        /* metres: a shorter one counts as this long */
    float length, inverse; /* 1 / length, of a length that is not too short */
    int free;           /* to change its length */
};

/* What a thread needs while it is at a strand. */
struct descent_scratch {
    float *w, *pivot;         /* [longest] the strand's tridiagonal: 1 / length^2; Thomas's pivots */
    struct strand sliding;    /* where particles slide */
};

enum contact { CONTACT_FREE, CONTACT_KNOWN, CONTACT_SLIDES, CONTACT_ROOT };

/* What a pass adds up over a piece of the hair. */
struct descent_sums {
    double product;   /* of the vectors that the pass looks at */
    double change;    /* (r - last r) . z */
    double linear;    /* by how much the quadratic part of the energy fell */
    double movement;  /* metres */
    double shape, body; /* energies */
    uint32_t n_put_back;
};

struct descent {
    struct job *job;
    const struct coupled *hair;
    struct links links;
    uint32_t n_pieces;
    float along, turn;      /* p += along d; d = z + turn d */
    float (*q)[3];          /* [n] -1/2 gradient of the quadratic part */
    float (*r)[3];          /* [n] ... of all, without what half-spaces take */
    float (*z)[3];          /* [n] the preconditioner's answer to r; G L d between */
    float (*d)[3];          /* [n] the direction */
    float (*kd)[3];         /* [n] K d; how far a particle was put back, between */
    float *away;            /* [n] free: the surface is so far from p at least; else how far it may go before its plane is found anew */
    uint8_t *contact;       /* [n] enum contact */
    uint8_t *put_back;      /* [n] in this step */
    quad *plane;            /* [n] but of free ones: normal and level; outside is normal . p >= level */
    struct segment *segments; /* [n] of one strand by itself; NULL where there are many: made when they are needed */
    struct descent_scratch *scratch; /* [threads] */
    struct descent_sums *sums; /* [n_pieces] */
};

/* Contacts that come and go make the last direction look better than it is. */
#define DESCENT_MOST_TURN 1

/* All but links, for n particles. returns 0 where memory is out */
int descent_allocate(struct descent *s, uint32_t n, uint32_t n_threads);
void descent_release(struct descent *s, uint32_t n, uint32_t n_threads);

/* --- passes (descent_passes.c), each over all particles ------------------------------- */

/* Half-spaces at p; what is inside is put on its plane. Then q, r, z and the energies. sums: shape, body, product r . z */
void descent_begin(struct descent *s);
/* d = z + turn d. sums: product r . d */
void descent_turn(struct descent *s);
/* kd = K d. sums: product d . H d, where H has the shape's curvature, too */
void descent_curve(struct descent *s);
/* p and q a step on; contacts. sums: linear, movement */
void descent_move(struct descent *s);
/* r and z at p. sums: product r . z, change, shape, body */
void descent_force(struct descent *s);

/* sums of all pieces, in their order. */
struct descent_sums descent_total(const struct descent *s);

/* --- the same of one strand, particles first to end - 1; thread: whose scratch it may use --------- */

/* segments: what is of the source */
void descent_rest_strand(struct descent *s, uint32_t first, uint32_t end);
/* Half-spaces at p; what is inside is put on its plane. returns how many were, kd says how far */
uint32_t descent_place_strand(struct descent *s, uint32_t first, uint32_t end);
void descent_turn_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums);
/* The shape's part of d . H d at the segment from i to i + 1. */
double descent_bend(const struct descent *s, uint32_t i);
/* What was put back is not yet in q. */
void descent_move_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums);
void descent_force_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums);

/* --- one strand by itself (descent_strand.c) -------------------------------------------------- */

/* Strands of up to `longest` particles, which pull on no other: K is its diagonal. One a thread.
 * returns  0 where memory is out */
int descent_strand_init(struct descent *s, struct coupled *strand, struct job *job, uint32_t longest);
void descent_strand_finish(struct descent *s, struct coupled *strand, uint32_t longest); /* takes {0}, {0} */
/* From p on, with rest, links.diagonal and q (at p) filled in; hat is not looked at.
 * returns  how many steps it took */
uint32_t descent_strand_solve(struct descent *s, uint32_t n);

#endif
