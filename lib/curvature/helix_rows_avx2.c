/* The same text for processors with AVX2; helix_rows.c chooses. */
#if defined(__x86_64__) && defined(__GNUC__)
#pragma GCC target("avx2")
#define HELIX_CHAIN helix_chain_avx2
#include "curvature/helix_rows_kernel.h"
#endif
