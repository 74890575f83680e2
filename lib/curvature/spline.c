#include "curvature/spline.h"

#include <math.h>

/* --- slopes -------------------------------------------------------------------- */

static vec3 chord_slope(const struct spline *s, uint32_t i)
{
    return vec_scale(1.0 / s->h[i], vec_sub(s->point[i + 1], s->point[i]));
}

static void solve_two(struct spline *s) { s->slope[0] = s->slope[1] = chord_slope(s, 0); }

/* Three knots: the parabola. */
static void solve_three(struct spline *s)
{
    vec3 m0 = chord_slope(s, 0), m1 = chord_slope(s, 1);
    double total = s->h[0] + s->h[1];
    vec3 middle = vec_add(vec_scale(s->h[1] / total, m0), vec_scale(s->h[0] / total, m1));
    s->slope[0] = vec_sub(vec_scale(2.0, m0), middle);
    s->slope[1] = middle;
    s->slope[2] = vec_sub(vec_scale(2.0, m1), middle);
}

/* The third derivative is continuous at the knot next to an end: h1 s0 + (h0 + h1) s1 = right side. */
static vec3 not_a_knot(double h0, double h1, vec3 m0, vec3 m1)
{
    double d = h0 + h1;
    return vec_add(vec_scale((h0 + 2.0 * d) * h1 / d, m0), vec_scale(h0 * h0 / d, m1));
}

/* Continuity of the second derivative at each inner knot: a tridiagonal system, eliminated downwards
 * (work holds the upper diagonal, slope the right side), then read upwards. */
static void solve_many(struct spline *s)
{
    uint32_t n = s->n;
    const double *h = s->h;
    double *upper = s->work;
    vec3 before = chord_slope(s, 0), after = chord_slope(s, 1);
    upper[0] = (h[0] + h[1]) / h[1];
    s->slope[0] = vec_scale(1.0 / h[1], not_a_knot(h[0], h[1], before, after));
    for (uint32_t i = 1; i + 1 < n; i++) {
        after = chord_slope(s, i);
        vec3 right = vec_scale(3.0, vec_add(vec_scale(h[i], before), vec_scale(h[i - 1], after)));
        double pivot = 1.0 / (2.0 * (h[i - 1] + h[i]) - h[i] * upper[i - 1]);
        upper[i] = h[i - 1] * pivot;
        s->slope[i] = vec_scale(pivot, vec_sub(right, vec_scale(h[i], s->slope[i - 1])));
        before = after;
    }
    double a = h[n - 2], b = h[n - 3];
    vec3 right = not_a_knot(a, b, chord_slope(s, n - 2), chord_slope(s, n - 3));
    double pivot = 1.0 / (b - (a + b) * upper[n - 2]);
    s->slope[n - 1] = vec_scale(pivot, vec_sub(right, vec_scale(a + b, s->slope[n - 2])));
    for (uint32_t i = n - 1; i-- > 0;)
        s->slope[i] = vec_sub(s->slope[i], vec_scale(upper[i], s->slope[i + 1]));
}

/* --- arc length ------------------------------------------------------------------ */

/* The derivative in segment i at u in 0..1, as a quadratic of u. */
struct speed {
    vec3 a, b, c; /* a + b u + c u^2 */
};

static struct speed speed_of(const struct spline *s, uint32_t i)
{
    vec3 m = chord_slope(s, i), s0 = s->slope[i], s1 = s->slope[i + 1];
    vec3 sum = vec_sub(vec_add(s0, s1), vec_scale(2.0, m));
    return (struct speed){s0, vec_scale(2.0, vec_sub(vec_sub(m, s0), sum)), vec_scale(3.0, sum)};
}

static vec3 speed_at(const struct speed *q, double u)
{
    return vec_add(q->a, vec_scale(u, vec_add(q->b, vec_scale(u, q->c))));
}

/* Gauss-Legendre, five points on 0..1 */
static const double gauss_at[5] = {0.046910077030668004, 0.230765344947158450, 0.5, 0.769234655052841550,
                                   0.953089922969331996};
static const double gauss_weight[5] = {0.118463442528094544, 0.239314335249683234, 0.284444444444444444,
                                       0.239314335249683234, 0.118463442528094544};

/* Arc length of segment i from 0 to u. */
static double segment_arc(const struct speed *q, double h, double u)
{
    double sum = 0.0;
    for (int k = 0; k < 5; k++) {
        vec3 d = speed_at(q, u * gauss_at[k]);
        sum += gauss_weight[k] * sqrt(vec_dot(d, d));
    }
    return h * u * sum;
}

void spline_solve(struct spline *s)
{
    if (s->n == 2)
        solve_two(s);
    else if (s->n == 3)
        solve_three(s);
    else
        solve_many(s);
    s->arc[0] = 0.0;
    for (uint32_t i = 0; i + 1 < s->n; i++) {
        struct speed q = speed_of(s, i);
        s->arc[i + 1] = s->arc[i] + segment_arc(&q, s->h[i], 1.0);
    }
}

/* --- evaluation ------------------------------------------------------------------- */

/* u in 0..1 where a segment has gone `want` of its `whole` metres: Newton, kept inside, from where it
 * would be if the speed changed linearly. */
static double invert_arc(const struct speed *q, double h, double want, double whole)
{
    vec3 end = speed_at(q, 1.0);
    double s0 = sqrt(vec_dot(q->a, q->a)), s1 = sqrt(vec_dot(end, end)), share = want / whole;
    double u = share * (s0 + s1) / (s0 + sqrt(s0 * s0 + share * (s1 * s1 - s0 * s0)));
    if (!(u >= 0.0 && u <= 1.0))
        u = share;
    for (int iteration = 0; iteration < 12; iteration++) {
        vec3 d = speed_at(q, u);
        double slope = h * sqrt(vec_dot(d, d)), miss = segment_arc(q, h, u) - want;
        if (!(slope > 1e-3 * whole))
            break;
        u = fmin(fmax(u - miss / slope, 0.0), 1.0);
        if (fabs(miss) <= 1e-8 * whole) /* quadratic: what is left is below 1e-15 */
            break;
    }
    return u;
}

void spline_at(const struct spline *s, double arc, uint32_t *segment, vec3 *point, vec3 *tangent)
{
    uint32_t i = *segment;
    while (i + 2 < s->n && arc >= s->arc[i + 1])
        i++;
    *segment = i;
    struct speed q = speed_of(s, i);
    double whole = s->arc[i + 1] - s->arc[i], want = fmin(fmax(arc - s->arc[i], 0.0), whole);
    double u = want >= whole ? 1.0 : invert_arc(&q, s->h[i], want, whole);
    vec3 d = speed_at(&q, u);
    double norm = sqrt(vec_dot(d, d));
    vec3 way = vec_add(q.a, vec_scale(u, vec_add(vec_scale(1.0 / 2, q.b), vec_scale(u / 3, q.c))));
    *point = vec_add(s->point[i], vec_scale(u * s->h[i], way));
    *tangent = norm > 1e-9 ? vec_scale(1.0 / norm, d) : chord_slope(s, i);
}
