#include "fit/mean_curvature.h"

#include <math.h>
#include <stddef.h>

#define ROOT_PART 6 /* one of so many of a strand is left out */
#define APART 2     /* vertices, of which segments are made */

static double segment(const float a[3], const float b[3], double out[3])
{
    double square = 0;
    for (int c = 0; c < 3; c++) {
        out[c] = (double)b[c] - a[c];
        square += out[c] * out[c];
    }
    return sqrt(square);
}

/* At x[0], between the vertices around it; 0 where a segment has no length. */
static double curvature_at(const float (*x)[3])
{
    double a[3], b[3], before = segment(x[-APART], x[0], a), after = segment(x[0], x[APART], b), square = 0;
    if (!(before > 0 && after > 0))
        return 0;
    for (int c = 0; c < 3; c++)
        square += (b[c] / after - a[c] / before) * (b[c] / after - a[c] / before);
    return 2 * sqrt(square) / (before + after);
}

double mean_curvature(const float (*points)[3], uint32_t n, uint32_t m)
{
    uint32_t first = m / ROOT_PART + APART;
    double sum = 0;
    if (first + APART >= m)
        return 0;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = first; j + APART < m; j++)
            sum += curvature_at(points + (size_t)i * m + j);
    return n > 0 ? sum / ((double)n * (m - APART - first)) : 0;
}
