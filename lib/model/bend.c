/* Bend: strands turn about an axis perpendicular to their operator guide's root direction, more
 * towards the tip (Chang et al. 2025, Appendix A, as mended in its notes).
 *   a = cos(pi u) v + sin(pi u) w          the strand's axis (v, w: model/frames.h)
 *   zeta'_j = sigmoid(10 (v_j - zeta))     v_j: arc length at the end of segment j over the length
 *   q_j = sum_{i<=j} l_i zeta'_i / sum_i l_i zeta'_i
 *   e'_j = R(a, angle q_j) e_j,  x~_j = x_1 + sum_{i<j} e'_i */
#include "model/arc.h"
#include "model/kernel.h"
#include "model/vec.h"

enum { ANGLE, START };

#define TURNS_IN_RADIAN 0.159154943f
#define HALVES_IN_RADIAN (2.0f * TURNS_IN_RADIAN)
#define PI 3.14159265f

/* What forward and backward both need. */
struct bend {
    lanes *ell, *at;   /* arc.h */
    lanes *begun;      /* [m-1] zeta' */
    lanes *bent;       /* [m-1] sum of l zeta' up to and with the segment */
    lanes inverse;     /* 1 / length */
    lanes inverse_bent;/* 1 / length after the start */
    lanes axis[3], sine, cosine; /* a; of pi u */
};

LANES_INLINE void bend_measure(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict scratch,
                               struct bend *restrict bend)
{
    uint32_t m = in->m;
    float start = in->parameter[START];
    bend->ell = scratch, bend->at = scratch + m, bend->begun = scratch + 2 * m, bend->bent = scratch + 3 * m;
    lanes *restrict ell = bend->ell, *restrict at = bend->at;
    lanes *restrict begun = bend->begun, *restrict bent = bend->bent;
    arc_measure(m, x, ell, at, bend->inverse);
    lanes sum = {0};
    for (uint32_t j = 0; j + 1 < m; j++)
        FOR_LANES(l)
        {
            float z = lane_begun(at[j + 1][l] * bend->inverse[l], start);
            sum[l] += ell[j][l] * z;
            begun[j][l] = z;
            bent[j][l] = sum[l];
        }
    FOR_LANES(l)
    {
        bend->inverse_bent[l] = lane_inverse(sum[l]);
        lane_sincos_turns(0.5f * in->random[0][l], &bend->sine[l], &bend->cosine[l]);
    }
    for (int c = 0; c < 3; c++)
        FOR_LANES(l) bend->axis[c][l] = bend->cosine[l] * in->axis[c][l] + bend->sine[l] * in->axis[3 + c][l];
}

/* How far each segment has turned: sum of l zeta' up to and with it, and 1 / that of all. */
LANES_INLINE vec bend_sums(uint32_t m, float rise, const lanes *restrict at, const lanes *restrict fallen, lanes *restrict bent)
{
    vec sum = {0}, before = {0};
    for (uint32_t j = 1; j < m; j++) {
        vec s = vec_load(at[j]);
        sum += (s - before) * vec_begun(rise, vec_load(fallen[j]));
        vec_store(bent[j], sum);
        before = s;
    }
    return vec_inverse(sum);
}

/* Sine and cosine of each segment's angle. near: none is more than a quarter of a turn */
LANES_INLINE void bend_angles(uint32_t m, int near, vec rate, const lanes *restrict bent, lanes *restrict sine,
                              lanes *restrict cosine)
{
    vec s, c;
    for (uint32_t j = 1; j < m; j++) {
        if (near)
            vec_sincos_near(rate * vec_load(bent[j]), &s, &c);
        else
            vec_sincos_halves(rate * vec_load(bent[j]), &s, &c);
        vec_store(sine[j], s);
        vec_store(cosine[j], c);
    }
}

LANES_INLINE void bend_turn(uint32_t m, const vec a[3], const lanes *restrict sine, const lanes *restrict cosine,
                            const lanes *restrict x, lanes *restrict y)
{
    vec px = vec_load(x[0]), py = vec_load(x[1]), pz = vec_load(x[2]), rx = px, ry = py, rz = pz;
    vec_copy_root(x, y);
    for (uint32_t j = 1; j < m; j++) {
        vec qx = vec_load(x[3 * j]), qy = vec_load(x[3 * j + 1]), qz = vec_load(x[3 * j + 2]);
        vec ex = qx - px, ey = qy - py, ez = qz - pz, s = vec_load(sine[j]), c = vec_load(cosine[j]);
        vec along = (1.0f - c) * (a[0] * ex + a[1] * ey + a[2] * ez);
        rx += c * ex + s * (a[1] * ez - a[2] * ey) + along * a[0];
        ry += c * ey + s * (a[2] * ex - a[0] * ez) + along * a[1];
        rz += c * ez + s * (a[0] * ey - a[1] * ex) + along * a[2];
        vec_store(y[3 * j], rx), vec_store(y[3 * j + 1], ry), vec_store(y[3 * j + 2], rz);
        px = qx, py = qy, pz = qz;
    }
}

/* What is bent is as long as before, vertex by vertex. */
LANES_INLINE void bend_forward(const struct kernel_inputs *in, struct bundle x, struct bundle y, lanes *scratch)
{
    lanes *bent = scratch, *sine = scratch + in->m, *cosine = scratch + 2 * in->m;
    lanes *fallen = y.fallen ? y.fallen : scratch + 3 * in->m;
    float angle = in->parameter[ANGLE] * HALVES_IN_RADIAN;
    vec_fall(in->m, (const lanes *)x.at, fallen);
    vec rate = angle * bend_sums(in->m, lane_rise(in->parameter[START]), (const lanes *)x.at, (const lanes *)fallen, bent);
    vec s, c, a[3];
    if (fabsf(angle) < 0.49f)
        bend_angles(in->m, 1, rate, (const lanes *)bent, sine, cosine);
    else
        bend_angles(in->m, 0, rate, (const lanes *)bent, sine, cosine);
    vec_sincos_halves(vec_load(in->random[0]), &s, &c);
    for (int k = 0; k < 3; k++)
        a[k] = c * vec_load(in->axis[k]) + s * vec_load(in->axis[3 + k]);
    bend_turn(in->m, a, (const lanes *)sine, (const lanes *)cosine, (const lanes *)x.points, y.points);
    if (y.at)
        memcpy(y.at, x.at, in->m * sizeof *y.at);
}

/* Tip to root through the rotations. d leaves with the adjoint of segment j in vertex j + 1 and that
 * of the root in vertex 0; d_q [m-1] gets the adjoint of q, which `weighed` sums times q. */
LANES_INLINE void rotations_backward(const struct kernel_inputs *in, const struct bend *restrict bend,
                                     const lanes *restrict x, lanes *restrict d, lanes *restrict d_q,
                                     lanes *restrict d_axis, float *restrict d_angle, float *restrict weighed)
{
    float angle = in->parameter[ANGLE], turns = angle * TURNS_IN_RADIAN;
    lanes fx = {0}, fy = {0}, fz = {0}; /* adjoint of the rotated segment: all vertices beyond it */
    for (uint32_t j = in->m - 1; j-- > 0;) {
        const lanes *p = x + 3 * j;
        lanes *dp = d + 3 * j;
        FOR_LANES(l)
        {
            float ax = bend->axis[0][l], ay = bend->axis[1][l], az = bend->axis[2][l];
            float ex = p[3][l] - p[0][l], ey = p[4][l] - p[1][l], ez = p[5][l] - p[2][l], s, c;
            float q = bend->bent[j][l] * bend->inverse_bent[l];
            lane_sincos_turns(turns * q, &s, &c);
            float gx = fx[l] + dp[3][l], gy = fy[l] + dp[4][l], gz = fz[l] + dp[5][l], versine = 1.0f - c;
            float a_e = ax * ex + ay * ey + az * ez, a_g = ax * gx + ay * gy + az * gz;
            float cx = ay * ez - az * ey, cy = az * ex - ax * ez, cz = ax * ey - ay * ex; /* a x e */
            float d_phi = c * (cx * gx + cy * gy + cz * gz) + s * (a_e * a_g - (ex * gx + ey * gy + ez * gz));
            d_axis[0][l] += s * (ey * gz - ez * gy) + versine * (a_e * gx + a_g * ex);
            d_axis[1][l] += s * (ez * gx - ex * gz) + versine * (a_e * gy + a_g * ey);
            d_axis[2][l] += s * (ex * gy - ey * gx) + versine * (a_e * gz + a_g * ez);
            dp[3][l] = c * gx - s * (ay * gz - az * gy) + versine * a_g * ax;
            dp[4][l] = c * gy - s * (az * gx - ax * gz) + versine * a_g * ay;
            dp[5][l] = c * gz - s * (ax * gy - ay * gx) + versine * a_g * az;
            d_angle[l] += d_phi * q;
            d_q[j][l] = d_phi * angle;
            weighed[l] += d_phi * angle * q;
            fx[l] = gx, fy[l] = gy, fz[l] = gz;
        }
    }
    FOR_LANES(l) d[0][l] += fx[l], d[1][l] += fy[l], d[2][l] += fz[l];
}

/* Tip to root through q and zeta'. d_q turns into the adjoint of the segment lengths; d_at [m] is set. */
LANES_INLINE void starts_backward(uint32_t m, const struct bend *restrict bend, const float *restrict weighed,
                                  lanes *restrict d_q, lanes *restrict d_at, float *restrict d_start)
{
    lanes sum, d_length = {0};
    FOR_LANES(l) sum[l] = -weighed[l];
    for (uint32_t j = m - 1; j-- > 0;)
        FOR_LANES(l)
        {
            float z = bend->begun[j][l], ell = bend->ell[j][l], v = bend->at[j + 1][l] * bend->inverse[l];
            sum[l] += d_q[j][l];
            float d_bent = sum[l] * bend->inverse_bent[l];
            float d_v = START_STEEPNESS * (d_bent * ell) * (z * (1.0f - z));
            d_start[l] -= d_v;
            d_length[l] -= d_v * v * bend->inverse[l];
            d_at[j + 1][l] = d_v * bend->inverse[l];
            d_q[j][l] = d_bent * z;
        }
    FOR_LANES(l)
    {
        d_at[0][l] = 0.0f;
        d_at[m - 1][l] += d_length[l];
    }
}

/* From adjoints of segments (in vertex j + 1) to adjoints of vertices. */
LANES_INLINE void segments_to_vertices(uint32_t m, lanes *restrict d)
{
    for (uint32_t j = 0; j + 1 < m; j++)
        for (int c = 0; c < 3; c++)
            FOR_LANES(l) d[3 * j + c][l] -= d[3 * (j + 1) + c][l];
}

LANES_INLINE void bend_backward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,
                                struct kernel_adjoints *adjoints, lanes *restrict scratch)
{
    uint32_t m = in->m;
    struct bend bend;
    lanes *d_q = scratch + 4 * m, *d_at = scratch + 5 * m;
    lanes d_axis[3] = {{0}}, d_angle = {0}, d_start = {0}, weighed = {0};
    bend_measure(in, x, scratch, &bend);
    rotations_backward(in, &bend, x, d, d_q, d_axis, d_angle, weighed);
    starts_backward(m, &bend, weighed, d_q, d_at, d_start);
    segments_to_vertices(m, d);
    arc_backward(m, x, bend.ell, d_at, d_q, d);

    lanes d_turn = {0}; /* of pi u */
    for (int c = 0; c < 3; c++)
        FOR_LANES(l)
        {
            d_turn[l] += d_axis[c][l] * (bend.cosine[l] * in->axis[3 + c][l] - bend.sine[l] * in->axis[c][l]);
            adjoints->axis[c][l] += bend.cosine[l] * d_axis[c][l];
            adjoints->axis[3 + c][l] += bend.sine[l] * d_axis[c][l];
        }
    FOR_LANES(l)
    {
        adjoints->parameter[ANGLE][l] = d_angle[l];
        adjoints->parameter[START][l] = d_start[l];
        adjoints->random[0][l] = PI * d_turn[l];
    }
}

KERNEL_TABLE(bend)
