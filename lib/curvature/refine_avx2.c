/* The same text for processors with AVX2; refine.c chooses. */
#if defined(__x86_64__) && defined(__GNUC__)
#pragma GCC target("avx2")
#define REFINE_FIT refine_fit_avx2
#define REFINE_TRIG trig_rows_avx2
#include "curvature/refine_kernel.h"
#endif
