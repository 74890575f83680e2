/* The solver of Eq. 15 on four strands at once: the text that is compiled once per instruction set.
 * The including file defines SCULPT_KERNEL, the name of the function.
 *
 * With r = x - a and y = q - rest, half the downhill gradient is b = -(J^T r + c y), and a step is d with
 * (H + mu I) d = b, H half the Hessian. A change dq_j moves all that lies beyond element j by the twist
 * (v, w) = (U_j, A_j) dq_j: a point x goes by v + w x x. With A_j = F_j l_j V_j and U_j = F_j D_j +
 * [p_(j+1)]x A_j in one frame about the root, twists add up, and for i < j
 *   H_ij = U_i^T Q_v + A_i^T Q_w,   Q_v = sum (U_j - [x]x A_j),   Q_w = sum ([a]x U_j + ((x.a) I - x a^T) A_j)
 * over the anchors beyond j: J^T J and r d2x together, since x - r is the target a. (With x in place of a it is
 * J^T J alone, Gauss-Newton.) Such a matrix is factored from tip to root as a Riccati recursion, in linear time:
 * element j answers to the twist of those before it, and hands on what is left of the anchors' pull.
 *   D_j = (c + mu) I + U_j^T Q_v + A_j^T Q_w, symmetric part; Z = Q D_j^-1; B -= Z Q^T; Q = B (U, A)
 * where B begins as the sums above. Where D_j is not positive the lane falls back to Gauss-Newton. Within an
 * element its own second derivative is taken as that of many short ones, which is right to first order in its turn. */
#ifndef CURVATURE_SCULPT_KERNEL_H
#define CURVATURE_SCULPT_KERNEL_H

#include "curvature/sculpt_group.h"

#define KERNEL_INLINE CURVATURE_INLINE

/* The first damping, and the least, as shares of the mean diagonal of J J^T. */
#define FIRST_DAMPING 1e-3
#define LEAST_DAMPING 1e-8

/* --- small matrices ------------------------------------------------------------------- */

/* m -= a b^T: columns by the components of b */
KERNEL_INLINE void subtract_product(mat3 *m, const mat3 *a, const mat3 *b)
{
    m->t = vec_sub(m->t, vec_add(vec_add(vec_scale(b->t.x, a->t), vec_scale(b->u.x, a->u)), vec_scale(b->v.x, a->v)));
    m->u = vec_sub(m->u, vec_add(vec_add(vec_scale(b->t.y, a->t), vec_scale(b->u.y, a->u)), vec_scale(b->v.y, a->v)));
    m->v = vec_sub(m->v, vec_add(vec_add(vec_scale(b->t.z, a->t), vec_scale(b->u.z, a->u)), vec_scale(b->v.z, a->v)));
}

KERNEL_INLINE mat3 full_of(struct symmetric m)
{
    return (mat3){{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}};
}

/* --- the walk along the strands ----------------------------------------------------------- */

/* Copy one lane of `count` reals. */
KERNEL_INLINE void copy_lane(void *to, const void *from, size_t count, uint32_t lane)
{
    double *a = (double *)to + lane;
    const double *b = (const double *)from + lane;
    for (size_t i = 0; i < count; i++)
        a[i * LANES] = b[i * LANES];
}

/* What the walk knows when it stands before an element goes to the anchors that lie on it. */
KERNEL_INLINE void meet_anchors(struct sculpt_group *g, uint32_t *event, uint32_t j, const struct sculpt_passing *now)
{
    for (; *event < g->n_events && g->event[*event].element == j; (*event)++) {
        const struct sculpt_event *e = &g->event[*event];
        copy_lane(&g->anchor[e->anchor].passing, now, sizeof *now / sizeof(real), e->lane);
    }
}

/* Where an anchor is, its own element's part of the Jacobian, its miss. Returns the squared miss. */
KERNEL_INLINE real finish_anchor(struct sculpt_anchor *a)
{
    const struct sculpt_passing *on = &a->passing;
    vec3 theta = vec_scale(a->s, on->q);
    real x = vec_dot(theta, theta);
    trig5 f = trig5_of(x);
    vec3 chord = vec_scale(a->s, element_chord(f.B, f.C, x, theta));
    a->x = vec_add(on->p, mat_vec(on->F, chord));
    a->own = mat_mul(on->F, element_derivative(f, x, theta, a->s));
    a->r = vec_sub(a->x, a->target);
    return vec_dot(a->r, a->r);
}

KERNEL_INLINE vec3 vec_select(lane_mask which, vec3 a, vec3 b)
{
    return (vec3){lanes_select(which, a.x, b.x), lanes_select(which, a.y, b.y), lanes_select(which, a.z, b.z)};
}

/* Everything that a step needs, at q, or for some lanes share step farther, which goes into `to`; returns the
 * energy there. */
KERNEL_INLINE real linearise(struct sculpt_group *g, const vec3 *q, vec3 *to, lane_mask moving, real share)
{
    const real zero = lanes_all(0.0);
    const vec3 none = {zero, zero, zero};
    /* plain locals, not one struct: they stay in registers */
    vec3 p = none, llp = none;
    mat3 F = {g->root.t, g->root.u, g->root.v};
    real deviation = zero, miss = zero, ll = zero, llpp = zero;
    uint32_t event = 0;
    for (uint32_t j = 0; j < g->n; j++) {
        vec3 qj = vec_select(moving, vec_add(q[j], vec_scale(share, g->step[j])), q[j]), y = vec_sub(qj, g->rest[j]);
        to[j].x = qj.x, to[j].y = qj.y, to[j].z = qj.z;
        deviation += vec_dot(y, y);
        real l = g->length[j];
        vec3 theta = vec_scale(l, qj);
        real x = vec_dot(theta, theta);
        trig5 f = trig5_of(x);
        mat3 A = mat_scale(l, mat_mul(F, element_mean(f.B, f.C, x, theta)));
        vec3 end = vec_add(p, A.t);
        mat3 U = mat_add(mat_mul(F, element_derivative(f, x, theta, l)), cross_mat(end, A));
        g->A[j].t = A.t, g->A[j].u = A.u, g->A[j].v = A.v;
        g->U[j].t = U.t, g->U[j].u = U.u, g->U[j].v = U.v;
        if (event < g->n_events && g->event[event].element == j) {
            struct sculpt_passing now = {p, F, qj, ll, llpp, llp};
            meet_anchors(g, &event, j, &now);
        }
        real square = l * l;
        vec3 squared = vec_scale(square, p);
        ll += square;
        llp = vec_add(llp, squared);
        llpp += vec_dot(squared, p);
        F = mat_mul(F, element_turn(f.A, f.B, x, theta));
        p = end;
    }
    for (uint32_t k = 0; k < g->m; k++)
        miss += finish_anchor(&g->anchor[k]);
    return miss + g->c * deviation;
}

/* The mean of the diagonal of J J^T, near enough: |d x / d q_j|^2 = 2 l^2 |x - p_j|^2 */
KERNEL_INLINE real mean_diagonal(const struct sculpt_group *g)
{
    real trace = lanes_all(0.0);
    for (uint32_t k = 0; k < g->m; k++) {
        const struct sculpt_anchor *a = &g->anchor[k];
        const struct sculpt_passing *on = &a->passing;
        trace += on->llpp - 2.0 * vec_dot(a->x, on->llp) + vec_dot(a->x, a->x) * on->ll;
    }
    return 2.0 * trace / g->n_coordinates;
}

/* --- from tip to root ----------------------------------------------------------------------- */

/* What is left of the anchors beyond an element: Q = B (U, A), and their pull. */
struct sculpt_beyond {
    struct symmetric vv;
    mat3 vw, wv, ww;      /* second index: what it is multiplied with */
    vec3 force, moment;
};

/* Anchors on element j, as seen by the elements before it. Scalars of one lane. */
KERNEL_INLINE void pass_anchor(struct sculpt_beyond *b, const struct sculpt_anchor *a, uint32_t i, int curved)
{
    double x[3] = {a->x.x[i], a->x.y[i], a->x.z[i]}, r[3] = {a->r.x[i], a->r.y[i], a->r.z[i]}, t[3];
    for (int c = 0; c < 3; c++)
        t[c] = curved ? x[c] - r[c] : x[c];
    double along = x[0] * t[0] + x[1] * t[1] + x[2] * t[2];
    b->vv.xx[i] += 1.0, b->vv.yy[i] += 1.0, b->vv.zz[i] += 1.0;
    /* -[x]x */
    b->vw.t.y[i] -= x[2], b->vw.t.z[i] += x[1];
    b->vw.u.x[i] += x[2], b->vw.u.z[i] -= x[0];
    b->vw.v.x[i] -= x[1], b->vw.v.y[i] += x[0];
    /* [t]x */
    b->wv.t.y[i] += t[2], b->wv.t.z[i] -= t[1];
    b->wv.u.x[i] -= t[2], b->wv.u.z[i] += t[0];
    b->wv.v.x[i] += t[1], b->wv.v.y[i] -= t[0];
    /* (x.t) I - x t^T */
    b->ww.t.x[i] += along - x[0] * t[0], b->ww.t.y[i] -= x[1] * t[0], b->ww.t.z[i] -= x[2] * t[0];
    b->ww.u.x[i] -= x[0] * t[1], b->ww.u.y[i] += along - x[1] * t[1], b->ww.u.z[i] -= x[2] * t[1];
    b->ww.v.x[i] -= x[0] * t[2], b->ww.v.y[i] -= x[1] * t[2], b->ww.v.z[i] += along - x[2] * t[2];
    b->force.x[i] += r[0], b->force.y[i] += r[1], b->force.z[i] += r[2];
    b->moment.x[i] += x[1] * r[2] - x[2] * r[1];
    b->moment.y[i] += x[2] * r[0] - x[0] * r[2];
    b->moment.z[i] += x[0] * r[1] - x[1] * r[0];
}

/* The own anchors of an element: what its Q, its diagonal and its gradient have more, in one lane. */
struct sculpt_own {
    mat3 Qv, Qw, diagonal;
    vec3 b;
};

KERNEL_INLINE void add_own(struct sculpt_own *own, const struct sculpt_anchor *a, lane_mask lane, lane_mask curved)
{
    const vec3 none = {lanes_all(0.0), lanes_all(0.0), lanes_all(0.0)};
    vec3 t = vec_sub(a->x, (vec3){lanes_select(curved, a->r.x, none.x), lanes_select(curved, a->r.y, none.y),
                                  lanes_select(curved, a->r.z, none.z)});
    mat3 O = a->own, Qw = cross_mat(t, O);
    mat3 square = {{vec_dot(O.t, O.t), vec_dot(O.t, O.u), vec_dot(O.t, O.v)},
                   {vec_dot(O.u, O.t), vec_dot(O.u, O.u), vec_dot(O.u, O.v)},
                   {vec_dot(O.v, O.t), vec_dot(O.v, O.u), vec_dot(O.v, O.v)}};
    vec3 b = mat_transposed_vec(O, a->r);
    const mat3 *from[3] = {&O, &Qw, &square};
    mat3 *to[3] = {&own->Qv, &own->Qw, &own->diagonal};
    for (int m = 0; m < 3; m++)
        for (int k = 0; k < 9; k++)
            ((real *)to[m])[k] += lanes_select(lane, ((const real *)from[m])[k], lanes_all(0.0));
    own->b = vec_add(own->b, (vec3){lanes_select(lane, b.x, none.x), lanes_select(lane, b.y, none.y), lanes_select(lane, b.z, none.z)});
}

/* D^-1 of a symmetric matrix; *sound is cleared where it is not positive. */
KERNEL_INLINE struct symmetric inverse_of(struct symmetric d, lane_mask *sound)
{
    real xx = d.yy * d.zz - d.yz * d.yz, xy = d.xz * d.yz - d.xy * d.zz, xz = d.xy * d.yz - d.xz * d.yy;
    real minor = d.xx * d.yy - d.xy * d.xy, determinant = d.xx * xx + d.xy * xy + d.xz * xz;
    lane_mask good = (d.xx > 0.0) & (minor > 1e-9 * d.xx * d.yy) & (determinant > 1e-9 * minor * d.zz);
    *sound &= good;
    real scale = 1.0 / lanes_select(good, determinant, lanes_all(1.0));
    return (struct symmetric){scale * xx, scale * xy, scale * xz, scale * (d.xx * d.zz - d.xz * d.xz),
                              scale * (d.xy * d.xz - d.xx * d.yz), scale * minor};
}

/* The factors of H + mu I into the gains and own steps; b^T H^-1 b, the decrease that the model promises. */
KERNEL_INLINE real factor(struct sculpt_group *g, real a, lane_mask curved, lane_mask *sound)
{
    const real zero = lanes_all(0.0);
    const vec3 none = {zero, zero, zero};
    const mat3 nothing = {none, none, none};
    struct sculpt_beyond B = {{zero, zero, zero, zero, zero, zero}, nothing, nothing, nothing, none, none};
    real promise = zero;
    uint32_t event = g->n_events;
    *sound = (lane_mask){-1, -1, -1, -1};
    for (uint32_t j = g->n; j-- > 0;) {
        const mat3 U = g->U[j], A = g->A[j];
        mat3 Qv = mat_add(mat_mul(full_of(B.vv), U), mat_mul(B.vw, A));
        mat3 Qw = mat_add(mat_mul(B.wv, U), mat_mul(B.ww, A));
        struct symmetric D = {
            vec_dot(U.t, Qv.t) + vec_dot(A.t, Qw.t) + a,
            0.5 * (vec_dot(U.t, Qv.u) + vec_dot(A.t, Qw.u) + vec_dot(U.u, Qv.t) + vec_dot(A.u, Qw.t)),
            0.5 * (vec_dot(U.t, Qv.v) + vec_dot(A.t, Qw.v) + vec_dot(U.v, Qv.t) + vec_dot(A.v, Qw.t)),
            vec_dot(U.u, Qv.u) + vec_dot(A.u, Qw.u) + a,
            0.5 * (vec_dot(U.u, Qv.v) + vec_dot(A.u, Qw.v) + vec_dot(U.v, Qv.u) + vec_dot(A.v, Qw.u)),
            vec_dot(U.v, Qv.v) + vec_dot(A.v, Qw.v) + a};
        vec3 pull = vec_add(mat_transposed_vec(U, B.force), mat_transposed_vec(A, B.moment));
        vec3 b = vec_sub(vec_scale(g->c, vec_sub(g->rest[j], g->q[j])), pull);
        uint32_t first = event;
        if (event > 0 && g->event[event - 1].element == j) {
            struct sculpt_own own = {nothing, nothing, nothing, none};
            for (; first > 0 && g->event[first - 1].element == j; first--) {
                const struct sculpt_event *e = &g->event[first - 1];
                lane_mask lane = {0, 0, 0, 0};
                lane[e->lane] = -1;
                add_own(&own, &g->anchor[e->anchor], lane, curved);
            }
            Qv = mat_add(Qv, own.Qv);
            Qw = mat_add(Qw, own.Qw);
            D.xx += own.diagonal.t.x, D.xy += own.diagonal.t.y, D.xz += own.diagonal.t.z;
            D.yy += own.diagonal.u.y, D.yz += own.diagonal.u.z, D.zz += own.diagonal.v.z;
            b = vec_sub(b, own.b);
        }
        mat3 inverse = full_of(inverse_of(D, sound));
        vec3 k = mat_vec(inverse, b);
        mat3 Zv = mat_mul(Qv, inverse), Zw = mat_mul(Qw, inverse);
        promise += vec_dot(k, b);
        g->own_step[j].x = k.x, g->own_step[j].y = k.y, g->own_step[j].z = k.z;
        g->gain_v[j].t = Zv.t, g->gain_v[j].u = Zv.u, g->gain_v[j].v = Zv.v;
        g->gain_w[j].t = Zw.t, g->gain_w[j].u = Zw.u, g->gain_w[j].v = Zw.v;
        B.force = vec_add(B.force, mat_vec(Qv, k));
        B.moment = vec_add(B.moment, mat_vec(Qw, k));
        B.vv.xx -= Zv.t.x * Qv.t.x + Zv.u.x * Qv.u.x + Zv.v.x * Qv.v.x;
        B.vv.xy -= Zv.t.x * Qv.t.y + Zv.u.x * Qv.u.y + Zv.v.x * Qv.v.y;
        B.vv.xz -= Zv.t.x * Qv.t.z + Zv.u.x * Qv.u.z + Zv.v.x * Qv.v.z;
        B.vv.yy -= Zv.t.y * Qv.t.y + Zv.u.y * Qv.u.y + Zv.v.y * Qv.v.y;
        B.vv.yz -= Zv.t.y * Qv.t.z + Zv.u.y * Qv.u.z + Zv.v.y * Qv.v.z;
        B.vv.zz -= Zv.t.z * Qv.t.z + Zv.u.z * Qv.u.z + Zv.v.z * Qv.v.z;
        subtract_product(&B.vw, &Zv, &Qw);
        subtract_product(&B.wv, &Qw, &Zv);
        subtract_product(&B.ww, &Zw, &Qw);
        for (; event > first; event--) {
            const struct sculpt_event *e = &g->event[event - 1];
            pass_anchor(&B, &g->anchor[e->anchor], e->lane, curved[e->lane] != 0);
        }
    }
    return promise;
}

/* --- from root to tip ------------------------------------------------------------------------- */

/* The step, and how far it turns the strand. */
KERNEL_INLINE real find_step(struct sculpt_group *g)
{
    const real zero = lanes_all(0.0);
    vec3 v = {zero, zero, zero}, w = v;
    real turning = zero;
    for (uint32_t j = 0; j < g->n; j++) {
        vec3 d = vec_sub(g->own_step[j], vec_add(mat_transposed_vec(g->gain_v[j], v), mat_transposed_vec(g->gain_w[j], w)));
        v = vec_add(v, mat_vec(g->U[j], d));
        w = vec_add(w, mat_vec(g->A[j], d));
        turning += lanes_sqrt(vec_dot(d, d)) * g->length[j];
        g->step[j].x = d.x, g->step[j].y = d.y, g->step[j].z = d.z;
    }
    return turning;
}

/* --- the iteration ------------------------------------------------------------------------------ */

/* Nielsen: the damping follows how good the model was. */
KERNEL_INLINE void change_damping(struct sculpt_group *g, lane_mask tried, lane_mask better, real gain)
{
    real bend = 2.0 * gain - 1.0, shrink = 1.0 - bend * bend * bend;
    shrink = lanes_select(shrink > 0.2, shrink, lanes_all(0.2));
    shrink = lanes_select(gain > 0.9, lanes_all(0.05), shrink);
    g->mu = lanes_select(tried, g->mu * lanes_select(better, shrink, g->grow), g->mu);
    g->grow = lanes_select(tried, lanes_select(better, lanes_all(3.0), g->grow * 2.0), g->grow);
}

/* q = trial where it is better. */
KERNEL_INLINE void take_step(struct sculpt_group *g, lane_mask better)
{
    for (uint32_t j = 0; j < g->n; j++)
        g->q[j] = vec_select(better, g->trial[j], g->q[j]);
}

/* A direction from the sums at hand into g->step; the decrease of the energy that its model promises. No step turns
 * the strand by more than `most`: beyond it the model means nothing, and hard targets would throw the strand into
 * worse minima than small steps find. *share: what of the step is taken. */
KERNEL_INLINE real plan_step(struct sculpt_group *g, double most, real *share)
{
    real mean = mean_diagonal(g), least = mean * LEAST_DAMPING + 1e-300, cap = lanes_all(most);
    lane_mask sound;
    g->mu = lanes_select(g->mu < 0.0, mean * FIRST_DAMPING, g->mu);
    g->mu = lanes_select(g->mu < least, least, g->mu);
    real promise = factor(g, g->c + g->mu, g->curved, &sound);
    if (lanes_any(g->curved & ~sound & g->active)) {
        g->curved &= sound;
        promise = factor(g, g->c + g->mu, g->curved, &sound);
    }
    real turning = find_step(g);
    *share = lanes_select(turning > cap, cap / turning, lanes_all(1.0));
    return (2.0 - *share) * *share * promise;
}

/* Lanes work through the queue: as soon as one is done its result goes out and the next strand comes in
 * (`fresh`), whose first energy is found in the same pass that tries the others' steps. */
void SCULPT_KERNEL(struct sculpt_group *g, const struct sculpt_settings *set)
{
    for (;;) {
        real share, predicted = plan_step(g, set->most_turning, &share);
        lane_mask going = (predicted > set->tolerance * g->energy) & (g->energy > g->least_energy);
        g->converged = g->active & ~going;
        g->active &= going & (g->iterations < (double)set->n_steps);
        sculpt_group_exchange(g);
        if (!lanes_any(g->active))
            return;
        lane_mask tried = g->active & ~g->fresh;
        real after = linearise(g, g->q, g->trial, tried, share);
        lane_mask better = tried & (after < g->energy);
        change_damping(g, tried, better, (g->energy - after) / predicted);
        take_step(g, better);
        g->energy_before = lanes_select(g->fresh, after, g->energy_before);
        g->energy = lanes_select(better | g->fresh, after, g->energy);
        g->iterations += lanes_select(tried, lanes_all(1.0), lanes_all(0.0));
        g->curved = better;
        if (lanes_any(tried & ~better))
            linearise(g, g->q, g->q, (lane_mask){0}, share); /* a step back: the sums are of the trial */
    }
}

#endif
