/* The text that is compiled once per instruction set; SPLINE_ARCS and SPLINE_STATIONS are the names of the
 * functions. */
#ifndef CURVATURE_SPLINE_ROWS_KERNEL_H
#define CURVATURE_SPLINE_ROWS_KERNEL_H

#include "curvature/lanes.h"

#include "curvature/spline_rows.h"
#include "curvature/vector.h"

#include <string.h>

#define MOST_STEPS 12

/* Gauss-Legendre, five points on 0..1 */
static const double gauss_at[5] = {0.046910077030668004, 0.230765344947158450, 0.5, 0.769234655052841550,
                                   0.953089922969331996};
static const double gauss_weight[5] = {0.118463442528094544, 0.239314335249683234, 0.284444444444444444,
                                       0.239314335249683234, 0.118463442528094544};

/* The derivative in four segments. */
struct speeds {
    vec3 a, b, c; /* a + b u + c u^2 */
    real h;
};

CURVATURE_INLINE vec3 speed_at(const struct speeds *q, real u)
{
    return vec_add(q->a, vec_scale(u, vec_add(q->b, vec_scale(u, q->c))));
}

CURVATURE_INLINE real norm_of(vec3 d) { return lanes_sqrt(vec_dot(d, d)); }

/* Arc length from 0 to u. */
CURVATURE_INLINE real arc_to(const struct speeds *q, real u)
{
    real sum = lanes_all(0.0);
    for (int k = 0; k < 5; k++)
        sum += gauss_weight[k] * norm_of(speed_at(q, u * gauss_at[k]));
    return q->h * u * sum;
}

CURVATURE_INLINE real load(const double *from)
{
    real r;
    memcpy(&r, from, sizeof r);
    return r;
}

void SPLINE_ARCS(uint32_t n, const double *rate, const double *h, double *arc)
{
    const size_t w = (size_t)n + 3;
    arc[0] = 0.0;
    for (uint32_t i = 0; i + 1 < n; i += LANES) {
        const double *r = rate + i;
        struct speeds q = {{load(r), load(r + w), load(r + 2 * w)}, {load(r + 3 * w), load(r + 4 * w), load(r + 5 * w)},
                           {load(r + 6 * w), load(r + 7 * w), load(r + 8 * w)}, load(h + i)};
        real length = arc_to(&q, lanes_all(1.0));
        for (uint32_t k = 0; k < LANES && i + k + 1 < n; k++)
            arc[i + k + 1] = arc[i + k] + length[k];
    }
}

/* --- stations ------------------------------------------------------------------------- */

CURVATURE_INLINE real pick(const double *from, const uint32_t at[LANES])
{
    return (real){from[at[0]], from[at[1]], from[at[2]], from[at[3]]};
}

CURVATURE_INLINE real clamp(real u)
{
    u = lanes_select(u > 0.0, u, lanes_all(0.0));
    return lanes_select(u < 1.0, u, lanes_all(1.0));
}

/* u in 0..1 where segments have gone `want` of their `whole` metres: Newton, kept inside, from where it would
 * be if the speed changed linearly. */
CURVATURE_INLINE real invert_arcs(const struct speeds *q, real want, real whole)
{
    real s0 = norm_of(q->a), s1 = norm_of(speed_at(q, lanes_all(1.0))), share = want / whole;
    real u = share * (s0 + s1) / (s0 + lanes_sqrt(s0 * s0 + share * (s1 * s1 - s0 * s0)));
    lane_mask active = want < whole;
    u = lanes_select((u >= 0.0) & (u <= 1.0), u, share);
    u = lanes_select(active, u, lanes_all(1.0));
    for (int step = 0; step < MOST_STEPS && lanes_any(active); step++) {
        real slope = q->h * norm_of(speed_at(q, u)), miss = arc_to(q, u) - want;
        real size = lanes_select(miss < 0.0, -miss, miss);
        active &= slope > 1e-3 * whole;
        u = lanes_select(active, clamp(u - miss / slope), u);
        active &= size > 1e-8 * whole; /* quadratic: what is left is below 1e-15 */
    }
    return u;
}

CURVATURE_INLINE vec3 pick_vector(const double *x, size_t w, const uint32_t at[LANES])
{
    return (vec3){pick(x, at), pick(x + w, at), pick(x + 2 * w, at)};
}

/* The segments of four stations; *i moves forward. Beyond the last station it comes again. */
CURVATURE_INLINE void find_segments(const struct spline_curve *s, const double *at, uint32_t n, uint32_t *i,
                                    uint32_t segment[LANES], real *want, real *whole)
{
    for (uint32_t k = 0; k < LANES; k++) {
        double arc = at[k < n ? k : n - 1];
        while (*i + 2 < s->n && arc >= s->arc[*i + 1])
            ++*i;
        segment[k] = *i;
        (*whole)[k] = s->arc[*i + 1] - s->arc[*i];
        double into = arc - s->arc[*i];
        (*want)[k] = into > 0.0 ? (into < (*whole)[k] ? into : (*whole)[k]) : 0.0;
    }
}

CURVATURE_INLINE void store(const struct spline_curve *s, const uint32_t segment[LANES], uint32_t n, vec3 way, vec3 d,
                            real norm, double (*point)[3], double (*tangent)[3])
{
    for (uint32_t k = 0; k < LANES && k < n; k++) {
        const double *from = s->point[segment[k]], *to = s->point[segment[k] + 1];
        const double w[3] = {way.x[k], way.y[k], way.z[k]}, v[3] = {d.x[k], d.y[k], d.z[k]};
        for (int c = 0; c < 3; c++) {
            point[k][c] = from[c] + w[c];
            tangent[k][c] = norm[k] > 1e-9 ? v[c] / norm[k] : (to[c] - from[c]) / s->h[segment[k]];
        }
    }
}

void SPLINE_STATIONS(const struct spline_curve *s, const double *at, uint32_t n_at, double (*point)[3],
                     double (*tangent)[3])
{
    const size_t w = (size_t)s->n + 3;
    uint32_t segment[LANES], i = 0;
    for (uint32_t first = 0; first < n_at; first += LANES) {
        real want = lanes_all(0.0), whole = want;
        find_segments(s, at + first, n_at - first, &i, segment, &want, &whole);
        struct speeds q = {pick_vector(s->rate, w, segment), pick_vector(s->rate + 3 * w, w, segment),
                           pick_vector(s->rate + 6 * w, w, segment), pick(s->h, segment)};
        real u = invert_arcs(&q, want, whole);
        vec3 way = vec_add(q.a, vec_scale(u, vec_add(vec_scale(lanes_all(1.0 / 2), q.b), vec_scale(u / 3.0, q.c))));
        vec3 d = speed_at(&q, u);
        store(s, segment, n_at - first, vec_scale(u * q.h, way), d, norm_of(d), point + first, tangent + first);
    }
}

#endif
