#define SCULPT_KERNEL sculpt_group_generic
#include "curvature/sculpt_kernel.h"
