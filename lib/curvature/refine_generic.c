#define REFINE_FIT refine_fit_generic
#include "curvature/refine_kernel.h"
