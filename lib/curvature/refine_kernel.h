/* The least-squares fit of a super-helix, the text that is compiled once per instruction set. The
 * including file defines REFINE_FIT, the name of the function, and REFINE_TRIG, that of its trig_rows. Every variant gives the same bits: rows are
 * added up in the same order, and nothing is contracted. */
#ifndef CURVATURE_REFINE_KERNEL_H
#define CURVATURE_REFINE_KERNEL_H

#pragma GCC diagnostic ignored "-Wpsabi"

#include "curvature/refine.h"

#include <math.h>
#include <string.h>

/* Where the model's forecast misses by less than this share of what is left, it has found the minimum. */
#define CONVERGED 0.2

/* A rigid motion about the root: x moves by shift + turn x x. Kept as 6 numbers, turn first. In these
 * coordinates a motion of an element's begin carries everything beyond along unchanged. */

/* The quadratic 1/2 y^T P y + h^T y of a motion y: row i is P[i][0..5], h[i], 0. */
struct quadratic {
    struct refine_row8 row[6];
    double gained; /* how far the controls beyond bring the sum of squares down */
};

CURVATURE_INLINE refine_row all_of(double x) { return (refine_row){x, x, x, x}; }

CURVATURE_INLINE double row_at(const struct refine_row8 *r, int i) { return i < 4 ? r->low[i] : r->high[i - 4]; }

/* a += s b */
CURVATURE_INLINE void row_add(struct refine_row8 *a, double s, const struct refine_row8 *b)
{
    a->low += all_of(s) * b->low;
    a->high += all_of(s) * b->high;
}

/* --- where the curve is ----------------------------------------------------------- */

/* The angles squared of whole elements and of their parts before each vertex. */
static void fill_angles(const struct refine_strand *strand, double *x)
{
    uint32_t n = strand->n_elements, k = 0;
    for (uint32_t j = 0; j < n; j++) {
        vec3 q = vec_of(strand->q[j]);
        double square = vec_dot(q, q), l = strand->length[j];
        x[j] = square * l * l;
        for (; k < strand->n_vertices && strand->element[k] == j; k++) {
            double s = strand->fraction[k] * l;
            x[n + k] = square * s * s;
        }
    }
}

CURVATURE_INLINE trig5 trig_at(const struct trig_rows *t, size_t i)
{
    return (trig5){t->A[i], t->B[i], t->C[i], t->B1[i], t->C1[i]};
}

static void walk_junctions(const struct refine_strand *strand, const struct trig_rows *t, struct chain_state *junction)
{
    junction[0] = (struct chain_state){{0.0, 0.0, 0.0}, strand->root};
    for (uint32_t j = 0; j < strand->n_elements; j++) {
        double l = strand->length[j], x = t->x[j];
        vec3 theta = vec_scale(l, vec_of(strand->q[j]));
        vec3 chord = vec_scale(l, element_chord(t->B[j], t->C[j], x, theta));
        junction[j + 1].p = vec_add(junction[j].p, mat_vec(junction[j].F, chord));
        junction[j + 1].F = mat_mul(junction[j].F, element_turn(t->A[j], t->B[j], x, theta));
    }
}

/* Fill `trig` and `fitted`; the sum of squared distances, *worst the largest distance.
 * junction  read where it is known, else written */
static double measure(struct refine_strand *strand, const struct refine_space *space, struct chain_state *junction,
                      int known, double *worst)
{
    const struct trig_rows *t = &space->trig;
    uint32_t n = strand->n_elements;
    double sum = 0.0, most = 0.0;
    fill_angles(strand, t->x);
    memset(t->x + n + strand->n_vertices, 0, 3 * sizeof *t->x);
    REFINE_TRIG(t, n + strand->n_vertices);
    if (!known)
        walk_junctions(strand, t, junction);
    for (uint32_t k = 0; k < strand->n_vertices; k++) {
        uint32_t j = strand->element[k];
        double s = strand->fraction[k] * strand->length[j];
        vec3 theta = vec_scale(s, vec_of(strand->q[j]));
        vec3 chord = vec_scale(s, element_chord(t->B[n + k], t->C[n + k], t->x[n + k], theta));
        strand->fitted[k] = vec_add(junction[j].p, mat_vec(junction[j].F, chord));
        vec3 miss = vec_sub(strand->fitted[k], strand->vertex[k]);
        double square = vec_dot(miss, miss);
        sum += square;
        most = square > most ? square : most;
    }
    *worst = sqrt(most);
    return sum;
}

/* --- one element ------------------------------------------------------------------ */

/* A vertex seen from the element's controls: columns d/dq and d/dlength. */
struct sight {
    vec3 column[4];
};

CURVATURE_INLINE struct sight sight_of(const struct chain_state *at, vec3 q, double length, double fraction, trig5 f,
                                       double x)
{
    double s = fraction * length;
    vec3 theta = vec_scale(s, q);
    mat3 D = mat_mul(at->F, element_derivative(f, x, theta, s));
    vec3 tangent = mat_vec(at->F, element_turn(f.A, f.B, x, theta).t);
    return (struct sight){{D.t, D.u, D.v, vec_scale(fraction, tangent)}};
}

static void put_column(refine_row control[6], int c, vec3 turn, vec3 shift)
{
    control[0][c] = turn.x, control[1][c] = turn.y, control[2][c] = turn.z;
    control[3][c] = shift.x, control[4][c] = shift.y, control[5][c] = shift.z;
}

/* What the controls of an element do to all that lies beyond it: the end turns by l F V dq + Omega dl
 * and moves; as a motion about the root, shift = move - turn x p_end. */
static void fill_control(const struct chain_state *at, const struct chain_state *end, vec3 q, double l, trig5 f,
                         double x, refine_row control[6])
{
    vec3 theta = vec_scale(l, q);
    mat3 V = element_mean(f.B, f.C, x, theta);
    mat3 turn = mat_scale(l, mat_mul(at->F, V)), move = mat_mul(at->F, element_derivative(f, x, theta, l));
    vec3 omega = mat_vec(at->F, q);
    put_column(control, 0, turn.t, vec_sub(move.t, vec_cross(turn.t, end->p)));
    put_column(control, 1, turn.u, vec_sub(move.u, vec_cross(turn.u, end->p)));
    put_column(control, 2, turn.v, vec_sub(move.v, vec_cross(turn.v, end->p)));
    put_column(control, 3, omega, vec_sub(end->F.t, vec_cross(omega, end->p)));
}

/* What the vertices of one element add: sums over them. */
struct sums {
    double n;
    vec3 x, diagonal, off;     /* of x; of x_i^2; of yz, xz, xy */
    vec3 moment, force;        /* of x x r and r, r the miss */
    refine_row mixed[7];       /* rows of motion and constant, over the controls */
    refine_row square[4];      /* over pairs of controls */
};

/* Add a vertex at x that misses its mark by r. */
CURVATURE_INLINE void add_vertex(struct sums *g, const struct sight *see, vec3 x, vec3 r)
{
    const vec3 *w = see->column;
    refine_row wx = {w[0].x, w[1].x, w[2].x, w[3].x}, wy = {w[0].y, w[1].y, w[2].y, w[3].y};
    refine_row wz = {w[0].z, w[1].z, w[2].z, w[3].z};
    g->n += 1.0;
    g->x = vec_add(g->x, x);
    g->diagonal = vec_add(g->diagonal, (vec3){x.x * x.x, x.y * x.y, x.z * x.z});
    g->off = vec_add(g->off, (vec3){x.y * x.z, x.x * x.z, x.x * x.y});
    g->moment = vec_add(g->moment, vec_cross(x, r));
    g->force = vec_add(g->force, r);
    g->mixed[0] += all_of(x.y) * wz - all_of(x.z) * wy;
    g->mixed[1] += all_of(x.z) * wx - all_of(x.x) * wz;
    g->mixed[2] += all_of(x.x) * wy - all_of(x.y) * wx;
    g->mixed[3] += wx;
    g->mixed[4] += wy;
    g->mixed[5] += wz;
    g->mixed[6] += all_of(r.x) * wx + all_of(r.y) * wy + all_of(r.z) * wz;
    for (int c = 0; c < 4; c++)
        g->square[c] += all_of(w[c].x) * wx + all_of(w[c].y) * wy + all_of(w[c].z) * wz;
}

/* The quadratic of the element's begin before its controls answer: what lies beyond, and its vertices. */
CURVATURE_INLINE void add_motion(struct quadratic *P, const struct sums *g)
{
    const vec3 s = g->x, d = g->diagonal, o = g->off;
    struct refine_row8 add[6] = {
        {{d.y + d.z, -o.z, -o.y, 0.0}, {-s.z, s.y, g->moment.x, 0.0}}, /* -[x]x [x]x, and [x]x */
        {{-o.z, d.x + d.z, -o.x, s.z}, {0.0, -s.x, g->moment.y, 0.0}},
        {{-o.y, -o.x, d.x + d.y, -s.y}, {s.x, 0.0, g->moment.z, 0.0}},
        {{0.0, s.z, -s.y, g->n}, {0.0, 0.0, g->force.x, 0.0}},
        {{-s.z, 0.0, s.x, 0.0}, {g->n, 0.0, g->force.y, 0.0}},
        {{s.y, -s.x, 0.0, 0.0}, {0.0, g->n, g->force.z, 0.0}},
    };
    for (int i = 0; i < 6; i++)
        row_add(&P->row[i], 1.0, &add[i]);
}

/* Controls against motions and the constant, and against each other. */
struct stage {
    struct refine_row8 mixed[4];
    refine_row square[4];
};

CURVATURE_INLINE void fill_stage(struct stage *g, const struct quadratic *beyond, const refine_row control[6],
                                 const struct sums *own, double damping, double length)
{
    double fourth = length * length * length * length;
    /* a radian of turning weighs as much as its length; lengths stay near what they were */
    const double weight[4] = {damping * fourth, damping * fourth, damping * fourth, 10.0 * damping};
    for (int c = 0; c < 4; c++) {
        const refine_row *m = own->mixed;
        g->mixed[c] = (struct refine_row8){{m[0][c], m[1][c], m[2][c], m[3][c]}, {m[4][c], m[5][c], m[6][c], 0.0}};
        struct refine_row8 through = {all_of(0.0), all_of(0.0)};
        for (int k = 0; k < 6; k++)
            row_add(&through, control[k][c], &beyond->row[k]);
        g->square[c] = own->square[c];
        for (int k = 0; k < 6; k++)
            g->square[c] += all_of(row_at(&through, k)) * control[k];
        g->square[c][c] += weight[c];
        row_add(&g->mixed[c], 1.0, &through);
    }
}

/* Cholesky of the lower triangle in place, 1/diagonal on the diagonal. 0 where it is not positive. */
CURVATURE_INLINE int factor(double *a, int n)
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
CURVATURE_INLINE int eliminate_controls(struct stage *g, struct refine_row8 gain[4], struct quadratic *left)
{
    double L[4][4];
    struct refine_row8 half[4]; /* L^-1 [mixed] */
    for (int c = 0; c < 4; c++)
        for (int d = 0; d < 4; d++)
            L[c][d] = g->square[c][d];
    if (!factor(&L[0][0], 4))
        return 0;
    for (int c = 0; c < 4; c++) {
        half[c] = g->mixed[c];
        for (int d = 0; d < c; d++)
            row_add(&half[c], -L[c][d], &half[d]);
        half[c].low *= all_of(L[c][c]), half[c].high *= all_of(L[c][c]);
    }
    for (int c = 3; c >= 0; c--) {
        gain[c] = half[c];
        for (int d = c + 1; d < 4; d++)
            row_add(&gain[c], -L[d][c], &gain[d]);
        gain[c].low *= all_of(L[c][c]), gain[c].high *= all_of(L[c][c]);
    }
    for (int i = 0; i < 6; i++)
        for (int c = 0; c < 4; c++)
            row_add(&left->row[i], -row_at(&half[c], i), &half[c]);
    for (int c = 0; c < 4; c++)
        left->gained += half[c].high[2] * half[c].high[2];
    return 1;
}

/* --- the whole strand ---------------------------------------------------------------- */

static void fill_controls(const struct refine_strand *strand, const struct refine_space *space)
{
    const struct chain_state *at = space->junction;
    for (uint32_t j = 0; j < strand->n_elements; j++)
        fill_control(&at[j], &at[j + 1], vec_of(strand->q[j]), strand->length[j], trig_at(&space->trig, j),
                     space->trig.x[j], space->element[j].control);
}

/* Tip to root. 0 where the damping is too small for the arithmetic. */
static int eliminate(const struct refine_strand *strand, const struct refine_space *space, double damping,
                     struct quadratic *value)
{
    static const struct sums none;
    uint32_t k = strand->n_vertices;
    memset(value, 0, sizeof *value);
    for (uint32_t j = strand->n_elements; j-- > 0;) {
        struct refine_element *e = &space->element[j];
        vec3 q = vec_of(strand->q[j]);
        struct sums own;
        struct stage g;
        own = none;
        for (; k > 0 && strand->element[k - 1] == j; k--) {
            size_t i = (size_t)strand->n_elements + k - 1;
            struct sight see = sight_of(&space->junction[j], q, strand->length[j], strand->fraction[k - 1],
                                        trig_at(&space->trig, i), space->trig.x[i]);
            add_vertex(&own, &see, strand->fitted[k - 1], vec_sub(strand->fitted[k - 1], strand->vertex[k - 1]));
        }
        fill_stage(&g, value, e->control, &own, damping, strand->length[j]);
        add_motion(value, &own);
        if (!eliminate_controls(&g, e->gain, value))
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
            a[i][k] = value->row[i].low[k] + (i == k) * damping * (value->row[i].low[i] + 1e-30);
    if (!factor(&a[0][0], 3))
        return 0;
    for (int i = 0; i < 3; i++) {
        half[i] = -value->row[i].high[2];
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
    struct chain_state *at = space->moved;
    strand->root = turned(strand->root, turn);
    at[0] = (struct chain_state){{0.0, 0.0, 0.0}, strand->root};
    for (uint32_t j = 0; j < strand->n_elements; j++) {
        const struct refine_element *e = &space->element[j];
        double motion[6], w[4], l = strand->length[j];
        motion_between(&space->junction[j], &at[j], motion);
        for (int c = 0; c < 4; c++) {
            w[c] = -row_at(&e->gain[c], 6);
            for (int i = 0; i < 6; i++)
                w[c] -= row_at(&e->gain[c], i) * motion[i];
        }
        for (int c = 0; c < 3; c++)
            strand->q[j][c] += w[c];
        strand->length[j] = fmin(fmax(l + w[3], 0.5 * l), 2.0 * l);
        at[j + 1] = chain_step(at[j], vec_of(strand->q[j]), strand->length[j]);
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

/* One damped step; 1 where it went downhill. *left: what the model thinks can still be gained. Where it did not,
 * `trig` and `fitted` are of the strand that was tried. */
static int try_step(struct refine_strand *strand, struct refine_space *space, double damping, double *sum,
                    double *worst, double *left)
{
    struct quadratic value;
    double turn[3], far;
    mat3 root = strand->root;
    keep(strand, space->kept);
    fill_controls(strand, space);
    if (!eliminate(strand, space, damping, &value) || !root_turn(&value, damping, turn))
        return 0;
    apply(strand, space, turn);
    double after = measure(strand, space, space->moved, 1, &far);
    if (!(after < *sum)) { /* NaN counts as uphill */
        restore(strand, space->kept, root);
        return 0;
    }
    struct chain_state *before = space->junction;
    space->junction = space->moved;
    space->moved = before;
    *left = fmax(after - (*sum - value.gained), 0.0);
    *sum = after;
    *worst = far;
    return 1;
}

double REFINE_FIT(struct refine_strand *strand, struct refine_space *space, uint32_t n_steps, double tolerance,
                  double *worst)
{
    double sum = measure(strand, space, space->junction, 0, worst), damping = 1e-3, left;
    uint32_t failures = 0;
    int smooth = 1; /* no failure yet: the model can be believed */
    for (uint32_t step = 0; step < n_steps && *worst > tolerance && failures < 4; step++) {
        double before = sum;
        if (try_step(strand, space, damping, &sum, worst, &left)) {
            damping = fmax(damping * 0.1, 1e-9);
            failures = 0;
            if ((smooth && left < CONVERGED * sum) || sum > 0.9 * before)
                break; /* as near as these elements come */
        } else {
            damping *= 10.0;
            failures++;
            smooth = 0;
            measure(strand, space, space->junction, 1, worst);
        }
    }
    return sum;
}

#endif
