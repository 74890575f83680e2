#include "base/sort.h"

#include <stdlib.h>

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int compare_indices(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

void sort_floats(float *values, size_t n) { qsort(values, n, sizeof *values, compare_floats); }
void sort_doubles(double *values, size_t n) { qsort(values, n, sizeof *values, compare_doubles); }
void sort_indices(uint32_t *values, size_t n) { qsort(values, n, sizeof *values, compare_indices); }

float median_of_floats(float *values, size_t n)
{
    sort_floats(values, n);
    return n ? values[n / 2] : 0;
}

double median_of_doubles(double *values, size_t n)
{
    sort_doubles(values, n);
    return n ? values[n / 2] : 0;
}
