#include "fit/trial.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "fit/dense.h"
#include "fit/frame.h"
#include "groom/strands.h"

#define LEAST_LOGARITHM 1e-3   /* of a parameter's initial value: as good as 0 */
#define LEAST_TURNS 1.0        /* of a curl over a guide: less is a shift that all strands of an operator guide
                                * share, which shows as patches, most of all in short hair */
#define FARTHEST_TURN 0.5      /* of the axes in one trial, radians about each of them */
#define PROBE 0.03             /* step of a finite difference of a frequency's logarithm or a fraction of a strand */
#define PROBE_SIZE 0.1         /* of the logarithm of a size: wide, so that rounding of strands does not show in a slope */
#define LONGEST_STEP 0.7       /* of a parameter in one step of refinement */
#define LONGEST_START 0.2      /* the same of where a bend or curl sets in */
#define DRAWS 8                /* of random numbers, whose mean is matched: one scatters as much as the target does */
#define DAMPING_FLOOR 0.1      /* keeps parameters that nothing speaks for where they are */

/* --- parameters --------------------------------------------------------------------------- */

/* What a parameter's initial value in metres is on a head of this size. */
static double initial_of(const struct groom_operator_parameter *parameter, double ordinary)
{
    if (strcmp(parameter->unit, "m") == 0)
        return parameter->initial * ordinary;
    return strcmp(parameter->unit, "1/m") == 0 ? parameter->initial / ordinary : parameter->initial;
}

static double mean_guide_length(const struct groom *groom)
{
    double sum = 0;
    for (uint32_t g = 0; g < groom->n_guides; g++)
        sum += groom_polyline_length((const float (*)[3])groom->guides + (size_t)g * groom->n_vertices, groom->n_vertices);
    return sum / groom->n_guides;
}

static double minimum_of(const struct groom_operator_parameter *parameter, double initial, groom_operator_type type,
                         double guide_length)
{
    double least = fmax(parameter->minimum, LEAST_LOGARITHM * initial);
    if (type == GROOM_OPERATOR_CURL && strcmp(parameter->name, "frequency") == 0 && guide_length > 0)
        least = fmin(fmax(least, LEAST_TURNS / guide_length), parameter->maximum);
    return least;
}

/* Stage initialize looked for a curl or a clump and found none, or hair was found to need no bend, curl or clump (prune.h): the
 * statistics could still be met a little better with one, at the price of patches, where it moves the strands of an operator
 * guide together, or of the others. */
static int is_absent(const struct groom_operator *op)
{
    int may_be = op->type == GROOM_OPERATOR_BEND || op->type == GROOM_OPERATOR_CURL || op->type == GROOM_OPERATOR_CLUMP;
    return may_be && op->parameter[0] == 0;
}

static int is_known(const struct groom_operator *op, const char *name, int frequencies_known)
{
    return frequencies_known && op->type == GROOM_OPERATOR_CURL &&
           (strcmp(name, "frequency") == 0 || strcmp(name, "random_frequency") == 0);
}

static uint32_t list_unknowns(struct groom_operator *operators, uint32_t n_operators, int frequencies_known,
                              double ordinary, double guide_length, struct unknown *unknowns)
{
    uint32_t n = 0, n_parameters;
    for (uint32_t o = 0; o < n_operators; o++) {
        const struct groom_operator_parameter *p = groom_operator_parameters(operators[o].type, &n_parameters);
        for (uint32_t k = 0; operators[o].enabled && !is_absent(&operators[o]) && k < n_parameters; k++) {
            int place = p[k].slider_maximum <= 1 && strcmp(p[k].name, "start") == 0;
            double initial = initial_of(&p[k], ordinary);
            if (is_known(&operators[o], p[k].name, frequencies_known))
                continue;
            unknowns[n++] = (struct unknown){&operators[o].parameter[k],
                                             place ? p[k].minimum
                                                   : minimum_of(&p[k], initial, operators[o].type, guide_length),
                                             p[k].maximum, initial, !place,
                                             strcmp(p[k].name, "frequency") == 0,
                                             strncmp(p[k].name, "random", 6) == 0};
        }
    }
    return n;
}

double trial_read(const struct unknown *unknown)
{
    return unknown->logarithmic ? log(fmax(*unknown->value, unknown->minimum)) : *unknown->value;
}

void trial_write(const struct unknown *unknown, double x)
{
    double value = unknown->logarithmic ? exp(x) : x;
    *unknown->value = (float)fmin(fmax(value, unknown->minimum), unknown->maximum);
}

void trial_init(const struct groom_fit *fit, int frequencies_known, struct trial *trial)
{
    memcpy(trial->frame, fit->frame, sizeof trial->frame);
    memset(trial->turn, 0, sizeof trial->turn);
    trial->n_operators = fit->groom->n_operators;
    if (trial->n_operators) /* of none there is no array to copy */
        memcpy(trial->operators, fit->groom->operators, trial->n_operators * sizeof *trial->operators);
    trial->n_unknowns = list_unknowns(trial->operators, trial->n_operators, frequencies_known, fit->ordinary,
                                      mean_guide_length(fit->groom), trial->unknowns);
}

void trial_let_turn(struct trial *trial)
{
    for (int k = 0; k < 3; k++)
        trial->unknowns[trial->n_unknowns++] = (struct unknown){&trial->turn[k], -FARTHEST_TURN, FARTHEST_TURN, 0, 0, 0, 0};
}

void trial_begin(const struct groom_fit *fit, int frequencies_known, struct trial *trial)
{
    trial_init(fit, frequencies_known, trial);
    if (fit->axes == AXES_NEAR)
        trial_let_turn(trial);
}

/* Unknowns of the original point into it. */
static float *same_place(const struct trial *from, struct trial *to, const float *value)
{
    return (float *)(void *)((char *)to + ((const char *)value - (const char *)from));
}

void trial_copy(const struct trial *from, struct trial *to)
{
    *to = *from;
    for (uint32_t k = 0; k < to->n_unknowns; k++)
        to->unknowns[k].value = same_place(from, to, from->unknowns[k].value);
}

void trial_keep(const struct trial *trial, struct groom_fit *fit)
{
    for (uint32_t o = 0; o < trial->n_operators; o++)
        memcpy(fit->groom->operators[o].parameter, trial->operators[o].parameter, sizeof trial->operators[o].parameter);
    frame_turned((const double (*)[3])trial->frame, trial->turn, fit->frame);
}

/* --- the misfit ------------------------------------------------------------------------------ */

static double square_of(const double residual[MOMENTS_COUNT])
{
    double sum = 0;
    for (int f = 0; f < MOMENTS_COUNT; f++)
        sum += residual[f] * residual[f];
    return sum;
}

static groom_status residual_of(struct matching *matching, const struct trial *trial, double residual[MOMENTS_COUNT],
                                const struct groom_context *context, struct groom_diag *diag)
{
    double axes[3][3];
    frame_turned((const double (*)[3])trial->frame, trial->turn, axes);
    return matching_residual(matching, trial->operators, (const double (*)[3])axes, residual, context, diag);
}

groom_status trial_average(struct matching *matching, const struct trial *trial, const struct groom_context *context,
                           struct groom_diag *diag)
{
    double axes[3][3];
    if (progress_cancelled(context))
        return groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage operators");
    frame_turned((const double (*)[3])trial->frame, trial->turn, axes);
    return matching_average(matching, trial->operators, (const double (*)[3])axes, DRAWS, context, diag);
}

groom_status trial_misfit(struct matching *matching, const struct trial *trial, double *square,
                          const struct groom_context *context, struct groom_diag *diag)
{
    double residual[MOMENTS_COUNT] = {0};
    *square = INFINITY;
    if (progress_cancelled(context))
        return groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage operators");
    groom_status st = residual_of(matching, trial, residual, context, diag);
    *square = square_of(residual);
    return st;
}

/* --- refinement ---------------------------------------------------------------------------------- */

/* The residual with an unknown moved as far as its range lets it; returns by how much. */
static groom_status probe(struct matching *matching, struct trial *trial, uint32_t index, double move, double *moved,
                          double residual[MOMENTS_COUNT], const struct groom_context *context, struct groom_diag *diag)
{
    const struct unknown *unknown = &trial->unknowns[index];
    double x = trial_read(unknown);
    float kept = *unknown->value;
    if (progress_cancelled(context))
        return groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage operators");
    trial_write(unknown, x + move);
    *moved = trial_read(unknown) - x;
    groom_status st = *moved != 0 ? residual_of(matching, trial, residual, context, diag) : GROOM_OK;
    *unknown->value = kept;
    return st;
}

/* The misfit's slope for each unknown. One side alone leans to where the misfit bends: steps by it end short of the
 * minimum, where that is depends on the way, and rounding decides. Far from it, one is enough.
 * jacobian [n_unknowns][MOMENTS_COUNT] */
static groom_status differentiate(struct matching *matching, struct trial *trial, const double residual[MOMENTS_COUNT],
                                  int both_sides, double *jacobian, const struct groom_context *context,
                                  struct groom_diag *diag)
{
    for (uint32_t k = 0; k < trial->n_unknowns; k++) {
        const struct unknown *unknown = &trial->unknowns[k];
        double *column = jacobian + (size_t)k * MOMENTS_COUNT, below[MOMENTS_COUNT], up, down = 0;
        double move = unknown->logarithmic && !unknown->frequency ? PROBE_SIZE : PROBE;
        memcpy(column, residual, sizeof below); /* what there is on a side where its range ends here */
        memcpy(below, residual, sizeof below);
        groom_status st = probe(matching, trial, k, move, &up, column, context, diag);
        if (st == GROOM_OK && (both_sides || !(up > 0)))
            st = probe(matching, trial, k, -move, &down, below, context, diag);
        if (st != GROOM_OK)
            return st;
        for (int f = 0; f < MOMENTS_COUNT; f++)
            column[f] = up > down ? (column[f] - below[f]) / (up - down) : 0;
    }
    return GROOM_OK;
}

static double dot(const double *a, const double *b)
{
    double sum = 0;
    for (int f = 0; f < MOMENTS_COUNT; f++)
        sum += a[f] * b[f];
    return sum;
}

/* (J^T J + damping) step = -J^T r */
static int solve_step(const double *jacobian, const double residual[MOMENTS_COUNT], uint32_t n, double damping,
                      double step[TRIAL_MOST_UNKNOWNS])
{
    double a[TRIAL_MOST_UNKNOWNS * TRIAL_MOST_UNKNOWNS];
    for (uint32_t i = 0; i < n; i++) {
        const double *row = jacobian + (size_t)i * MOMENTS_COUNT;
        for (uint32_t j = 0; j <= i; j++)
            a[i * n + j] = dot(row, jacobian + (size_t)j * MOMENTS_COUNT);
        a[i * n + i] += damping * a[i * n + i] + DAMPING_FLOOR;
        step[i] = -dot(row, residual);
    }
    if (!dense_cholesky(a, n))
        return 0;
    dense_forward(a, n, step);
    dense_backward(a, n, step);
    return 1;
}

static void take_step(struct trial *trial, const double start[TRIAL_MOST_UNKNOWNS], const double step[TRIAL_MOST_UNKNOWNS])
{
    for (uint32_t k = 0; k < trial->n_unknowns; k++) {
        double most = trial->unknowns[k].logarithmic ? LONGEST_STEP : LONGEST_START;
        trial_write(&trial->unknowns[k], start[k] + fmin(fmax(step[k], -most), most));
    }
}

/* One step of Levenberg and Marquardt by the slopes at hand: the least damping that gets lower. residual and *square
 * are those of `here` and move with it; they stay where none does. */
static groom_status descend(struct matching *matching, struct trial *here, const double *jacobian,
                            double residual[MOMENTS_COUNT], double *square, const struct groom_context *context,
                            struct groom_diag *diag)
{
    static const double dampings[] = {1e-3, 1e-1, 3, 100};
    double step[TRIAL_MOST_UNKNOWNS], start[TRIAL_MOST_UNKNOWNS], other[MOMENTS_COUNT];
    float kept[TRIAL_MOST_UNKNOWNS];
    for (uint32_t k = 0; k < here->n_unknowns; k++) {
        start[k] = trial_read(&here->unknowns[k]);
        kept[k] = *here->unknowns[k].value;
    }
    for (int d = 0; d < 4; d++) {
        if (progress_cancelled(context))
            return groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage operators");
        if (!solve_step(jacobian, residual, here->n_unknowns, dampings[d], step))
            continue;
        take_step(here, start, step);
        groom_status st = residual_of(matching, here, other, context, diag);
        if (st != GROOM_OK)
            return st;
        if (square_of(other) < *square) {
            *square = square_of(other);
            memcpy(residual, other, sizeof other);
            return GROOM_OK;
        }
    }
    for (uint32_t k = 0; k < here->n_unknowns; k++)
        *here->unknowns[k].value = kept[k];
    return GROOM_OK;
}

groom_status trial_refine(struct matching *matching, struct trial *here, int both_sides, uint32_t n_steps, double least,
                           double *square, int *ended, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    double residual[MOMENTS_COUNT], before, last;
    double *jacobian = memory_array(allocator, TRIAL_MOST_UNKNOWNS, MOMENTS_COUNT * sizeof *jacobian);
    groom_status st = GROOM_OK;
    if (!jacobian)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to refine operators");
    if ((st = residual_of(matching, here, residual, context, diag)) != GROOM_OK ||
        (st = differentiate(matching, here, residual, both_sides, jacobian, context, diag)) != GROOM_OK)
        goto out;
    before = last = *square = square_of(residual);
    for (uint32_t k = 0; k < n_steps; k++, last = *square)
        if ((st = descend(matching, here, jacobian, residual, square, context, diag)) != GROOM_OK)
            goto out;
        else if (last - *square < least * last)
            break;
    *ended = before - *square < least * before;
out:
    memory_release(allocator, jacobian, TRIAL_MOST_UNKNOWNS, MOMENTS_COUNT * sizeof *jacobian);
    return st;
}
