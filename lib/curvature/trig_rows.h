/* The functions of element.h for many angles, four at a time. */
#ifndef CURVATURE_TRIG_ROWS_H
#define CURVATURE_TRIG_ROWS_H

#include <stdint.h>

struct trig_rows {
    double *x, *A, *B, *C, *B1, *C1; /* of a multiple of four numbers, aligned to 32 bytes */
};

/* Fill all from x[0..n-1]; up to three numbers beyond n are written too, and x is read there. */
typedef void trig_rows_function(const struct trig_rows *rows, uint32_t n);
trig_rows_function trig_rows;
/* The same, per instruction set; every variant gives the same bits. */
trig_rows_function trig_rows_generic, trig_rows_avx2;

#endif
