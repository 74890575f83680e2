#include "retarget/thin_plate.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

static double kernel(const double a[2], const double b[2])
{
    double squared = (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
    return squared > 0 ? 0.5 * squared * log(squared) : 0;
}

/* Gaussian elimination with row exchanges; x [n][2] the right-hand side and the solution. */
static int eliminate(double *a, double (*x)[2], uint32_t n)
{
    for (uint32_t k = 0; k < n; k++) {
        uint32_t pivot = k;
        for (uint32_t i = k + 1; i < n; i++)
            if (fabs(a[(size_t)i * n + k]) > fabs(a[(size_t)pivot * n + k]))
                pivot = i;
        if (!(fabs(a[(size_t)pivot * n + k]) > 1e-14))
            return 0;
        for (uint32_t j = 0; j < n && pivot != k; j++) {
            double swap = a[(size_t)k * n + j];
            a[(size_t)k * n + j] = a[(size_t)pivot * n + j];
            a[(size_t)pivot * n + j] = swap;
        }
        for (int c = 0; c < 2; c++) {
            double swap = x[k][c];
            x[k][c] = x[pivot][c];
            x[pivot][c] = swap;
        }
        for (uint32_t i = k + 1; i < n; i++) {
            double factor = a[(size_t)i * n + k] / a[(size_t)k * n + k];
            for (uint32_t j = k; j < n && factor != 0; j++)
                a[(size_t)i * n + j] -= factor * a[(size_t)k * n + j];
            for (int c = 0; c < 2; c++)
                x[i][c] -= factor * x[k][c];
        }
    }
    for (uint32_t k = n; k-- > 0;)
        for (int c = 0; c < 2; c++) {
            for (uint32_t j = k + 1; j < n; j++)
                x[k][c] -= a[(size_t)k * n + j] * x[j][c];
            x[k][c] /= a[(size_t)k * n + k];
        }
    return 1;
}

int thin_plate_init(struct thin_plate *spline, const double (*centre)[2], const double (*value)[2], uint32_t n,
                    const struct groom_allocator *allocator)
{
    uint32_t size = n + 3;
    *spline = (struct thin_plate){.n = n, .allocator = allocator};
    spline->centre = memory_array(allocator, n, sizeof *spline->centre);
    spline->coefficient = memory_array_zero(allocator, size, sizeof *spline->coefficient);
    double *a = memory_array_zero(allocator, (size_t)size * size, sizeof *a);
    int sound = spline->centre && spline->coefficient && a;
    if (sound) {
        memcpy(spline->centre, centre, n * sizeof *centre);
        memcpy(spline->coefficient, value, n * sizeof *value);
        for (uint32_t i = 0; i < n; i++) {
            const double tail[3] = {1, centre[i][0], centre[i][1]};
            for (uint32_t j = 0; j < n; j++)
                a[(size_t)i * size + j] = kernel(centre[i], centre[j]);
            for (uint32_t k = 0; k < 3; k++)
                a[(size_t)i * size + n + k] = a[(size_t)(n + k) * size + i] = tail[k];
        }
        sound = eliminate(a, spline->coefficient, size);
    }
    memory_release(allocator, a, (size_t)size * size, sizeof *a);
    return sound;
}

void thin_plate_finish(struct thin_plate *spline)
{
    if (!spline->allocator)
        return;
    memory_release(spline->allocator, spline->centre, spline->n, sizeof *spline->centre);
    memory_release(spline->allocator, spline->coefficient, (size_t)spline->n + 3, sizeof *spline->coefficient);
    *spline = (struct thin_plate){0};
}

void thin_plate_at(const struct thin_plate *spline, const double u[2], double value[2])
{
    for (int c = 0; c < 2; c++)
        value[c] = spline->coefficient[spline->n][c] + spline->coefficient[spline->n + 1][c] * u[0] + spline->coefficient[spline->n + 2][c] * u[1];
    for (uint32_t i = 0; i < spline->n; i++) {
        double k = kernel(u, spline->centre[i]);
        value[0] += spline->coefficient[i][0] * k;
        value[1] += spline->coefficient[i][1] * k;
    }
}
