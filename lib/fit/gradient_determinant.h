/* Eqs. 13 to 18 of Chang et al. 2025 and their gradients, for the paper's own method: the strand correlation
 * losses. */
#ifndef FIT_GRADIENT_DETERMINANT_H
#define FIT_GRADIENT_DETERMINANT_H

#include "fit/state.h"

enum gradient_determinant_kind { GRADIENT_SCALE, GRADIENT_CLUMP };

struct gradient_determinant;

/* Of a fit's target and its options' widths and batches. The fit is borrowed.
 * returns  GROOM_OK, GROOM_ENOMEM. Owned by the caller */
GROOM_MUST_CHECK groom_status gradient_determinant_create(const struct groom_fit *fit, enum gradient_determinant_kind kind,
                                                          const struct groom_context *context,
                                                          struct gradient_determinant **gradient, struct groom_diag *diag);
void gradient_determinant_destroy(struct gradient_determinant *gradient); /* takes NULL */

/* The loss of n_batches batches, which are drawn anew for each iteration, and what it changes by with the
 * operators' parameters.
 * out      made for the fit's groom; overwritten: its parameters hold the gradient at the end
 * returns  GROOM_OK, GROOM_ENOMEM
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status gradient_determinant_evaluate(struct gradient_determinant *gradient, uint32_t iteration,
                                                            uint32_t n_batches, struct groom_gradient *out, double *loss,
                                                            const struct groom_context *context, struct groom_diag *diag);

/* Strands of a batch: |B_K| of Section 6. */
uint32_t gradient_determinant_batch(const struct groom_fit *fit);

#endif
