/* What the stages are called. */
#include <string.h>

#include "fit/state.h"

static const char *const names[FIT_N_STAGES] = {
#define FIT_STAGE_NAME(name, weight) #name,
    FIT_STAGE_LIST(FIT_STAGE_NAME)
#undef FIT_STAGE_NAME
};

const char *groom_fit_stage_name(uint32_t index) { return index < FIT_N_STAGES ? names[index] : NULL; }

int fit_has_stage(const char *name)
{
    for (uint32_t i = 0; i < FIT_N_STAGES; i++)
        if (strcmp(names[i], name) == 0)
            return 1;
    return 0;
}
