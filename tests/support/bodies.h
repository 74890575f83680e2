/* Bodies of other proportions with the same triangles. */
#ifndef SUPPORT_BODIES_H
#define SUPPORT_BODIES_H

#include "groom/mesh.h"

/* A copy that is taller, wider at the jaw and flatter at the back by `amount` (1: a clearly different person),
 * smoothly so. Aborts where memory is out. */
struct groom_mesh *bodies_reshaped(const struct groom_mesh *mesh, double amount);
struct groom_mesh *bodies_copy(const struct groom_mesh *mesh);

#endif
