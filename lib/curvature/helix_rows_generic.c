#define HELIX_CHAIN helix_chain_generic
#include "curvature/helix_rows_kernel.h"
