/* Walking along one super-helix, scalar: the state at a junction and the step over an element. */
#ifndef CURVATURE_CHAIN_H
#define CURVATURE_CHAIN_H

#include "curvature/element.h"
#include "groom/curvature.h"

/* Root point and frame, or those of any junction. */
struct chain_state {
    vec3 p;
    mat3 F;
};

/* One strand's numbers, wherever they live. */
struct chain {
    uint32_t n; /* elements, at least 1 */
    struct chain_state root;
    const double *length;    /* [n] */
    const double (*q)[3];    /* [n] */
};

CURVATURE_INLINE vec3 vec_of(const double a[3]) { return (vec3){a[0], a[1], a[2]}; }

CURVATURE_INLINE void vec_store(vec3 a, double out[3])
{
    out[0] = a.x, out[1] = a.y, out[2] = a.z;
}

CURVATURE_INLINE mat3 mat_of(double f[3][3]) { return (mat3){vec_of(f[0]), vec_of(f[1]), vec_of(f[2])}; }

CURVATURE_INLINE void mat_store(mat3 f, double out[3][3])
{
    vec_store(f.t, out[0]), vec_store(f.u, out[1]), vec_store(f.v, out[2]);
}

CURVATURE_INLINE struct chain chain_of(const struct groom_superhelices *h, uint32_t strand)
{
    uint32_t begin = h->first[strand];
    return (struct chain){.n = h->first[strand + 1] - begin,
                          .root = {vec_of(h->root[strand]), mat_of(h->frame[strand])},
                          .length = h->length + begin,
                          .q = (const double (*)[3])h->q + begin};
}

/* The state s along an element that begins at `at` (Eqs. 2 and 3). */
CURVATURE_INLINE struct chain_state chain_step(struct chain_state at, vec3 q, double s)
{
    vec3 theta = vec_scale(s, q);
    double x = vec_dot(theta, theta);
    trig3 f = trig3_of(x);
    vec3 chord = vec_scale(s, element_chord(f.B, f.C, x, theta));
    return (struct chain_state){vec_add(at.p, mat_vec(at.F, chord)),
                                mat_mul(at.F, element_turn(f.A, f.B, x, theta))};
}

/* Only the point. */
CURVATURE_INLINE vec3 chain_point(struct chain_state at, vec3 q, double s)
{
    vec3 theta = vec_scale(s, q);
    double x = vec_dot(theta, theta);
    trig3 f = trig3_of(x);
    return vec_add(at.p, mat_vec(at.F, vec_scale(s, element_chord(f.B, f.C, x, theta))));
}

/* A frame that has been multiplied a thousand times is no rotation any more: one step of
 * Gram-Schmidt, first order exact. */
CURVATURE_INLINE mat3 frame_mend(mat3 F)
{
    F.t = vec_scale(1.0 / sqrt(vec_dot(F.t, F.t)), F.t);
    F.u = vec_sub(F.u, vec_scale(vec_dot(F.t, F.u), F.t));
    F.u = vec_scale(1.0 / sqrt(vec_dot(F.u, F.u)), F.u);
    F.v = vec_cross(F.t, F.u);
    return F;
}

#endif
