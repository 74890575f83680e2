#include "curvature/refine.h"

#include <math.h>
#include <string.h>

/* A rigid motion about the root: x moves by shift + turn x x. Kept as 6 numbers, turn first. In these
 * coordinates a motion of an element's begin carries everything beyond along unchanged. */

/* The quadratic 1/2 y^T P y + h^T y of a motion y, lower triangle used. */
struct quadratic {
    double P[6][6], h[6];
};

double refine_measure(struct refine_strand *strand, double *worst)
{
    struct chain_state at = {{0.0, 0.0, 0.0}, strand->root};
    double sum = 0.0, most = 0.0;
    uint32_t k = 0;
    for (uint32_t j = 0; j < strand->n_elements; j++) {
        vec3 q = vec_of(strand->q[j]);
        for (; k < strand->n_vertices && strand->element[k] == j; k++) {
            strand->fitted[k] = chain_point(at, q, strand->fraction[k] * strand->length[j]);
            vec3 miss = vec_sub(strand->fitted[k], strand->vertex[k]);
            double square = vec_dot(miss, miss);
            sum += square;
            most = square > most ? square : most;
        }
        at = chain_step(at, q, strand->length[j]);
    }
    *worst = sqrt(most);
    return sum;
}

/* --- one element ------------------------------------------------------------------ */

/* A vertex seen from the element's controls: columns d/dq and d/dlength. */
struct sight {
    vec3 column[4];
};

static struct sight sight_of(const struct chain_state *at, vec3 q, double length, double fraction,
                             vec3 *point)
{
    double s = fraction * length;
    vec3 theta = vec_scale(s, q);
    double x = vec_dot(theta, theta);
    trig5 f = trig5_of(x);
    mat3 D = mat_mul(at->F, element_derivative(f, x, theta, s));
    *point = vec_add(at->p, mat_vec(at->F, vec_scale(s, element_chord(f.B, f.C, x, theta))));
    vec3 tangent = mat_vec(at->F, element_turn(f.A, f.B, x, theta).t);
    return (struct sight){{D.t, D.u, D.v, vec_scale(fraction, tangent)}};
}

static void put_column(double control[6][4], int c, vec3 turn, vec3 shift)
{
    control[0][c] = turn.x, control[1][c] = turn.y, control[2][c] = turn.z;
    control[3][c] = shift.x, control[4][c] = shift.y, control[5][c] = shift.z;
}

/* What the controls of an element do to all that lies beyond it: the end turns by l F V dq + Omega dl
 * and moves; as a motion about the root, shift = move - turn x p_end. */
static struct chain_state fill_control(const struct chain_state *at, vec3 q, double l, double control[6][4])
{
    vec3 theta = vec_scale(l, q);
    double x = vec_dot(theta, theta);
    trig5 f = trig5_of(x);
    mat3 V = element_mean(f.B, f.C, x, theta);
    mat3 turn = mat_scale(l, mat_mul(at->F, V)), move = mat_mul(at->F, element_derivative(f, x, theta, l));
    struct chain_state end = {vec_add(at->p, turn.t), mat_mul(at->F, element_turn(f.A, f.B, x, theta))};
    vec3 omega = mat_vec(at->F, q);
    put_column(control, 0, turn.t, vec_sub(move.t, vec_cross(turn.t, end.p)));
    put_column(control, 1, turn.u, vec_sub(move.u, vec_cross(turn.u, end.p)));
    put_column(control, 2, turn.v, vec_sub(move.v, vec_cross(turn.v, end.p)));
    put_column(control, 3, omega, vec_sub(end.F.t, vec_cross(omega, end.p)));
    return end;
}

/* The 11 columns of a small least-squares problem: motion, controls, constant. */
struct stage {
    double mm[6][6], mc[6][4], cc[4][4], m[6], c[4];
};

static void stage_begin(struct stage *g, const struct quadratic *beyond, const double control[6][4],
                        double damping, double length)
{
    memcpy(g->mm, beyond->P, sizeof g->mm);
    memcpy(g->m, beyond->h, sizeof g->m);
    for (int i = 0; i < 6; i++)
        for (int c = 0; c < 4; c++) {
            double sum = 0.0;
            for (int k = 0; k < 6; k++)
                sum += beyond->P[i][k] * control[k][c];
            g->mc[i][c] = sum;
        }
    for (int c = 0; c < 4; c++) {
        g->c[c] = 0.0;
        for (int k = 0; k < 6; k++)
            g->c[c] += control[k][c] * beyond->h[k];
        for (int d = 0; d <= c; d++) {
            double sum = 0.0;
            for (int k = 0; k < 6; k++)
                sum += control[k][c] * g->mc[k][d];
            g->cc[c][d] = sum;
        }
        /* a radian of turning weighs as much as its length; lengths stay near what they were */
        g->cc[c][c] += c < 3 ? damping * length * length * length * length : 10.0 * damping;
    }
}

/* Add a vertex at x that misses its mark by r. */
static void stage_add(struct stage *g, const struct sight *see, vec3 x, vec3 r)
{
    double xx = vec_dot(x, x);
    vec3 xr = vec_cross(x, r);
    g->mm[0][0] += xx - x.x * x.x, g->mm[1][1] += xx - x.y * x.y, g->mm[2][2] += xx - x.z * x.z;
    g->mm[1][0] -= x.x * x.y, g->mm[2][0] -= x.x * x.z, g->mm[2][1] -= x.y * x.z;
    for (int i = 3; i < 6; i++)
        g->mm[i][i] += 1.0;
    g->mm[3][1] += x.z, g->mm[3][2] -= x.y, g->mm[4][0] -= x.z; /* rows shift, columns turn: -[x]x */
    g->mm[4][2] += x.x, g->mm[5][0] += x.y, g->mm[5][1] -= x.x;
    g->m[0] += xr.x, g->m[1] += xr.y, g->m[2] += xr.z;
    g->m[3] += r.x, g->m[4] += r.y, g->m[5] += r.z;
    for (int c = 0; c < 4; c++) {
        vec3 w = see->column[c], xw = vec_cross(x, w);
        g->mc[0][c] += xw.x, g->mc[1][c] += xw.y, g->mc[2][c] += xw.z;
        g->mc[3][c] += w.x, g->mc[4][c] += w.y, g->mc[5][c] += w.z;
        g->c[c] += vec_dot(w, r);
        for (int d = 0; d <= c; d++)
            g->cc[c][d] += vec_dot(w, see->column[d]);
    }
}

/* Cholesky of the lower triangle in place, 1/diagonal on the diagonal. 0 where it is not positive. */
static int factor(double *a, int n)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k <= i; k++) {
            double sum = a[i * n + k];
            for (int j = 0; j < k; j++)
                sum -= a[i * n + j] * a[k * n + j];
            if (i != k)
                a[i * n + k] = sum * a[k * n + k];
            else if (sum > 0.0)
                a[i * n + i] = 1.0 / sqrt(sum);
            else
                return 0;
        }
    return 1;
}

/* Minimise over the controls: the gains, and the quadratic that is left for the motion of the begin. */
static int stage_eliminate(struct stage *g, double gain[4][7], struct quadratic *left)
{
    double half[4][7]; /* L^-1 [mc^T | c] */
    if (!factor(&g->cc[0][0], 4))
        return 0;
    for (int c = 0; c < 4; c++)
        for (int i = 0; i < 7; i++) {
            double sum = i < 6 ? g->mc[i][c] : g->c[c];
            for (int d = 0; d < c; d++)
                sum -= g->cc[c][d] * half[d][i];
            half[c][i] = sum * g->cc[c][c];
        }
    for (int c = 3; c >= 0; c--)
        for (int i = 0; i < 7; i++) {
            double sum = half[c][i];
            for (int d = c + 1; d < 4; d++)
                sum -= g->cc[d][c] * gain[d][i];
            gain[c][i] = sum * g->cc[c][c];
        }
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k <= i; k++) {
            double sum = g->mm[i][k];
            for (int c = 0; c < 4; c++)
                sum -= half[c][i] * half[c][k];
            left->P[i][k] = left->P[k][i] = sum;
        }
        left->h[i] = g->m[i];
        for (int c = 0; c < 4; c++)
            left->h[i] -= half[c][i] * half[c][6];
    }
    return 1;
}

/* --- the whole strand ---------------------------------------------------------------- */

static void walk_junctions(const struct refine_strand *strand, const struct refine_space *space)
{
    struct chain_state at = {{0.0, 0.0, 0.0}, strand->root};
    for (uint32_t j = 0; j < strand->n_elements; j++) {
        space->junction[j] = at;
        at = fill_control(&at, vec_of(strand->q[j]), strand->length[j], space->element[j].control);
    }
}

/* Tip to root. 0 where the damping is too small for the arithmetic. */
static int eliminate(const struct refine_strand *strand, const struct refine_space *space, double damping,
                     struct quadratic *value)
{
    uint32_t k = strand->n_vertices;
    memset(value, 0, sizeof *value);
    for (uint32_t j = strand->n_elements; j-- > 0;) {
        struct refine_element *e = &space->element[j];
        vec3 q = vec_of(strand->q[j]), x;
        struct stage g;
        stage_begin(&g, value, (const double (*)[4])e->control, damping, strand->length[j]);
        for (; k > 0 && strand->element[k - 1] == j; k--) {
            struct sight see = sight_of(&space->junction[j], q, strand->length[j], strand->fraction[k - 1], &x);
            stage_add(&g, &see, x, vec_sub(x, strand->vertex[k - 1]));
        }
        if (!stage_eliminate(&g, e->gain, value))
            return 0;
    }
    return 1;
}

/* The best turn of the root frame; the root point stays. */
static int root_turn(const struct quadratic *value, double damping, double turn[3])
{
    double a[3][3], half[3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            a[i][k] = value->P[i][k] + (i == k) * damping * (value->P[i][i] + 1e-30);
    if (!factor(&a[0][0], 3))
        return 0;
    for (int i = 0; i < 3; i++) {
        half[i] = -value->h[i];
        for (int k = 0; k < i; k++)
            half[i] -= a[i][k] * half[k];
        half[i] *= a[i][i];
    }
    for (int i = 2; i >= 0; i--) {
        turn[i] = half[i];
        for (int k = i + 1; k < 3; k++)
            turn[i] -= a[k][i] * turn[k];
        turn[i] *= a[i][i];
    }
    return 1;
}

static mat3 turned(mat3 F, const double turn[3])
{
    vec3 w = vec_of(turn);
    double x = vec_dot(w, w);
    trig3 f = trig3_of(x);
    return frame_mend(mat_mul(element_turn(f.A, f.B, x, w), F));
}

/* The motion that has taken a junction from where it was to where it is. */
static void motion_between(const struct chain_state *was, const struct chain_state *is, double motion[6])
{
    vec3 turn = vec_add(vec_cross(was->F.t, is->F.t), vec_add(vec_cross(was->F.u, is->F.u),
                                                              vec_cross(was->F.v, is->F.v)));
    turn = vec_scale(0.5, turn);
    vec3 shift = vec_sub(vec_sub(is->p, was->p), vec_cross(turn, was->p));
    vec_store(turn, motion);
    vec_store(shift, motion + 3);
}

/* Root to tip: each element answers the motion that has reached it. It is the motion that has really
 * come about, not its linear forecast: small turns add up over a long lever, and this feedback keeps
 * their second order from doing so. */
static void apply(struct refine_strand *strand, const struct refine_space *space, const double turn[3])
{
    strand->root = turned(strand->root, turn);
    struct chain_state at = {{0.0, 0.0, 0.0}, strand->root};
    for (uint32_t j = 0; j < strand->n_elements; j++) {
        const struct refine_element *e = &space->element[j];
        double motion[6], w[4], l = strand->length[j];
        motion_between(&space->junction[j], &at, motion);
        for (int c = 0; c < 4; c++) {
            w[c] = -e->gain[c][6];
            for (int i = 0; i < 6; i++)
                w[c] -= e->gain[c][i] * motion[i];
        }
        for (int c = 0; c < 3; c++)
            strand->q[j][c] += w[c];
        strand->length[j] = fmin(fmax(l + w[3], 0.5 * l), 2.0 * l);
        at = chain_step(at, vec_of(strand->q[j]), strand->length[j]);
    }
}

static void keep(const struct refine_strand *strand, double *kept)
{
    memcpy(kept, strand->length, strand->n_elements * sizeof *kept);
    memcpy(kept + strand->n_elements, strand->q, strand->n_elements * sizeof *strand->q);
}

static void restore(struct refine_strand *strand, const double *kept, mat3 root)
{
    memcpy(strand->length, kept, strand->n_elements * sizeof *kept);
    memcpy(strand->q, kept + strand->n_elements, strand->n_elements * sizeof *strand->q);
    strand->root = root;
}

/* One damped step; 1 where it went downhill. */
static int try_step(struct refine_strand *strand, const struct refine_space *space, double damping,
                    double *sum, double *worst)
{
    struct quadratic value;
    double turn[3], far;
    mat3 root = strand->root;
    keep(strand, space->kept);
    walk_junctions(strand, space);
    if (!eliminate(strand, space, damping, &value) || !root_turn(&value, damping, turn))
        return 0;
    apply(strand, space, turn);
    double after = refine_measure(strand, &far);
    if (!(after < *sum)) { /* NaN counts as uphill */
        restore(strand, space->kept, root);
        return 0;
    }
    *sum = after;
    *worst = far;
    return 1;
}

double refine_fit(struct refine_strand *strand, const struct refine_space *space, uint32_t n_steps,
                  double tolerance, double *worst)
{
    double sum = refine_measure(strand, worst), damping = 1e-3;
    uint32_t failures = 0;
    for (uint32_t step = 0; step < n_steps && *worst > tolerance && failures < 4; step++) {
        double before = sum;
        if (try_step(strand, space, damping, &sum, worst)) {
            damping = fmax(damping * 0.1, 1e-9);
            failures = 0;
            if (sum > 0.9 * before)
                break; /* as near as these elements come */
        } else {
            damping *= 10.0;
            failures++;
        }
    }
    return failures ? refine_measure(strand, worst) : sum; /* `fitted` belongs to what was kept */
}
