/* Short forms of the context's progress callbacks; all take a NULL context. */
#ifndef BASE_PROGRESS_H
#define BASE_PROGRESS_H

#include <stdint.h>

#include "groom/context.h"

void progress_report(const struct groom_context *context, double fraction);
void progress_loss(const struct groom_context *context, const char *name, uint64_t iteration, double value);
int progress_cancelled(const struct groom_context *context);

#endif
