/* The same text for processors with AVX2; spline.c chooses. */
#if defined(__x86_64__) && defined(__GNUC__)
#pragma GCC target("avx2")
#define SPLINE_ARCS spline_arcs_avx2
#define SPLINE_STATIONS spline_stations_avx2
#include "curvature/spline_rows_kernel.h"
#endif
