#include "fit/loss_guides.h"

#include "base/memory.h"

#define STRANDS_AT_ONCE 4096

struct groom loss_guides_mean(const struct groom *groom, struct groom_operator operators[GROOM_FIT_MAX_OPERATORS])
{
    struct groom mean = *groom;
    for (uint32_t o = 0; o < groom->n_operators; o++) { /* there may be none, and then no array either */
        operators[o] = groom->operators[o];
        operators[o].enabled &= operators[o].type == GROOM_OPERATOR_CLUMP;
    }
    mean.operators = operators;
    return mean;
}

static double squares(const struct groom_fit *fit, uint32_t first, uint32_t count, const float (*x)[3])
{
    const float (*target)[3] = (const float (*)[3])(fit->target + (size_t)first * fit->m);
    double sum = 0;
    for (size_t v = 0; v < (size_t)count * fit->m; v++)
        for (int c = 0; c < 3; c++) {
            double d = (double)x[v][c] - ((double)target[v][c] * fit->scale + fit->centre[c]);
            sum += d * d;
        }
    return sum;
}

groom_status loss_guides(const struct groom_fit *fit, double *loss, const struct groom_context *context,
                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_operator operators[GROOM_FIT_MAX_OPERATORS];
    struct groom mean = loss_guides_mean(fit->groom, operators);
    uint32_t most = fit->n < STRANDS_AT_ONCE ? fit->n : STRANDS_AT_ONCE;
    float (*x)[3] = memory_array(allocator, (size_t)most * fit->m, sizeof *x);
    groom_status st = x ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to measure %u strands", most);
    double sum = 0;
    for (uint32_t first = 0; st == GROOM_OK && first < fit->n; first += most) {
        uint32_t count = fit->n - first < most ? fit->n - first : most;
        st = groom_evaluate(&mean, first, count, x, context, diag);
        if (st == GROOM_OK)
            sum += squares(fit, first, count, (const float (*)[3])x);
    }
    if (st == GROOM_OK)
        *loss = sum / ((double)fit->n * fit->m);
    memory_release(allocator, x, (size_t)most * fit->m, sizeof *x);
    return st;
}
