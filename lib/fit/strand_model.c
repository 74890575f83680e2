#include "fit/strand_model.h"

#include <math.h>
#include <string.h>

#include "fit/draws.h"

#define CIRCLE_DEVIATION 0.7071067812  /* of a coordinate of a point on the unit circle */
#define COMMON_SCALE 0.3               /* random scale, */
#define COMMON_BEND 0.8                /* angle, and */
#define COMMON_CLUMP 1.0               /* profile, that hair may have before it is known */
#define BEND_STEEPNESS 10.0
#define NEAR_LEVEL 0.7                 /* |e.y| below this: crossed with y, else with x */

/* --- the chain ------------------------------------------------------------------------- */

/* Root mean square distance of roots from those of their operator guides, a coordinate, in the target's frame. */
static double distance_to_operator_guides(const struct groom_fit *fit)
{
    const struct groom *groom = fit->groom;
    double sum = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        const float *head = groom->guides[(size_t)groom->operator_guide[groom->operator_guide_of[i]] * fit->m];
        for (int c = 0; c < 3; c++)
            sum += ((double)groom->roots[i][c] - head[c]) * ((double)groom->roots[i][c] - head[c]);
    }
    return sqrt(sum / (3.0 * fit->n)) / fit->scale;
}

static void look_at(struct strand_model *model, const struct groom_operator *op)
{
    switch (op->type) {
    case GROOM_OPERATOR_SCALE:
        model->scale = DRAWS_DEVIATION * fmax(op->parameter[0], COMMON_SCALE);
        break;
    case GROOM_OPERATOR_BEND:
        model->bend = CIRCLE_DEVIATION * fmax(op->parameter[0], COMMON_BEND);
        model->bend_start = op->parameter[1];
        break;
    case GROOM_OPERATOR_CLUMP:
        model->profile = fmax(model->profile + op->parameter[0], COMMON_CLUMP);
        model->gather = distance_to_operator_guides(model->fit);
        break;
    default: break; /* makes waves, or is no operator of a fit */
    }
}

void strand_model_init(struct strand_model *model, const struct groom_fit *fit, const double (*shape)[3])
{
    const struct groom *groom = fit->groom;
    *model = (struct strand_model){.fit = fit, .m = fit->m, .shape = shape};
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (groom->operators[o].enabled)
            look_at(model, &groom->operators[o]);
}

/* --- ways ------------------------------------------------------------------------------- */

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

static double normalize(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int c = 0; c < 3 && length > 0; c++)
        v[c] /= length;
    return length;
}

/* Two unit vectors across the strand's operator guide at its root. */
static void bend_axes(const struct strand_model *model, uint32_t i, double axis[2][3])
{
    const struct groom *groom = model->fit->groom;
    const double *s = model->shape[(size_t)groom->operator_guide[groom->operator_guide_of[i]] * model->m + 1];
    double e[3] = {s[0], s[1], s[2]}, aside[3] = {0};
    if (!(normalize(e) > 0))
        e[1] = 1;
    aside[fabs(e[1]) < NEAR_LEVEL ? 1 : 0] = 1;
    cross(e, aside, axis[0]);
    normalize(axis[0]);
    cross(e, axis[0], axis[1]);
}

/* sum_i q_i (axis x e_i): model/bend.c for a small angle, with vertices taken as evenly spaced. */
static void bend_way(const struct strand_model *model, const double (*line)[3], const double axis[3], double (*way)[3])
{
    uint32_t m = model->m;
    double all = 0, begun = 0;
    for (uint32_t j = 1; j < m; j++)
        all += 1 / (1 + exp(-BEND_STEEPNESS * ((double)j / (m - 1) - model->bend_start)));
    memset(way[0], 0, sizeof way[0]);
    for (uint32_t j = 1; j < m; j++) {
        double e[3] = {line[j][0] - line[j - 1][0], line[j][1] - line[j - 1][1], line[j][2] - line[j - 1][2]}, turned[3];
        begun += 1 / (1 + exp(-BEND_STEEPNESS * ((double)j / (m - 1) - model->bend_start)));
        cross(axis, e, turned);
        for (int c = 0; c < 3; c++)
            way[j][c] = way[j - 1][c] + model->bend * begun / all * turned[c];
    }
}

static void clump_ways(const struct strand_model *model, double (*ways)[3])
{
    uint32_t m = model->m;
    memset(ways, 0, 3 * (size_t)m * sizeof *ways);
    for (int c = 0; c < 3; c++)
        for (uint32_t j = 0; j < m; j++)
            ways[(size_t)c * m + j][c] = model->gather * (1 - exp(-model->profile * j / (m - 1)));
}

uint32_t strand_ways(const struct strand_model *model, uint32_t i, const double (*blend)[3], double (*ways)[3])
{
    uint32_t n = 0, m = model->m;
    if (model->scale > 0) {
        for (uint32_t j = 0; j < m; j++)
            for (int c = 0; c < 3; c++)
                ways[j][c] = model->scale * blend[j][c];
        n++;
    }
    if (model->bend > 0) {
        double axis[2][3];
        bend_axes(model, i, axis);
        for (int a = 0; a < 2; a++, n++)
            bend_way(model, blend, axis[a], ways + (size_t)n * m);
    }
    if (model->gather > 0) {
        clump_ways(model, ways + (size_t)n * m);
        n += 3;
    }
    return n;
}
