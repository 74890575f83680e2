/* What the stages do. */
#include "fit/state.h"

const struct fit_stage fit_stages[FIT_N_STAGES] = {
#define FIT_STAGE_ROW(name, weight) {#name, name##_step, name##_fraction, name##_sound, weight},
    FIT_STAGE_LIST(FIT_STAGE_ROW)
#undef FIT_STAGE_ROW
};
