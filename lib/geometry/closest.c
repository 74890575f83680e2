#include "geometry/bvh.h"

static void set(double weight[3], double a, double b, double c)
{
    weight[0] = a;
    weight[1] = b;
    weight[2] = c;
}

/* The place of p on the segment a b, 0..1. */
static double along(struct vec p, struct vec a, struct vec b)
{
    struct vec ab = vec_sub(b, a);
    double square = vec_dot(ab, ab);
    double t = square > 0 ? vec_dot(vec_sub(p, a), ab) / square : 0;
    return t < 0 ? 0 : t > 1 ? 1 : t;
}

static double squared_to(struct vec p, struct vec a, struct vec b, double t)
{
    struct vec d = vec_sub(p, vec_add(a, vec_scale(vec_sub(b, a), t)));
    return vec_dot(d, d);
}

/* A sliver too thin for areas is its three edges. */
static void closest_on_edges(struct vec p, const struct vec c[3], double weight[3])
{
    double best = INFINITY;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        double t = along(p, c[i], c[j]), d = squared_to(p, c[i], c[j], t);
        if (d < best) {
            best = d;
            set(weight, 0, 0, 0);
            weight[i] = 1 - t;
            weight[j] = t;
        }
    }
}

void closest_on_triangle(struct vec p, const struct vec c[3], double weight[3])
{
    struct vec ab = vec_sub(c[1], c[0]), ac = vec_sub(c[2], c[0]), n = vec_cross(ab, ac);
    double square = vec_dot(n, n);
    if (!(square > 1e-24 * vec_dot(ab, ab) * vec_dot(ac, ac))) {
        closest_on_edges(p, c, weight);
        return;
    }
    /* weights of the foot of the perpendicular; where one is negative, an edge is nearer */
    struct vec ap = vec_sub(p, c[0]);
    double v = vec_dot(vec_cross(ap, ac), n) / square, w = vec_dot(vec_cross(ab, ap), n) / square;
    if (v >= 0 && w >= 0 && v + w <= 1)
        set(weight, 1 - v - w, v, w);
    else
        closest_on_edges(p, c, weight);
}
