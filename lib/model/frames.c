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

static struct vec between(const float from[3], const float to[3])
{
    return (struct vec){(double)to[0] - from[0], (double)to[1] - from[1], (double)to[2] - from[2]};
}

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

static void add_difference(struct vec d, float from[3], float to[3])
{
    const double v[3] = {d.x, d.y, d.z};
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

LANES_INLINE struct curl_frame curl_frame_at(const float (*guide)[3], uint32_t m, uint32_t j)
{
    struct curl_frame f;
    uint32_t from, to;
    tangent_ends(m, j, &from, &to);
    f.tangent = direction_of(between(guide[from], guide[to]), &f.inverse_length);
    double x = f.tangent.x, y = f.tangent.y;
    f.inverse_level = fabs(x) + fabs(y) < NEAR_Z ? 0.0 : 1.0 / sqrt(x * x + y * y);
    f.normal = f.inverse_level > 0.0 ? times(f.inverse_level, (struct vec){y, -x, 0.0}) : (struct vec){1.0, 0.0, 0.0};
    f.binormal = cross(f.tangent, f.normal);
    return f;
}

void frames_curl(const float (*guide)[3], uint32_t m, float *frame)
{
    for (uint32_t j = 0; j < m; j++, frame += FRAME_WIDTH) {
        struct curl_frame f = curl_frame_at(guide, m, j);
        frame[0] = (float)f.normal.x;
        frame[1] = (float)f.normal.y;
        frame[2] = (float)f.binormal.x;
        frame[3] = (float)f.binormal.y;
        frame[4] = (float)f.binormal.z;
    }
}

void frames_curl_backward(const float (*guide)[3], uint32_t m, const float *d_frame, float (*d_guide)[3])
{
    for (uint32_t j = 0; j < m; j++, d_frame += FRAME_WIDTH) {
        struct curl_frame f = curl_frame_at(guide, m, j);
        struct vec d_binormal = {d_frame[2], d_frame[3], d_frame[4]};
        struct vec d_tangent = cross(f.normal, d_binormal);
        struct vec d_normal = plus((struct vec){d_frame[0], d_frame[1], 0.0}, cross(d_binormal, f.tangent));
        d_normal.z = 0.0; /* the normal stays level */
        struct vec d_level = direction_backward(f.normal, f.inverse_level, d_normal);
        d_tangent.y += d_level.x;
        d_tangent.x -= d_level.y;
        uint32_t from, to;
        tangent_ends(m, j, &from, &to);
        add_difference(direction_backward(f.tangent, f.inverse_length, d_tangent), d_guide[from], d_guide[to]);
    }
}

/* --- bend ------------------------------------------------------------------- */

struct bend_frame {
    struct vec e, auxiliary, v, w;
    double inverse_length, inverse_cross;
};

static struct bend_frame bend_frame_of(const float (*guide)[3])
{
    struct bend_frame f;
    f.e = direction_of(between(guide[0], guide[1]), &f.inverse_length);
    f.auxiliary = fabs(f.e.y) < NEAR_LEVEL ? (struct vec){0.0, 1.0, 0.0} : (struct vec){1.0, 0.0, 0.0};
    struct vec across = cross(f.e, f.auxiliary);
    f.v = direction_of(across, &f.inverse_cross);
    f.w = cross(f.e, f.v);
    return f;
}

void frames_bend(const float (*guide)[3], float *axis)
{
    struct bend_frame f = bend_frame_of(guide);
    const double values[AXIS_WIDTH] = {f.v.x, f.v.y, f.v.z, f.w.x, f.w.y, f.w.z};
    for (int i = 0; i < AXIS_WIDTH; i++)
        axis[i] = (float)values[i];
}

void frames_bend_backward(const float (*guide)[3], const float *d_axis, float (*d_guide)[3])
{
    struct bend_frame f = bend_frame_of(guide);
    struct vec d_v = {d_axis[0], d_axis[1], d_axis[2]}, d_w = {d_axis[3], d_axis[4], d_axis[5]};
    struct vec d_e = cross(f.v, d_w);
    d_v = plus(d_v, cross(d_w, f.e));
    d_e = plus(d_e, cross(f.auxiliary, direction_backward(f.v, f.inverse_cross, d_v)));
    add_difference(direction_backward(f.e, f.inverse_length, d_e), d_guide[0], d_guide[1]);
}
