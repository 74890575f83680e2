/* Searches for the random numbers that bring strands nearest to their targets.
 *
 * A strand's problem is tiny and bounded: one number in [0, 1] or [-1, 1] for each operator. So a number is
 * not descended but looked for: its whole range on a grid, then ever closer around the best. Strands stand
 * side by side in the lanes of the model's own kernels; what comes before the operator in question is
 * evaluated once. */
#ifndef FIT_RANDOM_SEARCH_H
#define FIT_RANDOM_SEARCH_H

#include "fit/state.h"
#include "fit/strand_error.h"
#include "model/plan.h"

struct random_search_memory;

struct random_search {
    struct groom_fit *fit;
    struct plan plan;
    uint32_t leave_out; /* bits of active operators that are taken as not there */
    struct strand_error_weights weights;
    int out_of_head; /* whether all that is in the head costs, or what is deeper in it than the target */
    const uint32_t *only; /* strands that `first` and `count` below go along, borrowed; NULL: all */
    uint32_t n_threads;
    struct random_search_memory *memory; /* [n_threads] */
    const struct groom_allocator *allocator;
};

/* Of the fit's groom as it stands. returns GROOM_OK, GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status random_search_init(struct random_search *search, struct groom_fit *fit,
                                                 const struct groom_context *context, struct groom_diag *diag);
void random_search_finish(struct random_search *search);

/* Both write the groom's random numbers in place; same bits for any pool. active: of the plan. */

/* The number of strands first .. first + count - 1 in an operator that draws one a strand.
 * n_grid   values over the whole range that are tried, besides the present one
 * n_halvings  how often the step is then halved: around the best, and where the error is rugged, whose deepest valley
 *          values may well stand beside, around the best few of those that are better than their neighbours */
void random_search_strands(struct random_search *search, uint32_t active, uint32_t first, uint32_t count,
                           uint32_t n_grid, uint32_t n_halvings, const struct groom_context *context);

/* All numbers of these strands, operator by operator along the chain.
 * n_rugged   values of a number that the error is rugged in, which frizz's is */
void random_search_numbers(struct random_search *search, uint32_t first, uint32_t count, uint32_t n_grid, uint32_t n_rugged,
                           uint32_t n_halvings, const struct groom_context *context);

/* The two numbers of operator guides first .. first + count - 1 in a curl: what is best for their strands
 * together.
 * member   [n] strands by operator guide, `begin` [n_gop + 1] where each guide's begin
 * n_strands   of a guide that are asked at most, spread over all it has
 * whole    whether the whole range is looked at, or the surroundings of what there is
 * scale    an active operator before the curl that scales strands, or UINT32_MAX. What a strand is long and
 *          how often it winds are known together only: of the whole range, strands are given the lengths
 *          of their targets for each frequency; else frequency, phase and the common length of a guide's strands
 *          take Newton's steps together, and the scale's numbers are written, too */
struct random_search_groups {
    const uint32_t *member, *begin;
    uint32_t n_strands;
    int whole;
    uint32_t scale;
};
void random_search_curls(struct random_search *search, uint32_t active, uint32_t first, uint32_t count,
                         const struct random_search_groups *groups, const struct groom_context *context);

/* The first number of operator guides all over the head, looked for around what it has by one half of the strands that
 * are asked alone, and by the other; NAN for other guides, and where a half has none.
 * half  [n_gop][2] out */
void random_search_halves(struct random_search *search, uint32_t active, const struct random_search_groups *groups,
                          float (*half)[2], const struct groom_context *context);

/* Which operator guide strands first .. first + count - 1 follow: of those near them, the one with which
 * they come nearest to their targets.
 * candidate  [count][n_candidates] operator guides that some strand follows, UINT32_MAX: none
 * gain       share of the error that another one must be better than the present one by */
void random_search_guides(struct random_search *search, uint32_t first, uint32_t count, const uint32_t *candidate,
                          uint32_t n_candidates, float gain, const struct groom_context *context);

/* error [count] of strands 0 .. count - 1 as they stand. */
void random_search_errors(struct random_search *search, uint32_t count, float *error, const struct groom_context *context);

/* Other guides for strands 0 .. count - 1: the one with which alone they come nearest to their targets, then
 * the next, as many as strands have, at no weight.
 * candidate  [count][n_candidates] guides, UINT32_MAX: none; the first of each is one
 * skip       how many of the best are passed over, RANDOM_SEARCH_SKIP at most */
#define RANDOM_SEARCH_SKIP 16
void random_search_instances(struct random_search *search, uint32_t count, const uint32_t *candidate, uint32_t n_candidates,
                             uint32_t skip, const struct groom_context *context);

/* All numbers of strands first .. first + count - 1 at once, and, where it is wanted, their instancing weights:
 * Newton's steps on their errors, from where they are. Weights stay at least 0 and sum to 1.
 * n_steps  at most
 * hold     what moving a weight by 1 costs, squared
 * weights  whether they are moved */
void random_search_polish(struct random_search *search, uint32_t first, uint32_t count, uint32_t n_steps, float hold,
                          int weights, const struct groom_context *context);

#endif
