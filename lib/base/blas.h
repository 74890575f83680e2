/* OpenBLAS, one thread: our own pool cuts the work into fixed pieces, so that the pieces, and with
 * them the bits, do not depend on the machine's number of processors. */
#ifndef BASE_BLAS_H
#define BASE_BLAS_H

#include "groom/context.h"
#include "groom/diag.h"

/* Before the first product of a call, outside of its parallel loops. Sets OpenBLAS's threads to 1 for the whole
 * process, and has it take the work space of as many threads as the context's pool has: a product in a process
 * whose memory has run out (ulimit -v) would not fail but look for memory for ever.
 * returns  GROOM_ENOMEM
 * threads  any */
GROOM_MUST_CHECK groom_status blas_prepare(const struct groom_context *context, struct groom_diag *diag);

#endif
