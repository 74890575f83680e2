/* Ruffling with numbers from elsewhere: what is done with a draw, apart from who draws it. */
#ifndef CURVATURE_RUFFLE_H
#define CURVATURE_RUFFLE_H

#include "groom/curvature.h"

enum ruffle_use {
    RUFFLE_CHANCE, /* below rho: the element is replaced */
    RUFFLE_DONOR   /* by which of its group's members with so many elements: floor of the number times their count */
};

/* Uniform numbers, 0 <= u < 1. Asked by any thread. */
struct ruffle_draws {
    double (*uniform)(void *user, uint32_t strand, uint32_t element, enum ruffle_use use);
    void *user;
};

/* As groom_superhelices_ruffle, which passes NULL: Philox (groom/random.h) under seed and stream. */
GROOM_MUST_CHECK groom_status ruffle_with(const struct groom_superhelices *helices,
                                          const struct groom_ruffle_options *options,
                                          const struct ruffle_draws *draws, const struct groom_context *context,
                                          struct groom_superhelices **ruffled, struct groom_diag *diag);

#endif
