/* The paper's own optimizer (Shi et al. 2026, Section 6.5.1), as a reference for the solver: Adam,
 * step 0.001, moments 0.9 and 0.999, epsilon 1e-8; it ends after 4 000 steps, after 50 without any
 * improvement, or below an energy of 1e-6. Its numbers are meant for lengths in centimetres, so that is
 * what it works in, whatever the strand's unit. */
#ifndef SUPPORT_ADAM_H
#define SUPPORT_ADAM_H

#include "curvature/energy.h"

struct adam_result {
    double energy; /* the least met, in the problem's own unit squared */
    uint32_t steps;
};

/* Starts from problem->chain.q. unit_cm: how many centimetres a unit of the problem has (100 for metres). */
struct adam_result adam_sculpt(const struct sculpt_problem *problem, double unit_cm);

#endif
