#include "curvature/centre.h"

#include <math.h>
#include <string.h>

void centre_wave(uint32_t n, double *wave)
{
    uint32_t m = n - 1;
    for (uint32_t i = 0; i < m; i++) {
        wave[2 * i] = cos(2.0 * M_PI * i / m);
        wave[2 * i + 1] = sin(2.0 * M_PI * i / m);
    }
}

/* One bin and its mirror image: centre[i + 1] gets the bin's part of segment i. */
static void add_bin(const double (*points)[3], uint32_t m, uint32_t bin, const double *wave, double (*centre)[3])
{
    double re[3] = {0.0, 0.0, 0.0}, im[3] = {0.0, 0.0, 0.0};
    int alone = bin == 0 || 2 * bin == m;
    for (uint32_t i = 0; i < m; i++) {
        const double *w = wave + 2 * ((uint64_t)bin * i % m);
        for (int c = 0; c < 3; c++) {
            double segment = points[i + 1][c] - points[i][c];
            re[c] += segment * w[0];
            im[c] += segment * w[1];
        }
    }
    for (uint32_t i = 0; i < m; i++) {
        const double *w = wave + 2 * ((uint64_t)bin * i % m);
        for (int c = 0; c < 3; c++)
            centre[i + 1][c] += (re[c] * w[0] + im[c] * w[1]) * (alone ? 1.0 : 2.0) / m;
    }
}

void centre_curve(const double (*points)[3], uint32_t n, uint32_t n_bins, const double *wave, double (*centre)[3])
{
    double offset[3] = {0.0, 0.0, 0.0};
    memset(centre, 0, n * sizeof *centre);
    for (uint32_t bin = 0; bin < n_bins && 2 * bin <= n - 1; bin++)
        add_bin(points, n - 1, bin, wave, centre);
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++) {
            centre[i][c] += i ? centre[i - 1][c] : 0.0;
            offset[c] += (points[i][c] - centre[i][c]) / n;
        }
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            centre[i][c] += offset[c];
}
