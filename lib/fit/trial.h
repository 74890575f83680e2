/* Parameters of a fit's operators that are tried: moved together until the statistics of strands agree with the target's. */
#ifndef FIT_TRIAL_H
#define FIT_TRIAL_H

#include "fit/matching.h"
#include "fit/state.h"

#define TRIAL_MOST_UNKNOWNS (GROOM_FIT_MAX_OPERATORS * GROOM_OPERATOR_MAX_PARAMETERS + 3)

/* A number that is fitted: sizes as logarithms, places along the strand as they are. */
struct unknown {
    float *value;
    double minimum, maximum, initial;
    int logarithmic;
    int frequency, random;
};
double trial_read(const struct unknown *unknown);
void trial_write(const struct unknown *unknown, double x); /* as near to it as its range lets it */

/* The fit's operators with parameters of their own. Unknowns point into it: it is copied by trial_copy alone. */
struct trial {
    struct groom_operator operators[GROOM_FIT_MAX_OPERATORS];
    double frame[3][3]; /* the fit's, */
    float turn[3];      /* and how far from it the axes are that they lean on: a rotation vector */
    struct unknown unknowns[TRIAL_MOST_UNKNOWNS];
    uint32_t n_operators, n_unknowns;
};

/* As the fit has them.
 * frequencies_known  those of curls, and how these differ, are no unknowns */
void trial_init(const struct groom_fit *fit, int frequencies_known, struct trial *trial);
/* Three unknowns more: the turn. */
void trial_let_turn(struct trial *trial);
/* As the fit has them, and the turn where its axes are but near. */
void trial_begin(const struct groom_fit *fit, int frequencies_known, struct trial *trial);
void trial_copy(const struct trial *from, struct trial *to);
/* Into the fit. */
void trial_keep(const struct trial *trial, struct groom_fit *fit);

/* From now on, by the mean of some draws of random numbers: matching_average. returns GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status trial_average(struct matching *matching, const struct trial *trial, const struct groom_context *context,
                                            struct groom_diag *diag);

/* Sum of the squares of matching_residual. returns GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED; *square is INFINITY then */
GROOM_MUST_CHECK groom_status trial_misfit(struct matching *matching, const struct trial *trial, double *square,
                                           const struct groom_context *context, struct groom_diag *diag);

/* Levenberg and Marquardt's steps: slopes at `here`, and up to n_steps by them, which move it.
 * both_sides  whether slopes are taken to both sides
 * least       share of the misfit that a step must gain
 * square      the misfit, out
 * ended       set where all of them gain less than that, out
 * returns     GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status trial_refine(struct matching *matching, struct trial *here, int both_sides, uint32_t n_steps,
                                           double least, double *square, int *ended, const struct groom_context *context,
                                           struct groom_diag *diag);

#endif
