/* The table of cubics that evaluations take the frizz's noise from. */
#include "model/noise.h"

#include "base/parallel.h"

#define FIRST_BETWEEN 0.29289322 /* 1/2 -+ tan(pi/8)/2: Chebyshev's four points, stretched to the ends */
#define SECOND_BETWEEN 0.70710678

/* noise_value at cell + f. */
static double noise_at(uint32_t cell, double f)
{
    double low = noise_gradient(cell * NOISE_STEP), high = noise_gradient((cell + 1) * NOISE_STEP);
    double a = low * f, b = high * (f - 1.0);
    return a + NOISE_FADE(f) * (b - a);
}

/* epsilon at a place within a piece. */
static double epsilon_at(uint32_t piece, double f)
{
    const uint32_t coarse = NOISE_PIECES, fine = NOISE_PIECES / 2;
    return (2.0 / 3.0) * noise_at(piece / coarse, (piece % coarse + f) / coarse) +
           (2.0 / 9.0) * noise_at(piece / fine, (piece % fine + f) / fine);
}

/* Newton's divided differences through 0, p, q and 1, multiplied out. */
static void cubic_through(const double y[4], float cubic[4])
{
    const double p = FIRST_BETWEEN, q = SECOND_BETWEEN;
    double first = (y[1] - y[0]) / p, second = (y[2] - y[1]) / (q - p), third = (y[3] - y[2]) / (1.0 - q);
    double curve = (second - first) / q, next_curve = (third - second) / (1.0 - p), cube = next_curve - curve;
    cubic[0] = (float)y[0];
    cubic[1] = (float)(first - p * (curve - q * cube));
    cubic[2] = (float)(curve - (p + q) * cube);
    cubic[3] = (float)cube;
}

static float table[NOISE_TABLE][4];

static void fill(void)
{
    double end = epsilon_at(0, 0.0);
    for (uint32_t piece = 0; piece < NOISE_TABLE; piece++) {
        double y[4] = {end, epsilon_at(piece, FIRST_BETWEEN), epsilon_at(piece, SECOND_BETWEEN), epsilon_at(piece, 1.0)};
        cubic_through(y, table[piece]);
        end = y[3];
    }
}

const float (*noise_table(void))[4]
{
    static struct parallel_once once;
    parallel_once(&once, fill);
    return (const float(*)[4])table;
}
