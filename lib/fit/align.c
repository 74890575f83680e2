#include "fit/align.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "fit/axes.h"
#include "fit/dense.h"
#include "fit/frame.h"
#include "fit/gather.h"

#define STRANDS 400         /* that are asked at most */
#define FEWEST 32           /* that say something */
#define STRANDS_PER_PIECE 8
#define WAVES 4             /* of a coordinate along a strand that guides may be off by: constant, half a wave, one, .. */
#define NUMBER_STEP 1e-3f   /* by which slopes are told: of a number, */
#define TURN_STEP 5e-3f     /* and of a turn, radians */
#define STEPS 8
#define HALVINGS 3
#define LONGEST 0.15        /* radians of a step; */
#define SHORTEST 1e-4       /* below, axes are where they are to be */
#define EXPLAINED 1e-3      /* of the usual error: no strand is explained better than that */
#define LEAST_LENGTH 1e-9   /* of what is left of a direction once others are taken off, squared: less is rounding */
#define ENOUGH 15.0         /* mean square that a strand moves by where axes turn by a radian, over its error's: 6 to 36 where half
                             * of the numbers were found, 30 to 250 once most are, and .4 along wrong axes, where none is */

struct alignment {
    struct groom_fit *fit;
    uint32_t n, n_numbers, m;
    uint32_t *strand;             /* [fit->n], of which the first n are asked */
    float (*target)[3], (*here)[3];  /* [n * m] */
    float (*slope)[3];            /* [3 + n_numbers][n * m] per radian about the frame's axes, then per unit of numbers */
    double (*normal)[9];          /* [n] of a strand: xx yy zz xy xz yz, pulls x y z */
    double *square;               /* [n] error, mean over vertices */
};

static size_t points_of(const struct alignment *a) { return (size_t)a->n * a->m; }

/* --- what strands do as axes turn and numbers change ------------------------------------------------ */

static groom_status evaluate(const struct alignment *a, float (*out)[3], const struct groom_context *context, struct groom_diag *diag)
{
    return gather_strands(a->fit, a->strand, a->n, out, NULL, context, diag);
}

static void turn_frame(const double from[3][3], const double turn[3], double share, struct groom_fit *fit)
{
    const float vector[3] = {(float)(share * turn[0]), (float)(share * turn[1]), (float)(share * turn[2])};
    frame_turned(from, vector, fit->frame);
    axes_give(fit);
}

/* slope = (end - slope) / step, where slope holds the other end. */
static void divide(const struct alignment *a, const float (*end)[3], float step, float (*slope)[3])
{
    for (size_t v = 0; v < points_of(a); v++)
        for (int c = 0; c < 3; c++)
            slope[v][c] = (end[v][c] - slope[v][c]) / step;
}

static groom_status differentiate_turn(const struct alignment *a, int axis, float (*scratch)[3],
                                       const struct groom_context *context, struct groom_diag *diag)
{
    float (*slope)[3] = a->slope + (size_t)axis * points_of(a);
    double frame[3][3], turn[3] = {0};
    memcpy(frame, a->fit->frame, sizeof frame);
    turn[axis] = (double)TURN_STEP;
    turn_frame((const double (*)[3])frame, turn, -1, a->fit);
    groom_status st = evaluate(a, slope, context, diag);
    turn_frame((const double (*)[3])frame, turn, 1, a->fit);
    if (st == GROOM_OK)
        st = evaluate(a, scratch, context, diag);
    memcpy(a->fit->frame, frame, sizeof frame);
    axes_give(a->fit);
    if (st == GROOM_OK)
        divide(a, (const float (*)[3])scratch, 2 * TURN_STEP, slope);
    return st;
}

static groom_status differentiate_number(const struct alignment *a, float *number, uint32_t n, float (*slope)[3],
                                         const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    float *kept = memory_array(allocator, n, sizeof *kept);
    if (!kept)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u random numbers", n);
    memcpy(kept, number, n * sizeof *kept);
    for (uint32_t i = 0; i < n; i++)
        number[i] += NUMBER_STEP;
    groom_status st = evaluate(a, slope, context, diag);
    memcpy(number, kept, n * sizeof *kept);
    memory_release(allocator, kept, n, sizeof *kept);
    for (size_t v = 0; st == GROOM_OK && v < points_of(a); v++)
        for (int c = 0; c < 3; c++)
            slope[v][c] = (slope[v][c] - a->here[v][c]) / NUMBER_STEP;
    return st;
}

static groom_status differentiate_numbers(const struct alignment *a, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom *groom = a->fit->groom;
    float (*slope)[3] = a->slope + 3 * points_of(a);
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        const struct groom_operator *op = &groom->operators[o];
        uint32_t n = groom_operator_random_per_guide(op->type) ? groom->n_operator_guides : groom->n_strands;
        for (uint32_t r = 0; r < groom_operator_random_arrays(op->type); r++, slope += points_of(a)) {
            groom_status st = differentiate_number(a, op->random[r], n, slope, context, diag);
            if (st != GROOM_OK)
                return st;
        }
    }
    return GROOM_OK;
}

/* --- one strand ------------------------------------------------------------------------------------------ */

static double dot(const double *a, const double *b, uint32_t n)
{
    double sum = 0;
    for (uint32_t k = 0; k < n; k++)
        sum += a[k] * b[k];
    return sum;
}

static void take_off(double *x, const double *unit, uint32_t n)
{
    double along = dot(x, unit, n);
    for (uint32_t k = 0; k < n; k++)
        x[k] -= along * unit[k];
}

/* What is left of a direction across those before it, of length 1; 0 where that is nothing. */
static void make_unit(double *basis, uint32_t at, uint32_t n)
{
    double *x = basis + (size_t)at * n, before = dot(x, x, n);
    for (uint32_t k = 0; k < at; k++)
        take_off(x, basis + (size_t)k * n, n);
    double left = dot(x, x, n), scale = left > LEAST_LENGTH * before && left > 0 ? 1 / sqrt(left) : 0;
    for (uint32_t k = 0; k < n; k++)
        x[k] *= scale;
}

static void copy_row(const float (*points)[3], uint32_t m, double *out)
{
    for (uint32_t j = 0; j < m; j++)
        for (int c = 0; c < 3; c++)
            out[3 * j + (uint32_t)c] = (double)points[j][c];
}

/* All that guides and numbers may be off by. basis [3 * WAVES + n_numbers][3 m] */
static uint32_t fill_basis(const struct alignment *a, uint32_t i, double *basis)
{
    const double pi = acos(-1);
    uint32_t n = 3 * a->m, at = 0;
    memset(basis, 0, (size_t)3 * WAVES * n * sizeof *basis);
    for (uint32_t wave = 0; wave < WAVES; wave++)
        for (uint32_t c = 0; c < 3; c++, at++)
            for (uint32_t j = 1; j < a->m; j++)
                basis[(size_t)at * n + 3 * j + c] = cos(pi * wave * j / (a->m - 1));
    for (uint32_t k = 0; k < a->n_numbers; k++, at++)
        copy_row((const float (*)[3])a->slope + (3 + k) * points_of(a) + (size_t)i * a->m, a->m, basis + (size_t)at * n);
    for (uint32_t k = 0; k < at; k++)
        make_unit(basis, k, n);
    return at;
}

/* basis: scratch, with room for four rows more */
static void ask_strand(const struct alignment *a, uint32_t i, double *basis)
{
    static const int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    uint32_t n = 3 * a->m, n_basis = fill_basis(a, i, basis);
    double *rest = basis + (size_t)n_basis * n, *move = rest + n, per_vertex = 1.0 / a->m;
    for (uint32_t k = 0; k < n; k++)
        rest[k] = (double)a->here[(size_t)i * a->m + k / 3][k % 3] - (double)a->target[(size_t)i * a->m + k / 3][k % 3];
    for (uint32_t axis = 0; axis < 3; axis++)
        copy_row((const float (*)[3])a->slope + axis * points_of(a) + (size_t)i * a->m, a->m, move + (size_t)axis * n);
    for (uint32_t row = 0; row < 4; row++)
        for (uint32_t k = 0; k < n_basis; k++)
            take_off(rest + (size_t)row * n, basis + (size_t)k * n, n);
    a->square[i] = per_vertex * dot(rest, rest, n);
    for (int k = 0; k < 6; k++)
        a->normal[i][k] = per_vertex * dot(move + (size_t)pair[k][0] * n, move + (size_t)pair[k][1] * n, n);
    for (uint32_t axis = 0; axis < 3; axis++)
        a->normal[i][6 + axis] = per_vertex * dot(move + (size_t)axis * n, rest, n);
}

struct asking { const struct alignment *a; double *basis; size_t room; };

static size_t basis_room(const struct alignment *a) { return (size_t)(3 * WAVES + a->n_numbers + 4) * 3 * a->m; }

static void ask_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct asking *asking = user;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < asking->a->n && i < (piece + 1) * STRANDS_PER_PIECE; i++)
        ask_strand(asking->a, i, asking->basis + thread * asking->room);
}

/* --- all of them ------------------------------------------------------------------------------------------ */

/* Fills square and normal for the axes that there are. */
static groom_status look(const struct alignment *a, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_threads = parallel_threads(context);
    struct asking asking = {a, memory_array(allocator, n_threads * basis_room(a), sizeof *asking.basis), basis_room(a)};
    float (*scratch)[3] = memory_array(allocator, points_of(a), sizeof *scratch);
    groom_status st = asking.basis && scratch ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to align %u strands", a->n);
    if (st == GROOM_OK && progress_cancelled(context))
        st = groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage randoms");
    if (st == GROOM_OK)
        st = evaluate(a, a->here, context, diag);
    for (int axis = 0; st == GROOM_OK && axis < 3; axis++)
        st = differentiate_turn(a, axis, scratch, context, diag);
    if (st == GROOM_OK)
        st = differentiate_numbers(a, context, diag);
    if (st == GROOM_OK)
        parallel_for(context, (a->n + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE, ask_piece, &asking);
    memory_release(allocator, asking.basis, n_threads * basis_room(a), sizeof *asking.basis);
    memory_release(allocator, scratch, points_of(a), sizeof *scratch);
    return st;
}

/* The mean logarithm of errors: to halve a small one is worth as much as to halve a large one, so that strands that nothing
 * explains do not decide. */
static double misfit(const struct alignment *a, double least)
{
    double sum = 0;
    for (uint32_t i = 0; i < a->n; i++)
        sum += log(a->square[i] + least);
    return sum / a->n;
}

static double mean_square(const struct alignment *a)
{
    double sum = 0;
    for (uint32_t i = 0; i < a->n; i++)
        sum += a->square[i];
    return sum / a->n;
}

/* The misfit's slope and bend by turns: normal [9], row-major, and pull [3]. */
static void add_up(const struct alignment *a, double least, double normal[9], double pull[3])
{
    static const int place[6][2] = {{0, 0}, {4, 4}, {8, 8}, {1, 3}, {2, 6}, {5, 7}};
    memset(normal, 0, 9 * sizeof *normal);
    memset(pull, 0, 3 * sizeof *pull);
    for (uint32_t i = 0; i < a->n; i++) {
        double weight = 1 / ((a->square[i] + least) * a->n);
        for (int k = 0; k < 6; k++) {
            normal[place[k][0]] += weight * a->normal[i][k];
            if (place[k][0] != place[k][1])
                normal[place[k][1]] += weight * a->normal[i][k];
        }
        for (int c = 0; c < 3; c++)
            pull[c] += weight * a->normal[i][6 + c];
    }
}

/* Whether no turn of a radian moves strands by less than is enough. */
static int tells_all_turns(const double normal[9])
{
    double rest[9];
    memcpy(rest, normal, sizeof rest);
    for (int c = 0; c < 3; c++)
        rest[4 * c] -= ENOUGH;
    return dense_cholesky(rest, 3);
}

/* Gauss and Newton's step; 0 where strands tell nothing. */
static int find_step(const double normal[9], const double pull[3], double step[3])
{
    double a[9], length;
    memcpy(a, normal, sizeof a);
    for (int c = 0; c < 3; c++) {
        step[c] = -pull[c];
        a[4 * c] += 1e-9 * (normal[0] + normal[4] + normal[8]);
    }
    if (!dense_cholesky(a, 3))
        return 0;
    dense_forward(a, 3, step);
    dense_backward(a, 3, step);
    length = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    for (int c = 0; c < 3 && length > LONGEST; c++)
        step[c] *= LONGEST / length;
    return length > SHORTEST;
}

/* One step down, or as small a part of it as leads down. *moved: whether one does; the alignment is then that of there, else
 * that of a frame next to this one, which is the fit's again. */
static groom_status descend(const struct alignment *a, const double step[3], double least, double *value, int *moved,
                            const struct groom_context *context, struct groom_diag *diag)
{
    double frame[3][3];
    memcpy(frame, a->fit->frame, sizeof frame);
    *moved = 0;
    for (int halving = 0; halving <= HALVINGS; halving++) {
        turn_frame((const double (*)[3])frame, step, pow(0.5, halving), a->fit);
        groom_status st = look(a, context, diag);
        if (st != GROOM_OK)
            return st;
        if (misfit(a, least) < *value) {
            *value = misfit(a, least);
            *moved = 1;
            return GROOM_OK;
        }
    }
    memcpy(a->fit->frame, frame, sizeof frame);
    return GROOM_OK;
}

static groom_status turn_axes(const struct alignment *a, const struct groom_context *context, struct groom_diag *diag)
{
    double normal[9], pull[3], step[3];
    groom_status st = look(a, context, diag);
    if (st != GROOM_OK)
        return st;
    double least = EXPLAINED * mean_square(a), value = misfit(a, least);
    int told = 0, moved = 1;
    for (int k = 0; k < STEPS && moved; k++) {
        add_up(a, least, normal, pull);
        told = tells_all_turns(normal);
        if (!find_step(normal, pull, step))
            break;
        if ((st = descend(a, step, least, &value, &moved, context, diag)) != GROOM_OK)
            return st;
    }
    a->fit->axes = told ? AXES_FOUND : a->fit->axes;
    return GROOM_OK;
}

/* --- life ----------------------------------------------------------------------------------------------------- */

static uint32_t count_numbers(const struct groom *groom)
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++)
        n += groom_operator_random_arrays(groom->operators[o].type);
    return n;
}

static groom_status init(struct alignment *a, struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    *a = (struct alignment){.fit = fit, .n = fit->n < STRANDS ? fit->n : STRANDS, .m = fit->m, .n_numbers = count_numbers(fit->groom)};
    a->strand = memory_array(allocator, fit->n, sizeof *a->strand);
    a->target = memory_array(allocator, points_of(a), sizeof *a->target);
    a->here = memory_array(allocator, points_of(a), sizeof *a->here);
    a->slope = memory_array(allocator, (3 + a->n_numbers) * points_of(a), sizeof *a->slope);
    a->normal = memory_array(allocator, a->n, sizeof *a->normal);
    a->square = memory_array(allocator, a->n, sizeof *a->square);
    if (!a->strand || !a->target || !a->here || !a->slope || !a->normal || !a->square)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to align %u strands", a->n);
    groom_fair_order(fit->n, a->strand);
    gather_targets(fit, a->strand, a->n, a->target);
    return GROOM_OK;
}

static void finish(struct alignment *a, const struct groom_context *context)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    memory_release(allocator, a->strand, a->fit->n, sizeof *a->strand);
    memory_release(allocator, a->target, points_of(a), sizeof *a->target);
    memory_release(allocator, a->here, points_of(a), sizeof *a->here);
    memory_release(allocator, a->slope, (3 + a->n_numbers) * points_of(a), sizeof *a->slope);
    memory_release(allocator, a->normal, a->n, sizeof *a->normal);
    memory_release(allocator, a->square, a->n, sizeof *a->square);
}

groom_status align_axes(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct alignment a;
    double frame[3][3];
    uint32_t axes = fit->axes;
    if ((axes != AXES_NEAR && axes != AXES_FOUND) || fit->n < FEWEST)
        return GROOM_OK;
    memcpy(frame, fit->frame, sizeof frame);
    groom_status st = init(&a, fit, context, diag);
    if (st == GROOM_OK)
        st = turn_axes(&a, context, diag);
    if (st != GROOM_OK) {
        memcpy(fit->frame, frame, sizeof frame);
        fit->axes = axes;
    }
    axes_give(fit);
    finish(&a, context);
    return st;
}
