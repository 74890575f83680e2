/* Super-helices for tests: the shared vectors, random coils, and one strand by hand. */
#ifndef SUPPORT_SUPERHELIX_H
#define SUPPORT_SUPERHELIX_H

#include <stddef.h>
#include <stdint.h>

#include "groom/curvature.h"

struct cJSON;

/* ../shared/vectors/NAME parsed, or NULL and a line that says what is skipped. cJSON_Delete it. */
struct cJSON *vectors_load(const char *name);
/* The member `name` of an object; fails the test where it is missing. */
const struct cJSON *vectors_get(const struct cJSON *object, const char *name);
double vectors_number(const struct cJSON *object, const char *name);
/* Numbers of a nested array, row by row, into out; fails the test unless there are exactly n. */
void vectors_read(const struct cJSON *array, double *out, size_t n);
size_t vectors_size(const struct cJSON *array);

/* One super-helix from a vector case: p0, F0_rows (columns t, u, v as rows of the matrix), q, l. */
struct groom_superhelices *superhelix_from_case(const struct cJSON *object);

/* Room for one strand of n elements with the identity frame at the origin. */
struct groom_superhelices *superhelix_straight(uint32_t n_elements, double length);

/* n_strands coils of n_elements, 0.2 m long: radius 4..12 mm, some 6 turns, curvatures that wander,
 * random roots and frames, and, where switchback is not 0, a flip of handedness in the middle. */
struct groom_superhelices *superhelix_coils(uint32_t n_strands, uint32_t n_elements, uint64_t seed,
                                            int switchback);

/* A random rotation. */
void random_frame(uint64_t seed, uint32_t index, double frame[3][3]);

#endif
