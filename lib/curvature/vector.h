/* 3-vectors and 3x3 matrices over `real`, which the including file defines first: a double, or
 * `struct`-free lanes of doubles (curvature/lanes.h) that carry one strand each. The same text
 * gives the scalar and the vectorised kernels. */
#ifndef CURVATURE_VECTOR_H
#define CURVATURE_VECTOR_H

#ifndef CURVATURE_LANES_H
typedef double real;
#endif

#define CURVATURE_INLINE static inline __attribute__((always_inline, unused))

typedef struct {
    real x, y, z;
} vec3;

/* Columns. A material frame has its tangent t and the two directions u, v of its cross-section. */
typedef struct {
    vec3 t, u, v;
} mat3;

CURVATURE_INLINE vec3 vec_add(vec3 a, vec3 b) { return (vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
CURVATURE_INLINE vec3 vec_sub(vec3 a, vec3 b) { return (vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
CURVATURE_INLINE vec3 vec_scale(real s, vec3 a) { return (vec3){s * a.x, s * a.y, s * a.z}; }
CURVATURE_INLINE real vec_dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

CURVATURE_INLINE vec3 vec_cross(vec3 a, vec3 b)
{
    return (vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

CURVATURE_INLINE mat3 mat_add(mat3 a, mat3 b)
{
    return (mat3){vec_add(a.t, b.t), vec_add(a.u, b.u), vec_add(a.v, b.v)};
}

CURVATURE_INLINE mat3 mat_scale(real s, mat3 a)
{
    return (mat3){vec_scale(s, a.t), vec_scale(s, a.u), vec_scale(s, a.v)};
}

/* m a */
CURVATURE_INLINE vec3 mat_vec(mat3 m, vec3 a)
{
    return vec_add(vec_add(vec_scale(a.x, m.t), vec_scale(a.y, m.u)), vec_scale(a.z, m.v));
}

/* m^T a */
CURVATURE_INLINE vec3 mat_transposed_vec(mat3 m, vec3 a)
{
    return (vec3){vec_dot(m.t, a), vec_dot(m.u, a), vec_dot(m.v, a)};
}

CURVATURE_INLINE mat3 mat_mul(mat3 a, mat3 b)
{
    return (mat3){mat_vec(a, b.t), mat_vec(a, b.u), mat_vec(a, b.v)};
}

/* [a]x m */
CURVATURE_INLINE mat3 cross_mat(vec3 a, mat3 m)
{
    return (mat3){vec_cross(a, m.t), vec_cross(a, m.u), vec_cross(a, m.v)};
}

#endif
