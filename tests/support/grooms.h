/* Random but plausible grooms for tests of the model. */
#ifndef SUPPORT_GROOMS_H
#define SUPPORT_GROOMS_H

#include "groom/groom.h"

/* A groom of this shape whose guides are smooth random curves of about 0.3 m on a sphere of 0.1 m,
 * instanced by distance, each strand with its nearest operator guide. No operators. Aborts on
 * error. */
struct groom *test_groom(struct groom_shape shape, uint64_t seed);

/* Append an operator with parameters drawn from sensible ranges. */
void test_append_operator(struct groom *groom, groom_operator_type type, uint64_t seed);

/* Axes for groom.axes: askew, and the file's by quarter turns. */
extern const float test_slanted_axes[3][3], test_quarter_axes[3][3];

/* All five, in the order of GROOM_OPERATOR_LIST. */
void test_append_all_operators(struct groom *groom, uint64_t seed);

#endif
