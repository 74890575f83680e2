#include "fit/dense.h"

#include <math.h>
#include <stddef.h>

static double dot(const double *a, const double *b, uint32_t n)
{
    double sum = 0;
    for (uint32_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

int dense_cholesky(double *a, uint32_t n)
{
    for (uint32_t j = 0; j < n; j++) {
        double *row_j = a + (size_t)j * n;
        double pivot = row_j[j] - dot(row_j, row_j, j);
        if (!(pivot > 0) || !isfinite(pivot))
            return 0;
        row_j[j] = sqrt(pivot);
        for (uint32_t i = j + 1; i < n; i++) {
            double *row_i = a + (size_t)i * n;
            row_i[j] = (row_i[j] - dot(row_i, row_j, j)) / row_j[j];
        }
    }
    return 1;
}

void dense_forward(const double *l, uint32_t n, double *x)
{
    for (uint32_t i = 0; i < n; i++)
        x[i] = (x[i] - dot(l + (size_t)i * n, x, i)) / l[(size_t)i * n + i];
}

void dense_backward(const double *l, uint32_t n, double *x)
{
    for (uint32_t i = n; i-- > 0;) {
        for (uint32_t j = i + 1; j < n; j++)
            x[i] -= l[(size_t)j * n + i] * x[j];
        x[i] /= l[(size_t)i * n + i];
    }
}
