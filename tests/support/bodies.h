/* Bodies for tests: the sample's head, those below ../shared, and the same with other proportions. */
#ifndef SUPPORT_BODIES_H
#define SUPPORT_BODIES_H

#include "groom/mesh.h"

/* The head of the built-in sample, with texture coordinates. Aborts where memory is out. */
struct groom_mesh *bodies_sample_head(void);
/* A file below ../shared/data; NULL where it is not there. A check that fails where it cannot be read.
 * group  of an OBJ, or NULL: all */
struct groom_mesh *bodies_shared(const char *relative, double unit_m, groom_up up, const char *group);

/* A copy that is taller, wider at the jaw and flatter at the back by `amount` (1: a clearly different person),
 * smoothly so. Aborts where memory is out. */
struct groom_mesh *bodies_reshaped(const struct groom_mesh *mesh, double amount);
struct groom_mesh *bodies_copy(const struct groom_mesh *mesh);

#endif
