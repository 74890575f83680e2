#include "quality/waves.h"

#include <math.h>
#include <stddef.h>

#define PI 3.14159265358979323846

uint32_t waves_count(uint32_t n) { return n / 2 + 1; }

void waves_fill(uint32_t n, uint32_t n_waves, float *waves)
{
    for (uint32_t k = 0; k < n_waves; k++)
        for (uint32_t j = 0; j < n; j++) {
            double angle = 2 * PI * (double)((uint64_t)k * j % n) / n;
            waves[(size_t)k * n + j] = (float)cos(angle);
            waves[(size_t)(n_waves + k) * n + j] = (float)sin(angle);
        }
}
