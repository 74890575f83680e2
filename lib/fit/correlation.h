/* Products of the columns of a matrix with each other, summed over its rows in one order, whatever the processor: what a fit
 * finds hangs on their rounding, and a BLAS rounds as the kernel does that it has for the machine. */
#ifndef FIT_CORRELATION_H
#define FIT_CORRELATION_H

#include <stdint.h>

#include "groom/context.h"
#include "model/kernel.h"

#define CORRELATION_ROWS 4     /* of the product, at a time: n is a multiple of it */
#define CORRELATION_COLUMNS 16 /* n at least */
#define CORRELATION_MOST 256   /* n at most */

/* out[f][g] = sum over i of values[i][f] values[i][g] for g <= f; what is above the diagonal is left as it is, or is the same.
 * values   [n_rows][n]
 * out      [n][n]
 * threads  same bits for any pool, and on any processor */
void correlation_of(const float *values, uint32_t n_rows, uint32_t n, float *out, const struct groom_context *context);
/* ... by the instructions of one variant, which this processor has to have. */
void correlation_with(enum kernel_variant variant, const float *values, uint32_t n_rows, uint32_t n, float *out,
                      const struct groom_context *context);

#endif
