#include "curvature/helix.h"

#include <math.h>

/* --- co-helical points --------------------------------------------------------------- */

/* With d_i = t_(i+1) - t_i, the constraints (p_(i+1) - p_i).d_i = 0 read A delta = -c, and the least
 * delta is A^T (A A^T)^-1 (-c); A A^T is tridiagonal: |d_i|^2 (1 or 2) and -d_i.d_(i+1).
 * Straight pairs (d = 0) constrain nothing: the ridge keeps their multiplier at 0. */
void helix_float_points(uint32_t n, vec3 *p, const vec3 *t, double *work)
{
    double *upper = work, *lambda = work + n;
    vec3 before = {0.0, 0.0, 0.0};
    for (uint32_t i = 0; i < n; i++) {
        vec3 d = vec_sub(t[i + 1], t[i]);
        vec3 next = i + 1 < n ? vec_sub(t[i + 2], t[i + 1]) : before;
        double low = i ? -vec_dot(before, d) : 0.0, square = vec_dot(d, d);
        double pivot = (i ? 2.0 : 1.0) * square + 1e-14 - (i ? low * upper[i - 1] : 0.0);
        double right = -vec_dot(vec_sub(p[i + 1], p[i]), d) - (i ? low * lambda[i - 1] : 0.0);
        upper[i] = i + 1 < n ? -vec_dot(d, next) / pivot : 0.0;
        lambda[i] = right / pivot;
        before = d;
    }
    for (uint32_t i = n - 1; i-- > 0;)
        lambda[i] -= upper[i] * lambda[i + 1];
    for (uint32_t i = 0; i < n; i++) { /* constraint i pulls its end by d and its begin by -d */
        vec3 pull = vec_scale(lambda[i], vec_sub(t[i + 1], t[i]));
        p[i + 1] = vec_add(p[i + 1], pull);
        if (i)
            p[i] = vec_sub(p[i], pull);
    }
}

/* --- one helix ------------------------------------------------------------------------ */

/* The pair in its symmetric frame: n along t0 - t1, m along t0 + t1, b = n x m; the chord lies in the
 * plane (m, b) at angle delta from m. The axis lies there too, at angle psi, and h is half the angle
 * turned: tan h = tan alpha / sin psi, where 2 alpha is the angle between the tangents.
 * Angles are kept as (cosine, sine): only h is ever taken as a number. */
struct pair {
    double sin_alpha, cos_alpha, sin_delta, cos_delta;
};

struct axis {
    double c, s;            /* of psi */
    double h, g;            /* half the angle turned; sin(alpha)/h */
    double ahead;           /* sin(psi - delta): the bracket (delta, delta + pi) is where it is positive */
    double value, slope;
};

/* The chord's direction as a function of psi, minus delta: f = -k sin(psi-delta) + g cos(psi-delta) with
 * k = cos(alpha) cos(psi). f > 0 at delta and < 0 at delta + pi. */
static void evaluate(const struct pair *k, struct axis *a)
{
    double along = k->cos_alpha * a->c, side = k->cos_alpha * a->s;
    double across = a->c * k->cos_delta + a->s * k->sin_delta; /* cos(psi - delta) */
    double square = k->sin_alpha * k->sin_alpha + side * side;
    a->ahead = a->s * k->cos_delta - a->c * k->sin_delta;
    a->h = atan2(k->sin_alpha, side);
    a->g = a->h > 1e-4 ? k->sin_alpha / a->h : sqrt(square) * (1.0 - a->h * a->h / 6.0);
    double g_slope = a->h > 1e-4 ? a->g * k->sin_alpha * along / (square * a->h) : along;
    a->value = -along * a->ahead + a->g * across;
    a->slope = side * a->ahead - along * across + g_slope * across - a->g * a->ahead;
}

/* psi += atan(move) */
static void turn_axis(struct axis *a, double move)
{
    double scale = 1.0 / sqrt(1.0 + move * move), c = (a->c - move * a->s) * scale;
    a->s = (a->s + move * a->c) * scale;
    a->c = c;
}

static void find_by_bisection(const struct pair *k, struct axis *a)
{
    double low = 0.0, high = M_PI, delta = atan2(k->sin_delta, k->cos_delta);
    for (int iteration = 0; iteration < 54; iteration++) {
        double middle = 0.5 * (low + high);
        a->c = cos(delta + middle);
        a->s = sin(delta + middle);
        evaluate(k, a);
        if (a->value > 0.0)
            low = middle;
        else
            high = middle;
    }
}

/* Newton from the small-angle answer cot(psi) = -3 tan(delta) / tan(alpha)^2; bisection where it
 * leaves the bracket or wanders. */
static void find_axis(const struct pair *k, struct axis *a)
{
    double x = -3.0 * k->sin_delta * k->cos_alpha * k->cos_alpha;
    double y = k->sin_alpha * k->sin_alpha * k->cos_delta, norm = sqrt(x * x + y * y);
    int usual = k->cos_delta > 0.0 && norm > 0.0;
    a->c = usual ? x / norm : -k->sin_delta;
    a->s = usual ? y / norm : k->cos_delta;
    for (int iteration = 0; iteration < 12; iteration++) {
        evaluate(k, a);
        double move = -a->value / a->slope;
        if (!(a->ahead > 0.0) || !(fabs(move) < 1.0))
            break;
        turn_axis(a, move);
        if (fabs(move) < 1e-6) { /* quadratic: what is left is below 1e-12 */
            evaluate(k, a);
            return;
        }
    }
    find_by_bisection(k, a);
}

struct helix helix_plain_arc(double chord, vec3 t0, vec3 t1)
{
    vec3 axis = vec_cross(t0, t1);
    double sine = sqrt(vec_dot(axis, axis)), angle = atan2(sine, vec_dot(t0, t1));
    double half = 0.5 * angle, length = half > 1e-4 ? chord * fmin(half / sin(half), 2.0) : chord;
    return (struct helix){vec_scale(sine > 0.0 ? angle / (sine * length) : 0.0, axis), length};
}

struct helix helix_through(vec3 p0, vec3 t0, vec3 p1, vec3 t1)
{
    vec3 d = vec_sub(p1, p0), n = vec_sub(t0, t1), m = vec_add(t0, t1);
    double chord = sqrt(vec_dot(d, d)), sine = sqrt(vec_dot(n, n)), cosine = sqrt(vec_dot(m, m));
    if (sine < 1e-9 || cosine < 1e-6)
        return helix_plain_arc(chord, t0, t1);
    n = vec_scale(1.0 / sine, n);
    m = vec_scale(1.0 / cosine, m);
    vec3 b = vec_cross(n, m);
    double along = vec_dot(d, m), aside = vec_dot(d, b), flat = sqrt(along * along + aside * aside);
    struct pair k = {.sin_alpha = 0.5 * sine, .cos_alpha = 0.5 * cosine,
                     .sin_delta = aside / flat, .cos_delta = along / flat};
    struct axis a;
    find_axis(&k, &a);
    double length = chord * a.ahead / a.g;
    /* alpha / sin(alpha), to 4 %: the arc of the plain one over its chord */
    double plain = 1.0 + 0.5708 * k.sin_alpha * k.sin_alpha;
    if (!(length < 2.0 * plain * chord) || !(length > 0.0))
        return helix_plain_arc(chord, t0, t1);
    double turn = 2.0 * a.h / length;
    return (struct helix){vec_add(vec_scale(turn * a.c, m), vec_scale(turn * a.s, b)), length};
}
