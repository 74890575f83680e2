#include "server/worker/retarget_groom.h"

#include <stdlib.h>

#include "groom/strands.h"

#define BLOCK 1024 /* strands that are evaluated at a time */

groom_status retarget_groom_without(const struct groom *groom, const unsigned char *bald, const struct groom_context *context,
                                    struct groom **kept, struct groom_diag *diag)
{
    uint32_t n = 0, *strand = malloc(groom->n_strands * sizeof *strand);
    if (!strand)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom's strands");
    for (uint32_t i = 0; i < groom->n_strands; i++)
        if (!bald[i])
            strand[n++] = i;
    groom_status st = groom_select(groom, strand, n, context, kept, diag);
    free(strand);
    return st;
}

/* The chain's operators proper alone: a view. */
static struct groom without_layers(const struct groom *groom, struct groom_operator *operators)
{
    struct groom view = *groom;
    for (uint32_t i = 0; i < groom->n_operators; i++) {
        operators[i] = groom->operators[i];
        operators[i].enabled = operators[i].enabled && !groom_operator_is_layer(operators[i].type);
    }
    view.operators = operators;
    return view;
}

static uint32_t vertices_of(const struct groom *groom, uint32_t strand)
{
    return groom->n_base ? groom->first[strand + 1] - groom->first[strand] : groom->n_vertices;
}

static void divide(const struct groom *groom, uint32_t first, uint32_t count, const float (*before)[3], const float (*after)[3],
                   float *stretch)
{
    uint32_t at = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t n = vertices_of(groom, first + i);
        double length = groom_polyline_length(before + at, n);
        stretch[first + i] = length > 0 ? (float)(groom_polyline_length(after + at, n) / length) : 1;
        at += n;
    }
}

groom_status retarget_groom_stretch(const struct groom *before, const struct groom *after, const struct groom_context *context,
                                    float *stretch, struct groom_diag *diag)
{
    struct groom_operator *operators = calloc(2 * (size_t)before->n_operators + 1, sizeof *operators);
    float(*points)[3] = malloc(2 * (size_t)BLOCK * before->n_vertices * sizeof *points);
    groom_status st = operators && points ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to evaluate strands");
    if (st == GROOM_OK) {
        const struct groom of[2] = {without_layers(before, operators), without_layers(after, operators + before->n_operators)};
        float(*other)[3] = points + (size_t)BLOCK * before->n_vertices;
        for (uint32_t first = 0; st == GROOM_OK && first < before->n_strands; first += BLOCK) {
            uint32_t count = before->n_strands - first < BLOCK ? before->n_strands - first : BLOCK;
            st = groom_evaluate(&of[0], first, count, points, context, diag);
            if (st == GROOM_OK)
                st = groom_evaluate(&of[1], first, count, other, context, diag);
            if (st == GROOM_OK)
                divide(before, first, count, (const float(*)[3])points, (const float(*)[3])other, stretch);
        }
    }
    free(points);
    free(operators);
    return st;
}
