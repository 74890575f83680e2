/* Stage `instance_weights`: Chang et al. 2025, Section 5.3.
 *
 * Each strand is blended from the guides near it with the weights that bring the clusters' mean
 * strands, not smoothed and without operators, closest to it (Eqs. 3 and 5). The paper takes 2 000
 * steps of Adam; for one strand it is a least-squares problem of a few weights, solved here at its
 * minimum (fit/weights.h), off the ways in which operators move strands, which it must leave to them.
 * method "paper" is the paper's own, as a reference (paper_weights.h). */
#include "base/progress.h"
#include "fit/paper_weights.h"
#include "fit/state.h"
#include "fit/weights.h"

enum phase { SOLVE, ASSIGN, ENDED };

#define STEP_STRANDS 20000

/* Sums over strands become Eq. 5, in square metres; over all steps so far. */
static void add_loss(struct groom_fit *fit, const struct weights_loss *loss)
{
    double unit = (double)fit->scale * fit->scale / ((double)fit->n * fit->m);
    if (fit->iteration == 0)
        report_loss(&fit->report, "instance_weights", "L_x", 0, 0);
    fit->report.losses[fit->report.n_losses - 1].before += unit * loss->before;
    fit->report.losses[fit->report.n_losses - 1].after += unit * loss->after;
}

static void end_phase(struct groom_fit *fit, const struct groom_context *context)
{
    progress_loss(context, "L_x", 0, fit->report.losses[fit->report.n_losses - 1].before);
    progress_loss(context, "L_x", 1, fit->report.losses[fit->report.n_losses - 1].after);
    fit->phase = ASSIGN;
    fit->iteration = 0;
}

static groom_status solve(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t count = fit->n - fit->iteration < STEP_STRANDS ? fit->n - fit->iteration : STEP_STRANDS;
    struct weights_loss loss = {0};
    groom_status st = fit->options.stages.instance_weights.method == GROOM_FIT_PAPER
                          ? paper_weights_solve(fit, fit->iteration, count, context, &loss, diag)
                          : weights_solve(fit, fit->iteration, count, context, &loss, diag);
    if (st != GROOM_OK)
        return st;
    add_loss(fit, &loss);
    fit->iteration += count;
    if (fit->iteration == fit->n)
        end_phase(fit, context);
    return GROOM_OK;
}

groom_status instance_weights_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                                   struct groom_diag *diag)
{
    if (fit->phase == SOLVE)
        return solve(fit, context, diag);
    return assign_step(fit, ended, context, diag); /* strands have moved: ask again what is in the head */
}

double instance_weights_fraction(const struct groom_fit *fit)
{
    return 0.5 * fit->phase + 0.5 * fit->iteration / fit->n;
}

int instance_weights_sound(const struct groom_fit *fit)
{
    return fit->phase < ENDED && fit->iteration < fit->n &&
           (fit->phase == ASSIGN || fit->iteration == 0 || fit->report.n_losses > 0);
}
