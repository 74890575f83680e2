#define REFINE_FIT refine_fit_generic
#define REFINE_TRIG trig_rows_generic
#include "curvature/refine_kernel.h"
