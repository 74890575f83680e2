/* One helical element in its own frame: Shi et al. 2026, Section 3.2, in the form that stays exact
 * where the Darboux vector vanishes.
 *
 * With theta = q s, x = |theta|^2 and the entire functions
 *   A = sin|theta|/|theta|, B = (1 - cos|theta|)/x, C = (|theta| - sin|theta|)/|theta|^3
 * the frame turns by   E = I + A [theta]x + B [theta]x^2                 (Eq. 2)
 * the end lies at      s V e1,  V = I + B [theta]x + C [theta]x^2        (Eq. 3)
 * and its derivative   D = d(s V e1)/dq                                  (Eq. 19)
 *   = s^2 { (B1 theta x e1 + C1 theta x (theta x e1)) theta^T - B [e1]x
 *           + C (theta e1^T + theta_x I - 2 e1 theta^T) },
 * B1 = (A - 2B)/x, C1 = (B - 3C)/x. A rotation of the frame by dq turns it by s F V dq. */
#ifndef CURVATURE_ELEMENT_H
#define CURVATURE_ELEMENT_H

#include <math.h>

#include "curvature/vector.h"

typedef struct {
    real A, B, C;
} trig3;

typedef struct {
    real A, B, C, B1, C1;
} trig5;

/* Above this |theta|^2 (more than a turn and a third in one element) the Taylor series at
 * theta/8 runs out of digits, and the closed forms have all of theirs. */
#define TRIG_SERIES_LIMIT 70.0

/* sum of (-y)^k / (2k+2)! and (2k+3)!: B and C at y = x/64, nine terms */
CURVATURE_INLINE real series_b(real y)
{
    return 1.0 / 2 - y * (1.0 / 24 - y * (1.0 / 720 - y * (1.0 / 40320 - y * (1.0 / 3628800 -
           y * (1.0 / 479001600 - y * (1.0 / 87178291200 - y * (1.0 / 20922789888000 -
           y * (1.0 / 6402373705728000))))))));
}

CURVATURE_INLINE real series_c(real y)
{
    return 1.0 / 6 - y * (1.0 / 120 - y * (1.0 / 5040 - y * (1.0 / 362880 - y * (1.0 / 39916800 -
           y * (1.0 / 6227020800 - y * (1.0 / 1307674368000 - y * (1.0 / 355687428096000 -
           y * (1.0 / 121645100408832000))))))));
}

/* sum over k >= 1 of (-1)^k 2k y^(k-1) / (2k+2)! and / (2k+3)!: B1 and C1 */
CURVATURE_INLINE real series_b1(real y)
{
    return -(2.0 / 24 - y * (4.0 / 720 - y * (6.0 / 40320 - y * (8.0 / 3628800 - y * (10.0 / 479001600 -
             y * (12.0 / 87178291200 - y * (14.0 / 20922789888000 - y * (16.0 / 6402373705728000))))))));
}

CURVATURE_INLINE real series_c1(real y)
{
    return -(2.0 / 120 - y * (4.0 / 5040 - y * (6.0 / 362880 - y * (8.0 / 39916800 - y * (10.0 / 6227020800 -
             y * (12.0 / 1307674368000 - y * (14.0 / 355687428096000 - y * (16.0 / 121645100408832000))))))));
}

CURVATURE_INLINE trig3 trig3_series(real x)
{
    real y = x * (1.0 / 64);
    trig3 f = {.B = series_b(y), .C = series_c(y)};
    f.A = 1.0 - y * f.C;
    for (int i = 0; i < 3; i++) {
        real b = f.A * f.A * 0.5, c = (f.C + f.A * f.B) * 0.25;
        f.A = f.A * (1.0 - y * f.B);
        f.B = b;
        f.C = c;
        y = y * 4.0;
    }
    return f;
}

CURVATURE_INLINE trig5 trig5_series(real x)
{
    real y = x * (1.0 / 64);
    trig5 f = {.B = series_b(y), .C = series_c(y), .B1 = series_b1(y), .C1 = series_c1(y)};
    f.A = 1.0 - y * f.C;
    for (int i = 0; i < 3; i++) {
        real c_b = f.C - f.B, b = f.A * f.A * 0.5, c = (f.C + f.A * f.B) * 0.25;
        f.C1 = (f.C1 + c_b * f.B + f.A * f.B1) * 0.0625;
        f.B1 = f.A * c_b * 0.25;
        f.A = f.A * (1.0 - y * f.B);
        f.B = b;
        f.C = c;
        y = y * 4.0;
    }
    return f;
}

struct trig_numbers {
    double A, B, C, B1, C1;
};

CURVATURE_INLINE struct trig_numbers trig_closed(double x)
{
    double t = sqrt(x), sine = sin(t), half = sin(0.5 * t);
    struct trig_numbers f = {.A = sine / t, .B = 2.0 * half * half / x, .C = (t - sine) / (t * x)};
    f.B1 = (f.A - 2.0 * f.B) / x;
    f.C1 = (f.B - 3.0 * f.C) / x;
    return f;
}

#ifdef CURVATURE_LANES_H
/* Each lane for itself, so that a strand's bits do not depend on its neighbours. */
CURVATURE_INLINE trig3 trig3_of(real x)
{
    trig3 f = trig3_series(x);
    if (__builtin_expect(lanes_any(x > TRIG_SERIES_LIMIT), 0))
        for (int i = 0; i < LANES; i++)
            if (x[i] > TRIG_SERIES_LIMIT) {
                struct trig_numbers g = trig_closed(x[i]);
                f.A[i] = g.A, f.B[i] = g.B, f.C[i] = g.C;
            }
    return f;
}

CURVATURE_INLINE trig5 trig5_of(real x)
{
    trig5 f = trig5_series(x);
    if (__builtin_expect(lanes_any(x > TRIG_SERIES_LIMIT), 0))
        for (int i = 0; i < LANES; i++)
            if (x[i] > TRIG_SERIES_LIMIT) {
                struct trig_numbers g = trig_closed(x[i]);
                f.A[i] = g.A, f.B[i] = g.B, f.C[i] = g.C, f.B1[i] = g.B1, f.C1[i] = g.C1;
            }
    return f;
}
#else
CURVATURE_INLINE trig3 trig3_of(real x)
{
    if (x <= TRIG_SERIES_LIMIT)
        return trig3_series(x);
    struct trig_numbers g = trig_closed(x);
    return (trig3){g.A, g.B, g.C};
}

CURVATURE_INLINE trig5 trig5_of(real x)
{
    if (x <= TRIG_SERIES_LIMIT)
        return trig5_series(x);
    struct trig_numbers g = trig_closed(x);
    return (trig5){g.A, g.B, g.C, g.B1, g.C1};
}
#endif

/* a I + b [w]x + c w w^T */
CURVATURE_INLINE mat3 mat_axial(real a, real b, real c, vec3 w)
{
    vec3 cw = vec_scale(c, w), bw = vec_scale(b, w);
    return (mat3){{a + cw.x * w.x, bw.z + cw.x * w.y, cw.x * w.z - bw.y},
                  {cw.y * w.x - bw.z, a + cw.y * w.y, bw.x + cw.y * w.z},
                  {bw.y + cw.z * w.x, cw.z * w.y - bw.x, a + cw.z * w.z}};
}

/* E: how the frame has turned */
CURVATURE_INLINE mat3 element_turn(real A, real B, real x, vec3 theta)
{
    return mat_axial(1.0 - x * B, A, B, theta);
}

/* V: the mean of the turned frames; its first column is the way from begin to end over s */
CURVATURE_INLINE mat3 element_mean(real B, real C, real x, vec3 theta)
{
    return mat_axial(1.0 - x * C, B, C, theta);
}

/* V e1 alone */
CURVATURE_INLINE vec3 element_chord(real B, real C, real x, vec3 theta)
{
    real c = C * theta.x;
    return (vec3){1.0 - x * C + c * theta.x, B * theta.z + c * theta.y, c * theta.z - B * theta.y};
}

/* D */
CURVATURE_INLINE mat3 element_derivative(trig5 f, real x, vec3 theta, real s)
{
    real along = f.C1 * theta.x, c = f.C * theta.x;
    vec3 w = {along * theta.x - f.C1 * x - 2.0 * f.C, f.B1 * theta.z + along * theta.y,
              along * theta.z - f.B1 * theta.y};
    vec3 t = vec_scale(theta.x, w), u = vec_scale(theta.y, w), v = vec_scale(theta.z, w);
    real ss = s * s;
    return mat_scale(ss, (mat3){{t.x + c + c, t.y + f.C * theta.y, t.z + f.C * theta.z},
                                {u.x, u.y + c, u.z - f.B},
                                {v.x, v.y + f.B, v.z + c}});
}

#endif
