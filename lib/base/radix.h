/* Sorting of floats, several times as fast as qsort. */
#ifndef BASE_RADIX_H
#define BASE_RADIX_H

#include <stdint.h>

/* Ascending; the same bits for any order of the input.
 * values  [n] no NANs
 * spare   [n] scratch */
void radix_sort_floats(float *values, float *spare, uint32_t n);

/* The order in which they stand ascending; equal ones by their place.
 * values        [n] no NANs; left alone
 * order, spare  [n] out: the low 32 bits are indices into values; scratch */
void radix_sort_order(const float *values, uint64_t *order, uint64_t *spare, uint32_t n);

#endif
