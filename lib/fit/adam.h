/* Adam (Kingma and Ba 2015) as PyTorch has it by default: moments 0.9 and 0.999, epsilon 1e-8. */
#ifndef FIT_ADAM_H
#define FIT_ADAM_H

#include <stdint.h>

/* One step of n numbers. moments [2 n]: first, then second; zeroes before the first step.
 * step  1 for the first one */
void adam_step(float *x, const float *gradient, float *moments, uint32_t n, double learning_rate, uint32_t step);

#endif
