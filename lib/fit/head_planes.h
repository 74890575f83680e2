/* The head as a strand sees it: the half-space that the surface nearest to a vertex leaves free, here and there along
 * the strand. Within a few millimetres, which is how far a fitted strand is from its target, it tells how deep in the
 * head a point is, for a dot product in place of a question to the mesh. */
#ifndef FIT_HEAD_PLANES_H
#define FIT_HEAD_PLANES_H

#include "fit/state.h"

/* A point p metres from the strand's root is normal . p + offset outside; all zero where the head is far off. */
struct head_plane { float normal[3], offset; };

/* How many planes a strand of m vertices has, */
static inline uint32_t head_planes_of(uint32_t m) { return (m + 2) / 4; }
/* and the vertex that each stands by: from the one next to the root, where hair is nearest to the head and planes are
 * close, to the tip. */
static inline uint32_t head_plane_vertex(uint32_t plane, uint32_t m)
{
    uint32_t last = head_planes_of(m) - 1;
    return last == 0 ? m - 1 : 1 + plane + plane * plane * (m - 2 - last) / (last * last);
}

/* points  [m] metres, the root first
 * reach   how far outside the head is far off
 * out     [head_planes_of(m)] */
void head_planes_find(const struct groom_bvh *head, const float (*points)[3], uint32_t m, float reach, struct head_plane *out);

/* Those of all targets: fills fit->head_plane, where there is a head.
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status head_planes_create(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag);

/* Metres outside the head, on an ordinary head, from which on it is far off. */
#define HEAD_REACH 0.01
/* Metres in such a head that are too deep for a strand to stay there. */
#define HEAD_TOO_DEEP 0.0005

#endif
