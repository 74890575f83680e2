#include "fit/gather.h"

#include "groom/strands.h"

groom_status gather_evaluated(const struct groom_fit *fit, const uint32_t *strand, uint32_t n, float (*points)[3],
                              const struct groom_context *context, struct groom_diag *diag)
{
    struct groom *groom = NULL;
    groom_status st = groom_select(fit->groom, strand, n, context, &groom, diag);
    if (st == GROOM_OK)
        st = groom_evaluate(groom, 0, n, points, context, diag);
    groom_destroy(groom);
    return st;
}

void gather_targets(const struct groom_fit *fit, const uint32_t *strand, uint32_t n, float (*target)[3])
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++)
                target[(size_t)i * fit->m + j][c] =
                    fit->target[(size_t)strand[i] * fit->m + j][c] * fit->scale + fit->centre[c];
}

groom_status gather_strands(const struct groom_fit *fit, const uint32_t *strand, uint32_t n, float (*fitted)[3],
                            float (*target)[3], const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_strands *evaluated = NULL;
    groom_status st = groom_strands_create(n, (uint64_t)n * fit->m, context, &evaluated, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i <= n; i++)
        evaluated->first[i] = i * fit->m;
    if ((st = gather_evaluated(fit, strand, n, evaluated->points, context, diag)) == GROOM_OK &&
        (st = groom_strands_resample(evaluated, fit->m, fitted, context, diag)) == GROOM_OK && target)
        gather_targets(fit, strand, n, target);
    groom_strands_destroy(evaluated);
    return st;
}
