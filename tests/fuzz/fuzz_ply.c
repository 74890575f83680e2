#include "tests/fuzz/strands_target.h"

FUZZ_STRANDS(GROOM_FORMAT_PLY)
