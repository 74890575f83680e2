/* What tests and benchmarks of stage `guides` share: captures with known guides, a fit stopped before
 * and after the stage, and how far its guides are from the truth's. */
#ifndef TESTS_SUPPORT_GUIDES_H
#define TESTS_SUPPORT_GUIDES_H

#include "fit/state.h"
#include "groom/sample.h"

struct groom_sample *guides_sample(groom_sample_style style, uint32_t n_strands, uint32_t n_vertices, uint64_t seed,
                                   const struct groom_context *context);

/* A fit that stands before its stage `stage`, or at its end where it has none of that name; ... */
struct groom_fit *guides_fit(const struct groom_sample *sample, const struct groom_fit_options *options,
                             const char *stage, const struct groom_context *context);
/* ... and gone on with. */
void guides_fit_on(struct groom_fit *fit, const char *stage, const struct groom_context *context);

/* All in metres, but where said. */
struct guides_quality {
    double guides;  /* mean distance, vertex by vertex, of each guide from the truth's instanced strand of its root */
    double strands; /* the same, of all instanced strands, without operators, from the truth's */
    double shapes;  /* of each vertex of a strand to the nearest point of the truth's strand */
    double loss, truth_loss; /* Eq. 7 a vertex, square metres */
    double ripple;  /* of the segment lengths of a guide: standard deviation over mean; the largest */
    double turn;    /* degrees between segments, the largest */
};
void guides_measure(const struct groom_fit *fit, const struct groom_sample *sample, struct guides_quality *quality);

#endif
