/* Three doubles, by value. Geometry is decided in double; floats are for storage. */
#ifndef GEOMETRY_VEC_H
#define GEOMETRY_VEC_H

#include <math.h>

struct vec {
    double x, y, z;
};

static inline struct vec vec_of(const float p[3]) { return (struct vec){p[0], p[1], p[2]}; }
static inline struct vec vec_add(struct vec a, struct vec b) { return (struct vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline struct vec vec_sub(struct vec a, struct vec b) { return (struct vec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline struct vec vec_scale(struct vec a, double s) { return (struct vec){a.x * s, a.y * s, a.z * s}; }
static inline double vec_dot(struct vec a, struct vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double vec_length(struct vec a) { return sqrt(vec_dot(a, a)); }
static inline struct vec vec_cross(struct vec a, struct vec b)
{
    return (struct vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/* Zero stays zero. */
static inline struct vec vec_unit(struct vec a)
{
    double length = vec_length(a);
    return length > 0 ? vec_scale(a, 1 / length) : (struct vec){0, 0, 0};
}
static inline void vec_store(struct vec a, float out[3])
{
    out[0] = (float)a.x;
    out[1] = (float)a.y;
    out[2] = (float)a.z;
}

#endif
