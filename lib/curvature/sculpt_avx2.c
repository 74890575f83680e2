/* The same text for processors with AVX2; sculpt.c chooses once. */
#if defined(__x86_64__) && defined(__GNUC__)
#pragma GCC target("avx2")
#define SCULPT_KERNEL sculpt_group_avx2
#include "curvature/sculpt_kernel.h"
#endif
