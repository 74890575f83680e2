#define SPLINE_ARCS spline_arcs_generic
#define SPLINE_STATIONS spline_stations_generic
#include "curvature/spline_rows_kernel.h"
