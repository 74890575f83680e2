/* The solver of Eq. 15 on four strands at once: the text that is compiled once per instruction set.
 * The including file defines SCULPT_KERNEL, the name of the function.
 *
 * With r = x - a and y = q - rest, half the downhill gradient is b = -(J^T r + c y), and the damped
 * Gauss-Newton (Levenberg-Marquardt) step is H b with H = (J^T J + a I)^-1, a = c + mu. For 3M anchor
 * coordinates and 3N curvatures H is cheaper by the 3M x 3M system:
 *   H v = (v - J^T (J J^T + a I)^-1 J v) / a.
 * With A_j = F_j l_j V_j and U_j = F_j D_j + [p_(j+1)]x A_j, the block of an anchor at x on a later
 * element is J_j = U_j - [x]x A_j: J J^T needs only running sums of U U^T, A U^T and A A^T, so J is never
 * stored. Points are relative to the root.
 *
 * Anchors that stay out of reach leave large residuals, where Gauss-Newton alone creeps: so H is only
 * the start of an L-BFGS recursion over the last few steps, which finds the missing curvature. A step
 * uphill drops that memory and raises mu. */
#ifndef CURVATURE_SCULPT_KERNEL_H
#define CURVATURE_SCULPT_KERNEL_H

#include "curvature/sculpt_group.h"

#define KERNEL_INLINE CURVATURE_INLINE

/* The first damping, and the least, as shares of the mean diagonal of J J^T. */
#define FIRST_DAMPING 1e-3
#define LEAST_DAMPING 1e-8

/* --- small matrices ------------------------------------------------------------------- */

/* m += a b^T: columns by the components of b */
KERNEL_INLINE void add_product(mat3 *m, const mat3 *a, const mat3 *b)
{
    m->t = vec_add(m->t, vec_add(vec_add(vec_scale(b->t.x, a->t), vec_scale(b->u.x, a->u)), vec_scale(b->v.x, a->v)));
    m->u = vec_add(m->u, vec_add(vec_add(vec_scale(b->t.y, a->t), vec_scale(b->u.y, a->u)), vec_scale(b->v.y, a->v)));
    m->v = vec_add(m->v, vec_add(vec_add(vec_scale(b->t.z, a->t), vec_scale(b->u.z, a->u)), vec_scale(b->v.z, a->v)));
}

/* m += a a^T, six numbers */
KERNEL_INLINE void add_square(struct symmetric *m, const mat3 *a)
{
    m->xx += a->t.x * a->t.x + a->u.x * a->u.x + a->v.x * a->v.x;
    m->xy += a->t.x * a->t.y + a->u.x * a->u.y + a->v.x * a->v.y;
    m->xz += a->t.x * a->t.z + a->u.x * a->u.z + a->v.x * a->v.z;
    m->yy += a->t.y * a->t.y + a->u.y * a->u.y + a->v.y * a->v.y;
    m->yz += a->t.y * a->t.z + a->u.y * a->u.z + a->v.y * a->v.z;
    m->zz += a->t.z * a->t.z + a->u.z * a->u.z + a->v.z * a->v.z;
}

KERNEL_INLINE mat3 full_of(struct symmetric m)
{
    return (mat3){{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}};
}

/* m [x]x */
KERNEL_INLINE mat3 mat_cross(mat3 m, vec3 x)
{
    return (mat3){vec_sub(vec_scale(x.z, m.u), vec_scale(x.y, m.v)), vec_sub(vec_scale(x.x, m.v), vec_scale(x.z, m.t)),
                  vec_sub(vec_scale(x.y, m.t), vec_scale(x.x, m.u))};
}

KERNEL_INLINE mat3 mat_transposed(mat3 m)
{
    return (mat3){{m.t.x, m.u.x, m.v.x}, {m.t.y, m.u.y, m.v.y}, {m.t.z, m.u.z, m.v.z}};
}

KERNEL_INLINE mat3 mat_sub(mat3 a, mat3 b)
{
    return (mat3){vec_sub(a.t, b.t), vec_sub(a.u, b.u), vec_sub(a.v, b.v)};
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

/* Everything that a step needs, at q; returns the energy. */
KERNEL_INLINE real linearise(struct sculpt_group *g, const vec3 *q)
{
    const real zero = lanes_all(0.0);
    const vec3 none = {zero, zero, zero};
    /* plain locals, not one struct: they stay in registers */
    vec3 p = none;
    mat3 F = {g->root.t, g->root.u, g->root.v}, AU = {none, none, none};
    struct symmetric UU = {zero, zero, zero, zero, zero, zero}, AA = UU;
    real deviation = zero, miss = zero;
    uint32_t event = 0;
    for (uint32_t j = 0; j < g->n; j++) {
        vec3 qj = q[j], y = vec_sub(qj, g->rest[j]);
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
            struct sculpt_passing now = {p, F, qj, A, U, UU, AA, AU};
            meet_anchors(g, &event, j, &now);
        }
        add_square(&UU, &U);
        add_product(&AU, &A, &U);
        add_square(&AA, &A);
        F = mat_mul(F, element_turn(f.A, f.B, x, theta));
        p = end;
    }
    for (uint32_t k = 0; k < g->m; k++)
        miss += finish_anchor(&g->anchor[k]);
    return miss + g->c * deviation;
}

/* --- the small system --------------------------------------------------------------------- */

/* Block (k, m) of J J^T, k not after m: the elements before k's, and k's own. */
KERNEL_INLINE mat3 normal_block(const struct sculpt_anchor *k, const struct sculpt_anchor *m)
{
    const struct sculpt_passing *on = &k->passing;
    mat3 W = mat_add(on->AU, mat_cross(full_of(on->AA), m->x));
    mat3 sum = mat_add(full_of(on->UU), mat_sub(mat_cross(mat_transposed(on->AU), m->x), cross_mat(k->x, W)));
    /* m on a later element sees k's as any other; on the same one, as its own */
    mat3 passing = mat_sub(on->U, cross_mat(m->x, on->A)), other;
    lane_mask same = m->element == k->element;
    const real *a = (const real *)&m->own, *b = (const real *)&passing;
    real *o = (real *)&other;
    for (int i = 0; i < 9; i++)
        o[i] = lanes_select(same, a[i], b[i]);
    add_product(&sum, &k->own, &other);
    return sum;
}

/* The lower triangle of J J^T, and the mean of its diagonal. */
KERNEL_INLINE real fill_normal(struct sculpt_group *g)
{
    size_t width = 3 * (size_t)g->m;
    real trace = lanes_all(0.0);
    for (uint32_t m = 0; m < g->m; m++)
        for (uint32_t k = 0; k <= m; k++) {
            mat3 block = normal_block(&g->anchor[k], &g->anchor[m]); /* rows k, columns m */
            const real *b = (const real *)&block;
            for (size_t c = 0; c < 3; c++)
                for (size_t r = 0; r < 3; r++)
                    g->normal[(3 * m + c) * width + 3 * k + r] = b[3 * c + r];
            if (k == m)
                trace += block.t.x + block.u.y + block.v.z;
        }
    return trace / g->n_coordinates;
}

/* Cholesky of normal + ridge, 1/diagonal on the diagonal. */
KERNEL_INLINE void factor_normal(struct sculpt_group *g, real ridge)
{
    size_t n = 3 * (size_t)g->m;
    real *L = g->factor;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k <= i; k++) {
            real sum = g->normal[i * n + k];
            if (i == k)
                sum += ridge;
            for (size_t j = 0; j < k; j++)
                sum -= L[i * n + j] * L[k * n + j];
            L[i * n + k] = i == k ? 1.0 / lanes_sqrt(lanes_select(sum > ridge, sum, ridge)) : sum * L[k * n + k];
        }
}

/* w = (normal + ridge)^-1 w */
KERNEL_INLINE void solve_normal(struct sculpt_group *g)
{
    size_t n = 3 * (size_t)g->m;
    const real *L = g->factor;
    real *w = g->w;
    for (size_t i = 0; i < n; i++) {
        real sum = w[i];
        for (size_t j = 0; j < i; j++)
            sum -= L[i * n + j] * w[j];
        w[i] = sum * L[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        real sum = w[i];
        for (size_t j = i + 1; j < n; j++)
            sum -= L[j * n + i] * w[j];
        w[i] = sum * L[i * n + i];
    }
}

/* --- products with J ------------------------------------------------------------------------ */

KERNEL_INLINE void add_lane(vec3 *to, const vec3 *from, uint32_t lane)
{
    to->x[lane] += from->x[lane], to->y[lane] += from->y[lane], to->z[lane] += from->z[lane];
}

/* w = J v */
KERNEL_INLINE void apply_J(struct sculpt_group *g, const vec3 *v)
{
    vec3 Uv = {lanes_all(0.0), lanes_all(0.0), lanes_all(0.0)}, Av = Uv;
    uint32_t event = 0;
    for (uint32_t j = 0; j < g->n; j++) {
        for (; event < g->n_events && g->event[event].element == j; event++) {
            const struct sculpt_event *e = &g->event[event];
            const struct sculpt_anchor *a = &g->anchor[e->anchor];
            vec3 *w = (vec3 *)&g->w[3 * e->anchor];
            vec3 sum = vec_add(vec_sub(Uv, vec_cross(a->x, Av)), mat_vec(a->own, v[j]));
            copy_lane(w, &sum, 3, e->lane);
        }
        Uv = vec_add(Uv, mat_vec(g->U[j], v[j]));
        Av = vec_add(Av, mat_vec(g->A[j], v[j]));
    }
}

/* v = scale (minus J^T w + keep v), tip to root with the force and the moment of all anchors beyond. */
KERNEL_INLINE void apply_J_transposed(struct sculpt_group *g, vec3 *v, const vec3 *keep, real factor, real scale)
{
    vec3 n = {lanes_all(0.0), lanes_all(0.0), lanes_all(0.0)}, m = n;
    uint32_t event = g->n_events;
    for (uint32_t j = g->n; j-- > 0;) {
        vec3 sum = vec_add(mat_transposed_vec(g->U[j], n), mat_transposed_vec(g->A[j], m));
        for (; event > 0 && g->event[event - 1].element == j; event--) {
            const struct sculpt_event *e = &g->event[event - 1];
            const struct sculpt_anchor *a = &g->anchor[e->anchor];
            const vec3 *w = (const vec3 *)&g->w[3 * e->anchor];
            vec3 own = mat_transposed_vec(a->own, *w), moment = vec_cross(a->x, *w);
            add_lane(&sum, &own, e->lane);
            add_lane(&n, w, e->lane);
            add_lane(&m, &moment, e->lane);
        }
        v[j] = vec_scale(scale, vec_sub(vec_scale(factor, keep[j]), sum));
    }
}

/* --- the direction ------------------------------------------------------------------------------ */

KERNEL_INLINE real dot_all(const vec3 *a, const vec3 *b, uint32_t n)
{
    real sum = lanes_all(0.0);
    for (uint32_t j = 0; j < n; j++)
        sum += vec_dot(a[j], b[j]);
    return sum;
}

KERNEL_INLINE void add_all(vec3 *a, real s, const vec3 *b, uint32_t n)
{
    for (uint32_t j = 0; j < n; j++)
        a[j] = vec_add(a[j], vec_scale(s, b[j]));
}

/* b into g->down */
KERNEL_INLINE void find_downhill(struct sculpt_group *g)
{
    for (uint32_t k = 0; k < g->m; k++)
        memcpy(&g->w[3 * k], &g->anchor[k].r, sizeof g->anchor[k].r);
    for (uint32_t j = 0; j < g->n; j++)
        g->step[j] = vec_sub(g->rest[j], g->q[j]);
    apply_J_transposed(g, g->down, g->step, g->c, lanes_all(1.0));
}

/* The last step and the change of b over it, into the next place of the memory; lanes that did not move
 * or bend the wrong way leave it without effect (rho 0). */
KERNEL_INLINE void remember(struct sculpt_group *g, lane_mask moved, const vec3 *before)
{
    uint32_t at = g->newest = (g->newest + 1) % SCULPT_MEMORY;
    vec3 *s = g->moves + (size_t)at * g->n, *y = g->changes + (size_t)at * g->n;
    real ss = lanes_all(0.0), yy = ss, sy = ss;
    for (uint32_t j = 0; j < g->n; j++) {
        s[j] = g->moved[j];
        y[j] = vec_sub(before[j], g->down[j]);
        ss += vec_dot(s[j], s[j]), yy += vec_dot(y[j], y[j]), sy += vec_dot(s[j], y[j]);
    }
    lane_mask sound = moved & (sy > 0.0) & (sy * sy > 1e-20 * ss * yy);
    g->rho[at] = lanes_select(sound, 1.0 / lanes_select(sound, sy, lanes_all(1.0)), lanes_all(0.0));
}

/* step = H b by the two loops of L-BFGS around the damped Gauss-Newton inverse. */
KERNEL_INLINE void find_step(struct sculpt_group *g, real a)
{
    real alpha[SCULPT_MEMORY];
    uint32_t n = g->n;
    memcpy(g->step, g->down, n * sizeof *g->step);
    for (uint32_t i = 0; i < SCULPT_MEMORY; i++) {
        uint32_t at = (g->newest + SCULPT_MEMORY - i) % SCULPT_MEMORY;
        alpha[at] = g->rho[at] * dot_all(g->moves + (size_t)at * n, g->step, n);
        add_all(g->step, -alpha[at], g->changes + (size_t)at * n, n);
    }
    apply_J(g, g->step);
    solve_normal(g);
    apply_J_transposed(g, g->step, g->step, lanes_all(1.0), 1.0 / a);
    for (uint32_t i = SCULPT_MEMORY; i-- > 0;) {
        uint32_t at = (g->newest + SCULPT_MEMORY - i) % SCULPT_MEMORY;
        real beta = g->rho[at] * dot_all(g->changes + (size_t)at * n, g->step, n);
        add_all(g->step, alpha[at] - beta, g->moves + (size_t)at * n, n);
    }
}

/* No step turns the strand farther than this: beyond it the model means nothing, and hard targets
 * would throw the strand into worse minima than small steps find. Returns the share taken. */
KERNEL_INLINE real cap_turning(const struct sculpt_group *g, double most)
{
    real turning = lanes_all(0.0), cap = lanes_all(most);
    for (uint32_t j = 0; j < g->n; j++)
        turning += lanes_sqrt(vec_dot(g->step[j], g->step[j])) * g->length[j];
    return lanes_select(turning > cap, cap / turning, lanes_all(1.0));
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

KERNEL_INLINE vec3 vec_select(lane_mask which, vec3 a, vec3 b)
{
    return (vec3){lanes_select(which, a.x, b.x), lanes_select(which, a.y, b.y), lanes_select(which, a.z, b.z)};
}

/* q = trial where it is better. */
KERNEL_INLINE void take_step(struct sculpt_group *g, lane_mask better)
{
    for (uint32_t j = 0; j < g->n; j++) {
        vec3 q = vec_select(better, g->trial[j], g->q[j]);
        g->moved[j] = vec_sub(q, g->q[j]);
        g->q[j] = q;
    }
}

KERNEL_INLINE void forget(struct sculpt_group *g, lane_mask which)
{
    for (uint32_t i = 0; i < SCULPT_MEMORY; i++)
        g->rho[i] = lanes_select(which, lanes_all(0.0), g->rho[i]);
}

/* The damping for the sums at hand; also factors the small system. Returns a = c + mu. */
KERNEL_INLINE real prepare_inverse(struct sculpt_group *g)
{
    real mean = fill_normal(g);
    real least = mean * LEAST_DAMPING + 1e-300;
    g->mu = lanes_select(g->mu < 0.0, mean * FIRST_DAMPING, g->mu);
    g->mu = lanes_select(g->mu < least, least, g->mu);
    real a = g->c + g->mu;
    factor_normal(g, a);
    return a;
}

/* A direction from the sums at hand into g->step; the decrease of the energy that its model promises. */
KERNEL_INLINE real plan_step(struct sculpt_group *g, lane_mask moved, const struct sculpt_settings *set, real *share)
{
    vec3 *before = g->trial; /* not needed between steps */
    memcpy(before, g->down, g->n * sizeof *before);
    find_downhill(g);
    if (lanes_any(moved))
        remember(g, moved, before);
    real a = prepare_inverse(g);
    find_step(g, a);
    *share = cap_turning(g, set->most_turning);
    return (2.0 - *share) * *share * dot_all(g->step, g->down, g->n);
}

/* Lanes work through the queue: as soon as one is done its result goes out and the next strand comes in
 * (`fresh`), whose first energy is found in the same pass that tries the others' steps. */
void SCULPT_KERNEL(struct sculpt_group *g, const struct sculpt_settings *set)
{
    lane_mask moved = (lane_mask)lanes_all(0.0);
    for (;;) {
        real share, predicted = plan_step(g, moved, set, &share);
        lane_mask going = (predicted > set->tolerance * g->energy) & (g->energy > g->least_energy);
        g->converged = g->active & ~going;
        g->active &= going & (g->iterations < (double)set->n_steps);
        sculpt_group_exchange(g);
        if (!lanes_any(g->active))
            return;
        lane_mask tried = g->active & ~g->fresh;
        for (uint32_t j = 0; j < g->n; j++)
            g->trial[j] = vec_select(tried, vec_add(g->q[j], vec_scale(share, g->step[j])), g->q[j]);
        real after = linearise(g, g->trial);
        lane_mask better = tried & (after < g->energy);
        change_damping(g, tried, better, (g->energy - after) / predicted);
        take_step(g, better);
        g->energy_before = lanes_select(g->fresh, after, g->energy_before);
        g->energy = lanes_select(better | g->fresh, after, g->energy);
        g->iterations += lanes_select(tried, lanes_all(1.0), lanes_all(0.0));
        forget(g, ~better);
        if (lanes_any(tried & ~better))
            linearise(g, g->q); /* a step back: the sums are of the trial */
        moved = better;
    }
}

#endif
