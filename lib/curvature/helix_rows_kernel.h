/* helix_through on four pairs at once: the text that is compiled once per instruction set. HELIX_CHAIN is
 * the name of the function. Pairs that are not the usual kind (straight or opposite tangents, a search that
 * leaves its bracket) are left to helix_through, each for itself. */
#ifndef CURVATURE_HELIX_ROWS_KERNEL_H
#define CURVATURE_HELIX_ROWS_KERNEL_H

#include "curvature/lanes.h"

#include "curvature/helix_rows.h"
#include "curvature/vector.h"

#define MOST_STEPS 12

CURVATURE_INLINE real abs_of(real x) { return lanes_select(x < 0.0, -x, x); }

/* atan(t) on 0..1: about pi/4 above tan(pi/8), then the odd polynomial that is nearest on what is left (from
 * Chebyshev's nodes; within one unit in the last place). As t = low / high, so that it takes one division. */
CURVATURE_INLINE real atan_ratio(real low, real high)
{
    lane_mask upper = low > 0.41421356237309503 * high;
    real t = lanes_select(upper, low - high, low) / lanes_select(upper, low + high, high), z = t * t;
    real p = 1.0 + z * (-0.33333333333333121 + z * (0.19999999999940837 + z * (-0.14285714279244968 +
             z * (0.11111110744657099 + z * (-0.090908968014728128 + z * (0.076920451945614809 +
             z * (-0.066629502460367918 + z * (0.058468667522751393 + z * (-0.050350497953124393 +
             z * (0.037963903161110833 - z * 0.017803896394812561))))))))));
    return lanes_select(upper, lanes_all(M_PI_4), lanes_all(0.0)) + t * p;
}

/* atan2(y, x) for y > 0 */
CURVATURE_INLINE real upper_angle(real y, real x)
{
    real a = abs_of(x);
    lane_mask steep = y > a;
    real angle = atan_ratio(lanes_select(steep, a, y), lanes_select(steep, y, a));
    angle = lanes_select(steep, M_PI_2 - angle, angle);
    return lanes_select(x < 0.0, M_PI - angle, angle);
}

/* The pair in its symmetric frame, and the axis that is looked for: see helix.c. */
struct row {
    real sin_alpha, cos_alpha, sin_delta, cos_delta;
    real c, s, h, g, ahead, value, slope;
};

CURVATURE_INLINE void evaluate_row(struct row *r)
{
    real along = r->cos_alpha * r->c, side = r->cos_alpha * r->s;
    real across = r->c * r->cos_delta + r->s * r->sin_delta, square = r->sin_alpha * r->sin_alpha + side * side;
    r->ahead = r->s * r->cos_delta - r->c * r->sin_delta;
    r->h = upper_angle(r->sin_alpha, side);
    r->g = r->sin_alpha / r->h;
    real g_slope = r->g * r->sin_alpha * along / (square * r->h);
    r->value = -along * r->ahead + r->g * across;
    r->slope = side * r->ahead - along * across + g_slope * across - r->g * r->ahead;
}

/* psi += atan(move), for the lanes that are `active` */
CURVATURE_INLINE void turn_row(struct row *r, lane_mask active, real move)
{
    real scale = 1.0 / lanes_sqrt(1.0 + move * move);
    real c = (r->c - move * r->s) * scale, s = (r->s + move * r->c) * scale;
    r->c = lanes_select(active, c, r->c);
    r->s = lanes_select(active, s, r->s);
}

/* Newton, as in helix.c. Returns the lanes that have arrived. */
CURVATURE_INLINE lane_mask find_axes(struct row *r)
{
    lane_mask active = r->c == r->c, arrived = active & ~active;
    for (int step = 0; step < MOST_STEPS && lanes_any(active); step++) {
        evaluate_row(r);
        real move = -r->value / r->slope, size = abs_of(move);
        active &= (r->ahead > 0.0) & (size < 1.0);
        turn_row(r, active, move);
        lane_mask near = active & (size < 1e-6);
        arrived |= near;
        active &= ~near;
    }
    evaluate_row(r);
    return arrived;
}

CURVATURE_INLINE vec3 gather(const double (*v)[3], const uint32_t at[LANES])
{
    return (vec3){{v[at[0]][0], v[at[1]][0], v[at[2]][0], v[at[3]][0]},
                  {v[at[0]][1], v[at[1]][1], v[at[2]][1], v[at[3]][1]},
                  {v[at[0]][2], v[at[1]][2], v[at[2]][2], v[at[3]][2]}};
}

/* Four pairs from `first` on; beyond the last one it comes again. */
CURVATURE_INLINE void solve_row(uint32_t first, uint32_t n, const double (*p)[3], const double (*t)[3],
                                double (*out_omega)[3], double *out_length)
{
    uint32_t at[LANES], next[LANES];
    for (uint32_t i = 0; i < LANES; i++) {
        at[i] = first + i < n ? first + i : n - 1;
        next[i] = at[i] + 1;
    }
    vec3 t0 = gather(t, at), t1 = gather(t, next);
    vec3 d = vec_sub(gather(p, next), gather(p, at)), across = vec_sub(t0, t1), m = vec_add(t0, t1);
    real chord = lanes_sqrt(vec_dot(d, d)), sine = lanes_sqrt(vec_dot(across, across)), cosine = lanes_sqrt(vec_dot(m, m));
    lane_mask usual = (sine >= 1e-9) & (cosine >= 1e-6);
    across = vec_scale(1.0 / lanes_select(usual, sine, lanes_all(1.0)), across);
    m = vec_scale(1.0 / lanes_select(usual, cosine, lanes_all(1.0)), m);
    vec3 b = vec_cross(across, m);
    real along = vec_dot(d, m), aside = vec_dot(d, b), flat = lanes_sqrt(along * along + aside * aside);
    struct row r = {.sin_alpha = 0.5 * sine, .cos_alpha = 0.5 * cosine, .sin_delta = aside / flat, .cos_delta = along / flat};
    real x = -3.0 * r.sin_delta * r.cos_alpha * r.cos_alpha, y = r.sin_alpha * r.sin_alpha * r.cos_delta;
    real norm = lanes_sqrt(x * x + y * y);
    lane_mask ahead = (r.cos_delta > 0.0) & (norm > 0.0);
    r.c = lanes_select(ahead, x / norm, -r.sin_delta);
    r.s = lanes_select(ahead, y / norm, r.cos_delta);
    usual &= find_axes(&r);
    real length = chord * r.ahead / r.g, turn = 2.0 * r.h / length;
    real plain = 1.0 + 0.5708 * r.sin_alpha * r.sin_alpha;
    usual &= (length < 2.0 * plain * chord) & (length > 0.0);
    vec3 omega = vec_add(vec_scale(turn * r.c, m), vec_scale(turn * r.s, b));
    for (uint32_t i = 0; i < LANES && first + i < n; i++) {
        double *o = out_omega[first + i];
        o[0] = omega.x[i], o[1] = omega.y[i], o[2] = omega.z[i];
        out_length[first + i] = length[i];
        if (!usual[i])
            helix_through_pair(p[at[i]], t[at[i]], p[next[i]], t[next[i]], o, &out_length[first + i]);
    }
}

void HELIX_CHAIN(uint32_t n, const double (*p)[3], const double (*t)[3], double (*omega)[3], double *length)
{
    for (uint32_t first = 0; first < n; first += LANES)
        solve_row(first, n, p, t, omega, length);
}

#endif
