/* Gradients of losses that must see all strands before they can say what each has to do: strands are
 * evaluated first, then their points' gradient is played back through the chain. */
#ifndef FIT_REPLAY_H
#define FIT_REPLAY_H

#include <stdint.h>

#include "groom/groom.h"

/* Points of the strands in the order in which they are visited, [count][m][3]. */
struct replay { uint32_t m; float (*points)[3]; };

/* Keeps the points, and says that none should move. */
struct groom_adjoint replay_record(struct replay *replay);
/* Hands out the gradient that stands in them. */
struct groom_adjoint replay_play(struct replay *replay);

#endif
