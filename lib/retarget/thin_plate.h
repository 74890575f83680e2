/* Thin-plate splines in the plane (Duchon 1977): for comparison with the membrane. */
#ifndef RETARGET_THIN_PLATE_H
#define RETARGET_THIN_PLATE_H

#include <stdint.h>

#include "groom/context.h"

struct thin_plate {
    uint32_t n;
    double (*centre)[2];      /* [n] */
    double (*coefficient)[2]; /* [n + 3]: of each centre, then of 1, u, v */
    const struct groom_allocator *allocator;
};

/* The spline that takes value[i] at centre[i]; centres differ.
 * returns  1; 0 where memory is out or the centres lie on a line; finish it in any case */
int thin_plate_init(struct thin_plate *spline, const double (*centre)[2], const double (*value)[2], uint32_t n,
                    const struct groom_allocator *allocator);
void thin_plate_finish(struct thin_plate *spline); /* takes what is zeroed */
void thin_plate_at(const struct thin_plate *spline, const double u[2], double value[2]);

#endif
