#include "fit/paper_randoms.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "fit/adam.h"
#include "fit/gradient_strands.h"
#include "groom/random.h"

#define STEP_STRANDS 60000 /* strands times gradients of one step of the stage */
#define STREAM_NOISE 0x66690020u /* and those after it: one an array of numbers */

/* --- the numbers as one array ------------------------------------------------------------------ */

struct array { float *u, *gradient; uint32_t n; float minimum, maximum; };

#define MOST_ARRAYS (GROOM_FIT_MAX_OPERATORS * GROOM_OPERATOR_MAX_RANDOM)

/* gradient may be NULL. */
static uint32_t list_arrays(const struct groom *groom, const struct groom_gradient *gradient, struct array arrays[MOST_ARRAYS])
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        const struct groom_operator *op = &groom->operators[o];
        uint32_t n_randoms, size = groom_operator_random_per_guide(op->type) ? groom->n_operator_guides : groom->n_strands;
        const struct groom_operator_random *random = groom_operator_randoms(op->type, &n_randoms);
        for (uint32_t r = 0; r < n_randoms && op->enabled; r++)
            arrays[n++] = (struct array){op->random[r], gradient ? gradient->operators[o].random[r] : NULL, size,
                                         random[r].minimum, random[r].maximum};
    }
    return n;
}

uint32_t paper_randoms_moments(const struct groom_fit *fit)
{
    struct array arrays[MOST_ARRAYS];
    uint32_t n = list_arrays(fit->groom, NULL, arrays), sum = 0;
    for (uint32_t a = 0; a < n; a++)
        sum += 2 * arrays[a].n;
    return sum;
}

/* --- one step of descent --------------------------------------------------------------------------- */

/* Eqs. 20 and 21: noise of the size of the mean gradient, less of it from step to step. */
static void add_noise(const struct groom_fit *fit, struct array *array, uint32_t which, uint32_t iteration)
{
    double first = fit->options.stages.randoms.noise_first, last = fit->options.stages.randoms.noise_last, mean = 0;
    double done = (double)iteration / fmax(fit->options.stages.randoms.iterations - 1.0, 1);
    struct groom_random_key key = {fit->options.seed, STREAM_NOISE + which};
    for (uint32_t i = 0; i < array->n; i++)
        mean += fabs((double)array->gradient[i]) / array->n;
    for (uint32_t i = 0; i < array->n; i++)
        array->gradient[i] += (float)((first + (last - first) * done) * mean * groom_random_normal(key, i, iteration));
}

static void descend(struct groom_fit *fit, struct groom_gradient *gradient, float *moments, uint32_t iteration)
{
    struct array arrays[MOST_ARRAYS];
    uint32_t n = list_arrays(fit->groom, gradient, arrays);
    for (uint32_t a = 0; a < n; moments += 2 * (size_t)arrays[a].n, a++) {
        struct array *array = &arrays[a];
        add_noise(fit, array, a, iteration);
        adam_step(array->u, array->gradient, moments, array->n, fit->options.stages.randoms.learning_rate, iteration + 1);
        for (uint32_t i = 0; i < array->n; i++)
            array->u[i] = fminf(fmaxf(array->u[i], array->minimum), array->maximum);
    }
}

/* Moments and numbers are the step's own until it has come through. */
static groom_status descend_some(struct groom_fit *fit, struct gradient_strands *strands, struct groom_gradient *gradient,
                                 float *moments, uint32_t count, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    for (uint32_t k = 0; k < count; k++) {
        double loss;
        groom_status st = gradient_strands_evaluate(strands, gradient, &loss, context, diag);
        if (st == GROOM_OK && progress_cancelled(context))
            st = groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage randoms");
        if (st != GROOM_OK)
            return st;
        progress_loss(context, "L_rand", fit->iteration + k, loss);
        descend(fit, gradient, moments, fit->iteration + k);
    }
    return GROOM_OK;
}

static void swap_numbers(struct groom *a, struct groom *b)
{
    for (uint32_t o = 0; o < a->n_operators; o++)
        for (uint32_t r = 0; r < groom_operator_random_arrays(a->operators[o].type); r++) {
            float *u = a->operators[o].random[r];
            a->operators[o].random[r] = b->operators[o].random[r];
            b->operators[o].random[r] = u;
        }
}

groom_status paper_randoms_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_context own = {.allocator = fit->allocator};
    uint32_t left = fit->options.stages.randoms.iterations - fit->iteration, n = paper_randoms_moments(fit);
    uint32_t count = STEP_STRANDS / fit->n > 1 ? STEP_STRANDS / fit->n : 1;
    struct gradient_strands *strands = NULL;
    struct groom_gradient *gradient = NULL;
    struct groom *before = NULL;
    groom_status st = GROOM_ENOMEM;
    float *moments = memory_array_zero(fit->allocator, n, sizeof *moments);
    if (!moments) {
        groom_fail(diag, st, "no memory for the moments of %u numbers", n);
        goto out;
    }
    if (fit->n_moments == n)
        memcpy(moments, fit->moments, n * sizeof *moments);
    count = count < left ? count : left;
    if ((st = groom_clone(fit->groom, &own, &before, diag)) != GROOM_OK ||
        (st = gradient_strands_create(fit, context, &strands, diag)) != GROOM_OK ||
        (st = groom_gradient_create(fit->groom, context, &gradient, diag)) != GROOM_OK)
        goto out;
    if ((st = descend_some(fit, strands, gradient, moments, count, context, diag)) != GROOM_OK) {
        swap_numbers(fit->groom, before);
        goto out;
    }
    memory_release(fit->allocator, fit->moments, fit->n_moments, sizeof *fit->moments);
    fit->moments = NULL;
    fit->n_moments = 0;
    fit->iteration += count;
    if (fit->iteration < fit->options.stages.randoms.iterations) {
        fit->moments = moments;
        fit->n_moments = n;
        moments = NULL;
    }
out:
    memory_release(fit->allocator, moments, n, sizeof *moments);
    groom_gradient_destroy(gradient);
    gradient_strands_destroy(strands);
    groom_destroy(before);
    return st;
}
