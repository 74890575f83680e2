/* Numbers in rising order, and the middle of them. */
#ifndef BASE_SORT_H
#define BASE_SORT_H

#include <stddef.h>
#include <stdint.h>

/* In place; no NAN is among them. Of many floats, base/radix.h is several times as fast. */
void sort_floats(float *values, size_t n);
void sort_doubles(double *values, size_t n);
void sort_indices(uint32_t *values, size_t n);

/* The median, of an even number the upper one of the two in the middle; 0 of none. Sorts the values. */
float median_of_floats(float *values, size_t n);
double median_of_doubles(double *values, size_t n);

#endif
