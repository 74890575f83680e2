#include "fit/roughness.h"

#include <math.h>

#define PART 10 /* of so many of a guide, on either side, a share is taken */

static double third_difference(const double (*s)[3], int c) { return s[3][c] - 3 * s[2][c] + 3 * s[1][c] - s[0][c]; }

/* One guide at one vertex. A guide that has no neighbours keeps what it has. */
static void add_guide(const double (*shape)[3], uint32_t m, const struct sparse *laplacian, uint32_t g, uint32_t j, struct roughness *out)
{
    for (int c = 0; c < 3; c++) {
        double own = third_difference(shape + (size_t)g * m + j, c), strength = 0, others = 0;
        for (uint32_t at = laplacian->first[g]; at < laplacian->first[g + 1]; at++) {
            uint32_t other = laplacian->column[at];
            if (other == g)
                strength = laplacian->value[at][0];
            else
                others -= laplacian->value[at][0] * third_difference(shape + (size_t)other * m + j, c);
        }
        out->square += own * own;
        out->shared += own * (strength > 0 ? others / strength : own);
    }
}

void roughness_measure(const double (*shape)[3], uint32_t m, const struct sparse *laplacian, struct roughness *out)
{
    for (uint32_t j = 0; j + 3 < m; j++) {
        out[j] = (struct roughness){0, 0};
        for (uint32_t g = 0; g < laplacian->n; g++)
            add_guide(shape, m, laplacian, g, j, &out[j]);
    }
}

double roughness_share(const struct roughness *roughness, uint32_t m, uint32_t j)
{
    uint32_t begin = j > m / PART ? j - m / PART : 0;
    double square = 0, shared = 0;
    for (uint32_t i = begin; i + 3 < m && i <= j + m / PART; i++) {
        square += roughness[i].square;
        shared += roughness[i].shared;
    }
    return square > 0 ? fmin(fmax(shared / square, 0), 1) : 1;
}
