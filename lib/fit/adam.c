#include "fit/adam.h"

#include <math.h>

#define FIRST 0.9
#define SECOND 0.999
#define EPSILON 1e-8

void adam_step(float *x, const float *gradient, float *moments, uint32_t n, double learning_rate, uint32_t step)
{
    double first = 1 - pow(FIRST, step), second = 1 - pow(SECOND, step);
    float *m = moments, *v = moments + n;
    for (uint32_t i = 0; i < n; i++) {
        double g = (double)gradient[i];
        m[i] = (float)(FIRST * (double)m[i] + (1 - FIRST) * g);
        v[i] = (float)(SECOND * (double)v[i] + (1 - SECOND) * g * g);
        x[i] = (float)((double)x[i] - learning_rate * ((double)m[i] / first) / (sqrt((double)v[i] / second) + EPSILON));
    }
}
