/* The assignment of operator guides as a phase of a stage. */
#include <math.h>

#include "fit/assign.h"
#include "fit/state.h"

#define STEP_STRANDS 20000

float assign_clump_profile(const struct groom *groom)
{
    float profile = 0;
    for (uint32_t i = 0; i < groom->n_operators; i++)
        if (groom->operators[i].type == GROOM_OPERATOR_CLUMP)
            profile = fmaxf(profile, fmaxf(groom->operators[i].parameter[0], 1));
    return profile;
}

static groom_status assign_some(struct groom_fit *fit, float profile, const struct groom_context *context,
                                struct groom_diag *diag)
{
    float clearance = (float)fit->options.stages.initialize.head_clearance * fit->ordinary;
    uint32_t first = fit->iteration, count = fit->n - first < STEP_STRANDS ? fit->n - first : STEP_STRANDS;
    struct assign_counts counts = {0};
    groom_status st = assign_out_of_head(fit->groom, fit->bvh, profile, clearance, first, count, context, &counts, diag);
    if (st != GROOM_OK)
        return st;
    if (first == 0)
        fit->report.n_reassigned = fit->report.n_penetrating = 0;
    fit->report.n_reassigned += counts.n_reassigned;
    fit->report.n_penetrating += counts.n_penetrating;
    fit->iteration += count;
    return GROOM_OK;
}

groom_status assign_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                         struct groom_diag *diag)
{
    float profile = assign_clump_profile(fit->groom);
    if (fit->bvh && profile > 0) {
        groom_status st = assign_some(fit, profile, context, diag);
        if (st != GROOM_OK || fit->iteration < fit->n)
            return st;
    }
    if (groom_validate(fit->groom, diag) != GROOM_OK)
        return groom_fail(diag, GROOM_EINTERNAL, "stage %s made a groom that is none", groom_fit_stage_name(fit->stage));
    *ended = 1;
    return GROOM_OK;
}
