/* The discrete Fourier transform of segments as a matrix: for products of many rows at once. */
#ifndef QUALITY_WAVES_H
#define QUALITY_WAVES_H

#include <stdint.h>

/* Waves of n segments: n / 2 + 1, the one-sided transform. */
uint32_t waves_count(uint32_t n);

/* waves [2 n_waves][n]: cosines of waves 0 .. n_waves-1, then their sines. */
void waves_fill(uint32_t n, uint32_t n_waves, float *waves);

#endif
