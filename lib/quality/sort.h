/* Sorting of floats, several times as fast as qsort. */
#ifndef QUALITY_SORT_H
#define QUALITY_SORT_H

#include <stdint.h>

/* Ascending; the same bits for any order of the input.
 * values  [n] no NANs
 * spare   [n] scratch */
void sort_floats(float *values, float *spare, uint32_t n);

#endif
