/* The centre curve of a coil: its segment vectors without their fast turning (Wu et al. 2024). */
#ifndef CURVATURE_CENTRE_H
#define CURVATURE_CENTRE_H

#include <stdint.h>

/* Keep the lowest n_bins Fourier bins of the n - 1 segment vectors (the constant one counted), add them
 * up again, and put the curve's mean where the points' is.
 * points, centre  [n][3], n at least 2; may not overlap
 * wave            [2 (n - 1)] cos and sin of 2 pi i / (n - 1), from centre_wave */
void centre_curve(const double (*points)[3], uint32_t n, uint32_t n_bins, const double *wave, double (*centre)[3]);
void centre_wave(uint32_t n, double *wave);

#endif
