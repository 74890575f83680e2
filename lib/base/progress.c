#include "base/progress.h"

static const struct groom_progress *progress_of(const struct groom_context *context)
{
    return context ? context->progress : NULL;
}

void progress_report(const struct groom_context *context, double fraction)
{
    const struct groom_progress *progress = progress_of(context);
    if (progress && progress->report)
        progress->report(progress->user, fraction);
}

void progress_loss(const struct groom_context *context, const char *name, uint64_t iteration, double value)
{
    const struct groom_progress *progress = progress_of(context);
    if (progress && progress->loss)
        progress->loss(progress->user, name, iteration, value);
}

int progress_cancelled(const struct groom_context *context)
{
    const struct groom_progress *progress = progress_of(context);
    return progress && progress->cancelled && progress->cancelled(progress->user);
}
