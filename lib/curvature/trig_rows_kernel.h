/* The text that is compiled once per instruction set; TRIG_ROWS is the name of the function. */
#ifndef CURVATURE_TRIG_ROWS_KERNEL_H
#define CURVATURE_TRIG_ROWS_KERNEL_H

#include "curvature/lanes.h"

#include "curvature/element.h"
#include "curvature/trig_rows.h"

void TRIG_ROWS(const struct trig_rows *rows, uint32_t n)
{
    for (uint32_t i = 0; i < n; i += LANES) {
        trig5 f = trig5_of(*(const real *)(rows->x + i));
        *(real *)(rows->A + i) = f.A;
        *(real *)(rows->B + i) = f.B;
        *(real *)(rows->C + i) = f.C;
        *(real *)(rows->B1 + i) = f.B1;
        *(real *)(rows->C1 + i) = f.C1;
    }
}

#endif
