#include "fit/calibrate.h"

#include <math.h>

#include "base/memory.h"
#include "fit/gather.h"
#include "fit/mean_curvature.h"
#include "groom/strands.h"

#define STRANDS 4000    /* compared at most */
#define FEWEST 32       /* whose mean says something */
#define STEPS 3
#define LARGEST 0.015   /* logarithm of the factor. Where the axes that hair was made along are not found, up to a
                         * twentieth more or less frizz turns as sharply, and parameters are to stay within 3 % */
#define PROBE 0.02      /* first step, by which the slope is told */
#define LEAST_SLOPE 0.2 /* of the logarithm of curvature: below, it is not of frizz */
#define AMPLITUDE 1     /* of frizz's parameters */

static int is_frizz(const struct groom_operator *op)
{
    return op->enabled && op->type == GROOM_OPERATOR_FRIZZ && op->parameter[AMPLITUDE] > 0;
}

struct sample {
    struct groom_fit *fit;
    uint32_t n;
    uint32_t *strand;               /* [fit->n] of which the first n are compared */
    float (*fitted)[3], (*target)[3]; /* [n * m] */
    float amplitude[GROOM_FIT_MAX_OPERATORS]; /* before */
};

static groom_status sample_init(struct sample *sample, struct groom_fit *fit, const struct groom_context *context,
                                struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    *sample = (struct sample){.fit = fit, .n = fit->n < STRANDS ? fit->n : STRANDS};
    for (uint32_t o = 0; o < fit->groom->n_operators; o++)
        sample->amplitude[o] = fit->groom->operators[o].parameter[AMPLITUDE];
    size_t n_points = (size_t)sample->n * fit->m;
    sample->strand = memory_array(allocator, fit->n, sizeof *sample->strand);
    sample->fitted = memory_array(allocator, n_points, sizeof *sample->fitted);
    sample->target = memory_array(allocator, n_points, sizeof *sample->target);
    if (!sample->strand || !sample->fitted || !sample->target)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to compare the curvature of %u strands", sample->n);
    groom_fair_order(fit->n, sample->strand);
    return GROOM_OK;
}

static void sample_finish(struct sample *sample, const struct groom_context *context)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_points = (size_t)sample->n * sample->fit->m;
    memory_release(allocator, sample->strand, sample->fit->n, sizeof *sample->strand);
    memory_release(allocator, sample->fitted, n_points, sizeof *sample->fitted);
    memory_release(allocator, sample->target, n_points, sizeof *sample->target);
}

static void set_factor(const struct sample *sample, double factor)
{
    struct groom *groom = sample->fit->groom;
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (is_frizz(&groom->operators[o]))
            groom->operators[o].parameter[AMPLITUDE] = sample->amplitude[o] * (float)exp(factor);
}

/* How much sharper strands turn than their targets, as a logarithm, where amplitudes are `factor`, a logarithm, of what they
 * were; 0 where either do not turn at all. */
static groom_status excess(const struct sample *sample, double factor, double *out, const struct groom_context *context,
                           struct groom_diag *diag)
{
    uint32_t m = sample->fit->m;
    set_factor(sample, factor);
    groom_status st = gather_strands(sample->fit, sample->strand, sample->n, sample->fitted, sample->target, context, diag);
    if (st != GROOM_OK)
        return st;
    double found = mean_curvature((const float (*)[3])sample->fitted, sample->n, m);
    double wanted = mean_curvature((const float (*)[3])sample->target, sample->n, m);
    *out = found > 0 && wanted > 0 ? log(found / wanted) : 0;
    return GROOM_OK;
}

/* Secants from no change and a small one on. */
static groom_status find_factor(const struct sample *sample, double *factor, const struct groom_context *context,
                                struct groom_diag *diag)
{
    double here, other, slope;
    groom_status st;
    *factor = 0;
    if ((st = excess(sample, 0, &here, context, diag)) != GROOM_OK ||
        (st = excess(sample, PROBE, &other, context, diag)) != GROOM_OK)
        return st;
    slope = (other - here) / PROBE;
    for (int step = 0; step < STEPS && slope > LEAST_SLOPE; step++) {
        double next = fmin(fmax(*factor - here / slope, -LARGEST), LARGEST);
        if (next == *factor)
            break;
        if ((st = excess(sample, next, &other, context, diag)) != GROOM_OK)
            return st;
        slope = (other - here) / (next - *factor);
        here = other;
        *factor = next;
    }
    return GROOM_OK;
}

groom_status calibrate_frizz(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct sample sample;
    uint32_t n_frizz = 0;
    double factor = 0;
    for (uint32_t o = 0; o < fit->groom->n_operators; o++)
        n_frizz += (uint32_t)is_frizz(&fit->groom->operators[o]);
    if (n_frizz == 0 || fit->n < FEWEST)
        return GROOM_OK;
    groom_status st = sample_init(&sample, fit, context, diag);
    if (st == GROOM_OK)
        st = find_factor(&sample, &factor, context, diag);
    set_factor(&sample, st == GROOM_OK ? factor : 0);
    sample_finish(&sample, context);
    return st;
}
