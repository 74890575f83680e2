#include "curvature/spline.h"

#include <string.h>

#include "curvature/spline_rows.h"

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

/* The derivative in each segment at u in 0..1, as a quadratic of u; zeros beyond the last. */
static void fill_rates(struct spline *s)
{
    uint32_t stride = s->n + 3;
    double *rate = s->rate;
    for (uint32_t i = 0; i + 1 < s->n; i++) {
        vec3 m = chord_slope(s, i), s0 = s->slope[i], s1 = s->slope[i + 1];
        vec3 c = vec_sub(vec_add(s0, s1), vec_scale(2.0, m));
        vec3 of[3] = {s0, vec_scale(2.0, vec_sub(vec_sub(m, s0), c)), vec_scale(3.0, c)};
        for (uint32_t k = 0; k < 3; k++) {
            rate[(3 * k) * stride + i] = of[k].x;
            rate[(3 * k + 1) * stride + i] = of[k].y;
            rate[(3 * k + 2) * stride + i] = of[k].z;
        }
    }
    for (uint32_t k = 0; k < 9; k++)
        memset(rate + k * stride + s->n - 1, 0, 4 * sizeof *rate);
    memset(s->h + s->n - 1, 0, 4 * sizeof *s->h);
}

static void fill_arcs(struct spline *s)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) {
        spline_arcs_avx2(s->n, s->rate, s->h, s->arc);
        return;
    }
#endif
    spline_arcs_generic(s->n, s->rate, s->h, s->arc);
}

void spline_solve(struct spline *s)
{
    if (s->n == 2)
        solve_two(s);
    else if (s->n == 3)
        solve_three(s);
    else
        solve_many(s);
    fill_rates(s);
    fill_arcs(s);
}

/* --- evaluation ------------------------------------ */

void spline_at(const struct spline *s, const double *arc, uint32_t n, vec3 *point, vec3 *tangent)
{
    const struct spline_curve curve = {s->n, s->rate, s->h, s->arc, (const double (*)[3])s->point};
    double (*p)[3] = (double (*)[3])point, (*t)[3] = (double (*)[3])tangent;
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) {
        spline_stations_avx2(&curve, arc, n, p, t);
        return;
    }
#endif
    spline_stations_generic(&curve, arc, n, p, t);
}
