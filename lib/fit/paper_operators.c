#include "fit/paper_operators.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "fit/adam.h"
#include "fit/gradient_determinant.h"
#include "fit/gradient_shape.h"

#define UNIT 0.1              /* metres on an ordinary head: what the paper's learning rates fit */
#define STEP_STRANDS 20000    /* strands times gradients of one step of the stage */
#define STREAMED 10           /* one loss of so many is streamed */
#define LATE 0.75             /* of a loss's steps: from there on there are more batches */
#define LEAST_SIZE 1e-6      /* of a curl or clump that there is, in the paper's units */
#define MOST_PARAMETERS (GROOM_FIT_MAX_OPERATORS * GROOM_OPERATOR_MAX_PARAMETERS)

enum loss { SHAPE, SCALE, CLUMP, LOSSES };
static const char *const loss_names[LOSSES] = {"shape", "scale", "clump"};

static enum loss loss_of(groom_operator_type type)
{
    return type == GROOM_OPERATOR_SCALE ? SCALE : type == GROOM_OPERATOR_CLUMP ? CLUMP : SHAPE;
}

/* --- the numbers that a loss moves --------------------------------------------------------------- */

struct number { float *value; uint32_t op, parameter; float minimum, maximum; double unit; };

/* What 1 of a parameter in the paper's units is in ours. A curl of its frequency w turns 3 w times in a unit. */
static double unit_of(const struct groom_operator_parameter *p, groom_operator_type type, double ordinary)
{
    if (strcmp(p->unit, "m") == 0)
        return UNIT * ordinary;
    if (strcmp(p->unit, "1/m") == 0)
        return (type == GROOM_OPERATOR_CURL ? 3 : 1) / (UNIT * ordinary);
    return 1;
}

/* Operators that have no gradient at size 0. */
static int can_be_still(groom_operator_type type)
{
    return type == GROOM_OPERATOR_CURL || type == GROOM_OPERATOR_CLUMP;
}

/* The same numbers at each step: what has a size to begin with does not come down to none. */
static uint32_t list_numbers(const struct groom_fit *fit, enum loss loss, struct number numbers[MOST_PARAMETERS])
{
    uint32_t n = 0, n_parameters;
    for (uint32_t o = 0; o < fit->groom->n_operators; o++) {
        struct groom_operator *op = &fit->groom->operators[o];
        const struct groom_operator_parameter *p = groom_operator_parameters(op->type, &n_parameters);
        int still = can_be_still(op->type) && op->parameter[0] == 0;
        for (uint32_t k = 0; op->enabled && !still && loss_of(op->type) == loss && k < n_parameters; k++) {
            double unit = unit_of(&p[k], op->type, fit->ordinary);
            float minimum = can_be_still(op->type) && k == 0 ? fmaxf(p[k].minimum, (float)(LEAST_SIZE * unit)) : p[k].minimum;
            numbers[n++] = (struct number){&op->parameter[k], o, k, minimum, p[k].maximum, unit};
        }
    }
    return n;
}

static uint32_t count_numbers(const struct groom_fit *fit, enum loss loss)
{
    struct number numbers[MOST_PARAMETERS];
    return list_numbers(fit, loss, numbers);
}

uint32_t paper_operators_moments(const struct groom_fit *fit)
{
    return 2 * (count_numbers(fit, SHAPE) + count_numbers(fit, SCALE) + count_numbers(fit, CLUMP));
}

/* --- whose turn it is -------------------------------------------------------------------------------- */

static uint32_t list_losses(const struct groom_fit *fit, enum loss losses[LOSSES])
{
    uint32_t n = 0;
    for (int loss = 0; loss < LOSSES; loss++)
        if (count_numbers(fit, (enum loss)loss) > 0)
            losses[n++] = (enum loss)loss;
    return n;
}

uint32_t paper_operators_iterations(const struct groom_fit *fit)
{
    enum loss losses[LOSSES];
    return list_losses(fit, losses) * fit->options.stages.operators.iterations;
}

/* The loss of step t of the stage, and which of its own steps that is. */
static enum loss turn_of(const struct groom_fit *fit, uint32_t t, uint32_t *own)
{
    enum loss losses[LOSSES];
    uint32_t n = list_losses(fit, losses), length = fit->options.stages.operators.alternate;
    uint32_t done = fit->options.stages.operators.iterations / length * length; /* in whole turns */
    uint32_t begin = 0;
    if (t >= n * done) { /* the last turns are shorter */
        t -= n * done;
        begin = done;
        length = fit->options.stages.operators.iterations - done;
    }
    *own = begin + t / length / n * length + t % length;
    return losses[t / length % n];
}

/* --- steps ---------------------------------------------------------------------------------------------- */

struct descent {
    struct groom_fit *fit;
    struct gradient_shape *shape;                /* made where first needed */
    struct gradient_determinant *determinant[LOSSES];
    struct groom_gradient *gradient;
    float (*guides)[3];                          /* of it, which nobody needs */
    float *weights;
};

static groom_status evaluate(struct descent *d, enum loss loss, uint32_t own, double *value,
                             const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_fit *fit = d->fit;
    int late = own >= LATE * fit->options.stages.operators.iterations;
    uint32_t n_batches = late ? fit->options.stages.operators.batches_late : fit->options.stages.operators.batches;
    groom_status st = GROOM_OK;
    if (loss == SHAPE) {
        if (!d->shape)
            st = gradient_shape_create(fit, context, &d->shape, diag);
        return st != GROOM_OK ? st : gradient_shape_evaluate(d->shape, own, d->gradient, value, context, diag);
    }
    if (!d->determinant[loss])
        st = gradient_determinant_create(fit, loss == SCALE ? GRADIENT_SCALE : GRADIENT_CLUMP, context,
                                         &d->determinant[loss], diag);
    if (st != GROOM_OK)
        return st;
    return gradient_determinant_evaluate(d->determinant[loss], own, n_batches, d->gradient, value, context, diag);
}

/* Where a loss's moments begin. */
static float *moments_of(const struct groom_fit *fit, enum loss loss, float *moments)
{
    for (int before = 0; before < (int)loss; before++)
        moments += 2 * count_numbers(fit, (enum loss)before);
    return moments;
}

static void descend(struct descent *d, enum loss loss, uint32_t own, float *moments)
{
    struct number numbers[MOST_PARAMETERS];
    float x[MOST_PARAMETERS], slope[MOST_PARAMETERS];
    uint32_t n = list_numbers(d->fit, loss, numbers);
    for (uint32_t i = 0; i < n; i++) {
        x[i] = (float)((double)*numbers[i].value / numbers[i].unit);
        slope[i] = (float)(d->gradient->operators[numbers[i].op].parameter[numbers[i].parameter] * numbers[i].unit);
    }
    adam_step(x, slope, moments_of(d->fit, loss, moments), n, d->fit->options.stages.operators.learning_rate, own + 1);
    for (uint32_t i = 0; i < n; i++)
        *numbers[i].value = fminf(fmaxf((float)((double)x[i] * numbers[i].unit), numbers[i].minimum), numbers[i].maximum);
}

static groom_status descend_some(struct descent *d, uint32_t count, float *moments, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    for (uint32_t t = d->fit->iteration; t < d->fit->iteration + count; t++) {
        uint32_t own;
        enum loss loss = turn_of(d->fit, t, &own);
        double value;
        if (progress_cancelled(context))
            return groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage operators");
        groom_status st = evaluate(d, loss, own, &value, context, diag);
        if (st != GROOM_OK)
            return st;
        if (own % STREAMED == 0)
            progress_loss(context, loss_names[loss], own, value);
        descend(d, loss, own, moments);
    }
    return GROOM_OK;
}

static groom_status descent_init(struct descent *d, struct groom_fit *fit, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    *d = (struct descent){.fit = fit};
    groom_status st = groom_gradient_create(fit->groom, context, &d->gradient, diag);
    if (st != GROOM_OK)
        return st;
    d->guides = d->gradient->guides;
    d->weights = d->gradient->instancing_weight;
    d->gradient->guides = NULL;
    d->gradient->instancing_weight = NULL;
    return st;
}

static void descent_finish(struct descent *d)
{
    if (d->gradient) {
        d->gradient->guides = d->guides;
        d->gradient->instancing_weight = d->weights;
    }
    groom_gradient_destroy(d->gradient);
    gradient_shape_destroy(d->shape);
    for (int loss = 0; loss < LOSSES; loss++)
        gradient_determinant_destroy(d->determinant[loss]);
}

static void copy_parameters(const struct groom *groom, float (*values)[GROOM_OPERATOR_MAX_PARAMETERS])
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        memcpy(values[o], groom->operators[o].parameter, sizeof values[o]);
}

groom_status paper_operators_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                                  struct groom_diag *diag)
{
    uint32_t left = paper_operators_iterations(fit) - fit->iteration, n = paper_operators_moments(fit);
    uint32_t count = STEP_STRANDS / fit->n > 1 ? STEP_STRANDS / fit->n : 1;
    float before[GROOM_FIT_MAX_OPERATORS][GROOM_OPERATOR_MAX_PARAMETERS];
    struct descent d = {0};
    float *moments = memory_array_zero(fit->allocator, n, sizeof *moments);
    groom_status st = moments ? descent_init(&d, fit, context, diag) : groom_fail(diag, GROOM_ENOMEM, "no memory for the moments of %u numbers", n);
    count = count < left ? count : left;
    copy_parameters(fit->groom, before);
    if (st == GROOM_OK && fit->n_moments == n)
        memcpy(moments, fit->moments, n * sizeof *moments);
    if (st == GROOM_OK)
        st = descend_some(&d, count, moments, context, diag);
    if (st == GROOM_OK) {
        float *old = fit->moments;
        uint32_t n_old = fit->n_moments;
        *ended = count == left;
        fit->iteration += count;
        fit->moments = *ended ? NULL : moments;
        fit->n_moments = *ended ? 0 : n;
        moments = *ended ? moments : NULL;
        memory_release(fit->allocator, old, n_old, sizeof *old);
    } else {
        for (uint32_t o = 0; o < fit->groom->n_operators; o++)
            memcpy(fit->groom->operators[o].parameter, before[o], sizeof before[o]);
    }
    descent_finish(&d);
    memory_release(fit->allocator, moments, n, sizeof *moments);
    return st;
}
