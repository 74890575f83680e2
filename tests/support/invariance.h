/* The same hair another way: uploaded in another unit, with another axis up, turned. */
#ifndef TESTS_SUPPORT_INVARIANCE_H
#define TESTS_SUPPORT_INVARIANCE_H

#include "groom/io.h"
#include "groom/sample.h"

extern const double invariance_as_it_is[3][3], invariance_upright[3][3], invariance_slanted[3][3];

/* Strands and head as they come from files in this frame, which tell it: written in it, rounded there, and read. */
void invariance_upload(struct groom_sample *sample, struct groom_frame frame);

/* Strands and head turned, which nobody tells: rows are the new axes. */
void invariance_turn(struct groom_sample *sample, const double r[3][3]);
void invariance_turn_points(float (*x)[3], size_t n, const double r[3][3]);

/* By how much axes are turned against each other. */
double invariance_degrees(const double a[3][3], const double b[3][3]);

#endif
