/* The same text for processors with AVX2; refine.c chooses. */
#if defined(__x86_64__) && defined(__GNUC__)
#pragma GCC target("avx2")
#define TRIG_ROWS trig_rows_avx2
#include "curvature/trig_rows_kernel.h"
#endif
