#include "model/frames.h"

#include <math.h>

#include "model/kernel.h"

#define NEAR_Z 1e-4     /* |tau.x| + |tau.y| below this: the normal is (1, 0, 0) */
#define NEAR_LEVEL 0.1  /* |e.y| below this: the auxiliary direction is (0, 1, 0) */

struct vec {
    double x, y, z;
};

static struct vec cross(struct vec a, struct vec b)
{
    return (struct vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static double dot(struct vec a, struct vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static struct vec plus(struct vec a, struct vec b) { return (struct vec){a.x + b.x, a.y + b.y, a.z + b.z}; }

static struct vec times(double s, struct vec a) { return (struct vec){s * a.x, s * a.y, s * a.z}; }

/* --- axes ------------------------------------------------------------------ */

static struct vec axis_of(const float (*axes)[3], int i) { return (struct vec){axes[i][0], axes[i][1], axes[i][2]}; }

/* A vector of space as it lies along the axes. */
static struct vec along(const float (*axes)[3], struct vec v)
{
    return axes ? (struct vec){dot(axis_of(axes, 0), v), dot(axis_of(axes, 1), v), dot(axis_of(axes, 2), v)} : v;
}

/* ... and back. */
static struct vec in_space(const float (*axes)[3], struct vec v)
{
    return axes ? plus(plus(times(v.x, axis_of(axes, 0)), times(v.y, axis_of(axes, 1))), times(v.z, axis_of(axes, 2))) : v;
}

static struct vec between(const float (*axes)[3], const float from[3], const float to[3])
{
    return along(axes, (struct vec){(double)to[0] - from[0], (double)to[1] - from[1], (double)to[2] - from[2]});
}

static struct vec read_along(const float (*axes)[3], const float v[3]) { return along(axes, (struct vec){v[0], v[1], v[2]}); }

static void write_in_space(const float (*axes)[3], struct vec v, float out[3])
{
    struct vec w = in_space(axes, v);
    out[0] = (float)w.x;
    out[1] = (float)w.y;
    out[2] = (float)w.z;
}

/* --- directions ------------------------------------------------------------ */

/* Unit vector along v, and 1 / |v|; (0, 1, 0) and 0 where v has no length. */
static struct vec direction_of(struct vec v, double *inverse)
{
    double length = sqrt(dot(v, v));
    *inverse = length > (double)NO_LENGTH ? 1.0 / length : 0.0;
    return *inverse > 0.0 ? times(*inverse, v) : (struct vec){0.0, 1.0, 0.0};
}

/* Adjoint of v from that of its unit vector u. */
static struct vec direction_backward(struct vec u, double inverse, struct vec d_u)
{
    return times(inverse, plus(d_u, times(-dot(u, d_u), u)));
}

static void add_difference(const float (*axes)[3], struct vec d, float from[3], float to[3])
{
    struct vec w = in_space(axes, d);
    const double v[3] = {w.x, w.y, w.z};
    for (int c = 0; c < 3; c++) {
        to[c] += (float)v[c];
        from[c] -= (float)v[c];
    }
}

/* --- curl ------------------------------------------------------------------ */

/* Between which vertices the tangent at vertex j is taken. */
static void tangent_ends(uint32_t m, uint32_t j, uint32_t *from, uint32_t *to)
{
    *from = j == 0 ? 0 : j - 1;
    *to = j == m - 1 ? m - 1 : j + 1;
}

struct curl_frame {
    struct vec tangent, normal, binormal;
    double inverse_length; /* of the difference that the tangent comes from */
    double inverse_level;  /* 1 / |(tau.x, tau.y)|, 0 near +-z */
};

LANES_INLINE struct curl_frame curl_frame_at(const float (*guide)[3], uint32_t m, const float (*axes)[3], uint32_t j)
{
    struct curl_frame f;
    uint32_t from, to;
    tangent_ends(m, j, &from, &to);
    f.tangent = direction_of(between(axes, guide[from], guide[to]), &f.inverse_length);
    double x = f.tangent.x, y = f.tangent.y;
    f.inverse_level = fabs(x) + fabs(y) < NEAR_Z ? 0.0 : 1.0 / sqrt(x * x + y * y);
    f.normal = f.inverse_level > 0.0 ? times(f.inverse_level, (struct vec){y, -x, 0.0}) : (struct vec){1.0, 0.0, 0.0};
    f.binormal = cross(f.tangent, f.normal);
    return f;
}

void frames_curl(const float (*guide)[3], uint32_t m, const float (*axes)[3], float *frame)
{
    for (uint32_t j = 0; j < m; j++, frame += FRAME_WIDTH) {
        struct curl_frame f = curl_frame_at(guide, m, axes, j);
        write_in_space(axes, f.normal, frame);
        write_in_space(axes, f.binormal, frame + 3);
    }
}

void frames_curl_backward(const float (*guide)[3], uint32_t m, const float (*axes)[3], const float *d_frame, float (*d_guide)[3])
{
    for (uint32_t j = 0; j < m; j++, d_frame += FRAME_WIDTH) {
        struct curl_frame f = curl_frame_at(guide, m, axes, j);
        struct vec d_binormal = read_along(axes, d_frame + 3);
        struct vec d_tangent = cross(f.normal, d_binormal);
        struct vec d_normal = plus(read_along(axes, d_frame), cross(d_binormal, f.tangent));
        d_normal.z = 0.0; /* the normal stays level */
        struct vec d_level = direction_backward(f.normal, f.inverse_level, d_normal);
        d_tangent.y += d_level.x;
        d_tangent.x -= d_level.y;
        uint32_t from, to;
        tangent_ends(m, j, &from, &to);
        add_difference(axes, direction_backward(f.tangent, f.inverse_length, d_tangent), d_guide[from], d_guide[to]);
    }
}

/* --- bend ------------------------------------------------------------------- */

struct bend_frame {
    struct vec e, auxiliary, v, w;
    double inverse_length, inverse_cross;
};

static struct bend_frame bend_frame_of(const float (*guide)[3], const float (*axes)[3])
{
    struct bend_frame f;
    f.e = direction_of(between(axes, guide[0], guide[1]), &f.inverse_length);
    f.auxiliary = fabs(f.e.y) < NEAR_LEVEL ? (struct vec){0.0, 1.0, 0.0} : (struct vec){1.0, 0.0, 0.0};
    struct vec across = cross(f.e, f.auxiliary);
    f.v = direction_of(across, &f.inverse_cross);
    f.w = cross(f.e, f.v);
    return f;
}

void frames_bend(const float (*guide)[3], const float (*axes)[3], float *axis)
{
    struct bend_frame f = bend_frame_of(guide, axes);
    write_in_space(axes, f.v, axis);
    write_in_space(axes, f.w, axis + 3);
}

void frames_bend_backward(const float (*guide)[3], const float (*axes)[3], const float *d_axis, float (*d_guide)[3])
{
    struct bend_frame f = bend_frame_of(guide, axes);
    struct vec d_v = read_along(axes, d_axis), d_w = read_along(axes, d_axis + 3);
    struct vec d_e = cross(f.v, d_w);
    d_v = plus(d_v, cross(d_w, f.e));
    d_e = plus(d_e, cross(f.auxiliary, direction_backward(f.v, f.inverse_cross, d_v)));
    add_difference(axes, direction_backward(f.e, f.inverse_length, d_e), d_guide[0], d_guide[1]);
}
