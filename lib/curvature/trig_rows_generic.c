#define TRIG_ROWS trig_rows_generic
#include "curvature/trig_rows_kernel.h"
