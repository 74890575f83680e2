#include "geometry/polygon.h"

#include <math.h>
#include <string.h>

/* Newell's normal: twice the area vector, exact for planar polygons and a mean for others. */
static void newell(const float (*points)[3], const uint32_t *corners, uint32_t n, double normal[3])
{
    memset(normal, 0, 3 * sizeof *normal);
    const float *o = points[corners[0]];
    for (uint32_t i = 0; i < n; i++) {
        const float *p = points[corners[i]], *q = points[corners[i + 1 < n ? i + 1 : 0]];
        double a[3] = {(double)p[0] - o[0], (double)p[1] - o[1], (double)p[2] - o[2]};
        double b[3] = {(double)q[0] - o[0], (double)q[1] - o[1], (double)q[2] - o[2]};
        normal[0] += a[1] * b[2] - a[2] * b[1];
        normal[1] += a[2] * b[0] - a[0] * b[2];
        normal[2] += a[0] * b[1] - a[1] * b[0];
    }
}

/* Drop the axis along which the normal is longest, keeping the turn counter-clockwise. */
static void flatten(const float (*points)[3], const uint32_t *corners, uint32_t n, const double normal[3],
                    double (*flat)[2])
{
    int drop = 0;
    for (int axis = 1; axis < 3; axis++)
        if (fabs(normal[axis]) > fabs(normal[drop]))
            drop = axis;
    int u = (drop + 1) % 3, v = (drop + 2) % 3;
    double sign = normal[drop] < 0 ? -1 : 1;
    for (uint32_t i = 0; i < n; i++) {
        flat[i][0] = points[corners[i]][u];
        flat[i][1] = points[corners[i]][v] * sign;
    }
}

/* Twice the signed area of a triangle: positive where it turns counter-clockwise. */
static double turn(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static double squared_distance(const float *a, const float *b)
{
    double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
    return x * x + y * y + z * z;
}

static void cut_quad(const float (*points)[3], const uint32_t *corners, double (*flat)[2], uint32_t (*out)[3])
{
    double *a = flat[0], *b = flat[1], *c = flat[2], *d = flat[3];
    int first = turn(a, b, c) > 0 && turn(a, c, d) > 0;
    int second = turn(b, c, d) > 0 && turn(b, d, a) > 0;
    int shorter = squared_distance(points[corners[0]], points[corners[2]]) <=
                  squared_distance(points[corners[1]], points[corners[3]]);
    static const uint32_t cut[2][2][3] = {{{0, 1, 3}, {1, 2, 3}}, {{0, 1, 2}, {0, 2, 3}}};
    memcpy(out, cut[first == second ? shorter : first], sizeof cut[0]);
}

static int is_convex(double (*flat)[2], uint32_t n)
{
    double winding = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t j = (i + 1) % n, k = (i + 2) % n;
        if (turn(flat[i], flat[j], flat[k]) < 0)
            return 0;
        winding += atan2(turn(flat[i], flat[j], flat[k]),
                         (flat[j][0] - flat[i][0]) * (flat[k][0] - flat[j][0]) +
                             (flat[j][1] - flat[i][1]) * (flat[k][1] - flat[j][1]));
    }
    return winding < 9.0; /* a star turns 4 pi though each corner turns left */
}

static void fan(uint32_t n, uint32_t (*out)[3])
{
    for (uint32_t i = 0; i + 2 < n; i++)
        memcpy(out[i], (uint32_t[3]){0, i + 1, i + 2}, sizeof out[i]);
}

/* Whether corner b, between a and c, can be cut off: a left turn with no other corner inside. */
static int is_ear(struct polygon_scratch *s, uint32_t a, uint32_t b, uint32_t c)
{
    const double *pa = s->flat[a], *pb = s->flat[b], *pc = s->flat[c];
    if (!(turn(pa, pb, pc) > 0))
        return 0;
    for (uint32_t i = s->next[c]; i != a; i = s->next[i]) {
        const double *p = s->flat[i];
        if (s->effort)
            s->effort--;
        if (memcmp(p, pa, sizeof s->flat[0]) == 0 || memcmp(p, pb, sizeof s->flat[0]) == 0 ||
            memcmp(p, pc, sizeof s->flat[0]) == 0)
            continue; /* the bridge to a hole names a place twice */
        if (turn(pa, pb, p) >= 0 && turn(pb, pc, p) >= 0 && turn(pc, pa, p) >= 0)
            return 0;
    }
    return 1;
}

static void clip_ears(uint32_t n, struct polygon_scratch *s, uint32_t (*out)[3])
{
    for (uint32_t i = 0; i < n; i++) {
        s->next[i] = i + 1 < n ? i + 1 : 0;
        s->previous[i] = i ? i - 1 : n - 1;
    }
    uint32_t at = 0, left = n, since_ear = 0, n_out = 0;
    while (left >= 3) {
        uint32_t a = s->previous[at], c = s->next[at];
        /* A polygon that crosses itself runs out of ears: then any corner goes. */
        int ear = left == 3 || since_ear >= left || s->effort == 0 || is_ear(s, a, at, c);
        if (ear) {
            memcpy(out[n_out++], (uint32_t[3]){a, at, c}, sizeof out[0]);
            s->next[a] = c;
            s->previous[c] = a;
            left--;
            since_ear = 0;
            at = s->next[c];
        } else {
            since_ear++;
            at = c;
        }
    }
}

void polygon_triangulate(const float (*points)[3], const uint32_t *corners, uint32_t n,
                         struct polygon_scratch *scratch, uint32_t (*out)[3])
{
    double normal[3];
    if (n == 3) {
        fan(n, out);
        return;
    }
    newell(points, corners, n, normal);
    flatten(points, corners, n, normal, scratch->flat);
    if (n == 4)
        cut_quad(points, corners, scratch->flat, out);
    else if (scratch->effort == 0 || is_convex(scratch->flat, n))
        fan(n, out);
    else
        clip_ears(n, scratch, out);
}
