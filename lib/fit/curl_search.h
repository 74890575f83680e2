/* The search for the two numbers of an operator guide in a curl: what a look at their whole range (curl_look.c) and steps
 * from where they are (curl_steps.c) share. For the fit's own files; others use random_search.h. */
#ifndef FIT_CURL_SEARCH_H
#define FIT_CURL_SEARCH_H

#include "fit/random_block.h"

#define CURL_PERIOD (1.0f / 3.9f) /* of the second number: a whole turn */

struct curl_search {
    struct random_search *search;
    const struct random_search_groups *groups;
    uint32_t active;
    uint32_t part, n_parts; /* of a guide's strands, every n_parts-th is asked; all: 0 of 1 */
};

const struct groom_operator *curl_operator(const struct curl_search *curl);
/* Whether strands are scaled before they curl. */
int curl_is_scaled(const struct curl_search *curl);
double curl_guide_length(const struct curl_search *curl, uint32_t guide);

/* How many strands of a guide are asked, and which, from the i-th on. */
uint32_t curl_asked(const struct curl_search *curl, uint32_t guide);
struct block curl_block(const struct curl_search *curl, uint32_t guide, uint32_t i);

/* A second number turned back into its range by whole turns; it may be off it by a few. */
float curl_phase_in_range(float u);

/* These move u, the two numbers, to where the guide's strands that are asked come nearest to their targets together. */

/* On a grid of all they may be (`whole`), then twice on a closer one around the best. What a strand is long and how
 * often it winds are known together only: where strands are scaled, they are given the lengths of their targets for
 * each frequency, and the scale's numbers are left alone. */
void curl_look(const struct curl_search *curl, struct random_search_memory *memory, uint32_t guide, int whole, float u[2]);

/* By Newton's steps. stretch: where strands are scaled, what all of the guide's are longer by, so that they wind as
 * often; NULL: they stay as long as they are. Nothing of the groom is written. */
void curl_steps(const struct curl_search *curl, struct random_search_memory *memory, uint32_t guide, float u[2], float *stretch);

#endif
