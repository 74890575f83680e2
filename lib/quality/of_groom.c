/* A groom against its target, before and after its random numbers were fitted. */
#include <string.h>

#include "groom/groom.h"
#include "groom/quality.h"
#include "groom/strands.h"

static groom_status evaluate(const struct groom *groom, const struct groom_context *context, struct groom_strands **out,
                             struct groom_diag *diag)
{
    struct groom_strands *strands;
    groom_status st = groom_strands_create(groom->n_strands, (uint64_t)groom->n_strands * groom->n_vertices, context,
                                           &strands, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i <= groom->n_strands; i++)
        strands->first[i] = i * groom->n_vertices;
    if ((st = groom_evaluate(groom, 0, groom->n_strands, strands->points, context, diag)) == GROOM_OK)
        *out = strands;
    else
        groom_strands_destroy(strands);
    return st;
}

static groom_status compare(const struct groom_quality_target *target, const struct groom *groom,
                            const struct groom_context *context, struct groom_quality *quality, struct groom_diag *diag)
{
    struct groom_strands *strands = NULL;
    groom_status st = evaluate(groom, context, &strands, diag);
    if (st == GROOM_OK)
        st = groom_quality_compare(target, strands, context, quality, diag);
    groom_strands_destroy(strands);
    return st;
}

static int same_numbers(const struct groom *groom, uint32_t o, const struct groom *other)
{
    const struct groom_operator *a = &groom->operators[o], *b = &other->operators[o];
    uint32_t n = groom_operator_random_per_guide(a->type) ? groom->n_operator_guides : groom->n_strands;
    for (uint32_t r = 0; r < groom_operator_random_arrays(a->type); r++)
        if (memcmp(a->random[r], b->random[r], n * sizeof *a->random[r]) != 0)
            return 0;
    return 1;
}

/* Returns whether anything changed. */
static int draw_all(const struct groom *groom, struct groom *copy)
{
    int changed = 0;
    for (uint32_t o = 0; o < copy->n_operators; o++) {
        groom_draw_random(copy, &copy->operators[o], copy->operators[o].seed);
        changed |= !same_numbers(groom, o, copy);
    }
    return changed;
}

groom_status groom_quality_of_groom(const struct groom_quality_target *target, const struct groom *groom,
                                    const struct groom_context *context, struct groom_quality *fitted,
                                    struct groom_quality *drawn, struct groom_diag *diag)
{
    struct groom *copy = NULL;
    groom_status st;
    if ((st = compare(target, groom, context, fitted, diag)) != GROOM_OK ||
        (st = groom_clone(groom, context, &copy, diag)) != GROOM_OK)
        goto out;
    *drawn = *fitted;
    if (draw_all(groom, copy))
        st = compare(target, copy, context, drawn, diag);
out:
    groom_destroy(copy);
    return st;
}
