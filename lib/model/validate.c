/* Whether a groom can be evaluated: everything that came from outside is looked at once, here. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "groom/groom.h"
#include "model/model.h"

#define WEIGHT_SUM_TOLERANCE 1e-3
#define AXES_TOLERANCE 1e-3
#define COORDINATE_LIMIT 1e6f /* metres */
#define WEIGHT_LIMIT 1e4f

/* Finite, and within `limit` either way, so that lengths and their squares stay finite too. */
static groom_status check_values(const float *values, size_t n, float limit, const char *pointer,
                                 struct groom_diag *diag)
{
    for (size_t i = 0; i < n; i++)
        if (!(fabsf(values[i]) <= limit))
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "value %zu of %zu is %g; it must be finite and within %g",
                                    i, n, (double)values[i], (double)limit);
    return GROOM_OK;
}

static groom_status check_indices(const uint32_t *indices, size_t n, uint32_t limit, const char *pointer,
                                  struct groom_diag *diag)
{
    for (size_t i = 0; i < n; i++)
        if (indices[i] >= limit)
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "index %u at %zu is outside 0..%u", indices[i], i,
                                    limit - 1);
    return GROOM_OK;
}

/* Three unit vectors, each across the others, the third where the right hand has it. */
static groom_status check_axes(const struct groom *groom, struct groom_diag *diag)
{
    const float (*a)[3] = model_axes(groom);
    double off = 0.0;
    if (!a)
        return GROOM_OK;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        double square = 0.0, across = 0.0;
        for (int c = 0; c < 3; c++) {
            square += (double)a[i][c] * a[i][c];
            across += (double)a[i][c] * a[j][c];
            double cross = (double)a[i][(c + 1) % 3] * a[j][(c + 2) % 3] - (double)a[i][(c + 2) % 3] * a[j][(c + 1) % 3];
            off = fmax(off, fabs(cross - (double)a[k][c]));
        }
        off = fmax(off, fmax(fabs(square - 1.0), fabs(across)));
    }
    if (off <= AXES_TOLERANCE)
        return GROOM_OK;
    return groom_fail_field(diag, GROOM_EINVAL, "/axes",
                            "axes are three unit vectors at right angles to each other, right-handed; these are off by %.3g", off);
}

static groom_status check_weights(const struct groom *groom, struct groom_diag *diag)
{
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        double sum = 0.0;
        for (uint32_t k = 0; k < groom->n_instancing; k++)
            sum += groom->instancing_weight[(size_t)i * groom->n_instancing + k];
        if (!(fabs(sum - 1.0) <= WEIGHT_SUM_TOLERANCE))
            return groom_fail_field(diag, GROOM_EINVAL, "/instancing/weight",
                                    "the weights of strand %u sum to %.6g; they must sum to 1", i, sum);
    }
    return GROOM_OK;
}

static groom_status refuse_parameter(const struct groom_operator_parameter *parameter, uint32_t index, float value,
                                     struct groom_diag *diag)
{
    char pointer[sizeof diag->pointer];
    snprintf(pointer, sizeof pointer, "/operators/%u/%s", index, parameter->name);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "%s is %.6g; it must be %.6g..%.6g %s", parameter->name,
                            (double)value, (double)parameter->minimum, (double)parameter->maximum,
                            strcmp(parameter->unit, "count") ? parameter->unit : "and a whole number");
}

static groom_status check_parameters(const struct groom_operator *op, uint32_t index, struct groom_diag *diag)
{
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(op->type, &n);
    for (uint32_t p = 0; p < n; p++) {
        float value = op->parameter[p];
        int whole = strcmp(parameters[p].unit, "count") || value == floorf(value);
        if (!(value >= parameters[p].minimum && value <= parameters[p].maximum) || !whole)
            return refuse_parameter(&parameters[p], index, value, diag);
    }
    return GROOM_OK;
}

static groom_status check_randoms(const struct groom *groom, uint32_t index, struct groom_diag *diag)
{
    const struct groom_operator *op = &groom->operators[index];
    char pointer[sizeof diag->pointer];
    uint32_t n;
    const struct groom_operator_random *randoms = groom_operator_randoms(op->type, &n);
    for (uint32_t a = 0; a < n; a++)
        for (size_t i = 0; i < model_random_count(groom, op->type); i++) {
            float value = op->random[a][i];
            if (value >= randoms[a].minimum && value <= randoms[a].maximum)
                continue;
            snprintf(pointer, sizeof pointer, "/operators/%u/random/%s", index, randoms[a].name);
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "value %zu is %.6g; it must be %g..%g", i,
                                    (double)value, (double)randoms[a].minimum, (double)randoms[a].maximum);
        }
    return GROOM_OK;
}

groom_status model_validate_operator(const struct groom *groom, uint32_t index, struct groom_diag *diag)
{
    char pointer[sizeof diag->pointer];
    const struct groom_operator *op = &groom->operators[index];
    snprintf(pointer, sizeof pointer, "/operators/%u/type", index);
    if ((unsigned)op->type >= GROOM_OPERATOR_TYPES)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "there is no operator type %d", (int)op->type);
    if (groom->n_operator_guides == 0 && groom_operator_needs_guides(op->type))
        return groom_fail_field(diag, GROOM_EINVAL, pointer, MODEL_NEEDS_GUIDES, groom_operator_name(op->type));
    groom_status status = check_parameters(op, index, diag);
    if (status == GROOM_OK)
        status = check_randoms(groom, index, diag);
    if (status == GROOM_OK && op->layer)
        status = layer_validate(groom, index, diag);
    return status;
}

static groom_status check_operators(const struct groom *groom, struct groom_diag *diag)
{
    groom_status status = GROOM_OK;
    for (uint32_t i = 0; i < groom->n_operators && status == GROOM_OK; i++)
        status = model_validate_operator(groom, i, diag);
    return status;
}

groom_status groom_validate(const struct groom *g, struct groom_diag *diag)
{
    size_t n = g->n_strands, k = g->n_instancing;
    groom_status status = GROOM_OK;
#define CHECK(call)                                                                                                  \
    if (status == GROOM_OK)                                                                                          \
    status = call
    CHECK(check_values(&g->axes[0][0], 9, 2.0f, "/axes", diag));
    CHECK(check_axes(g, diag));
    if (g->base)
        CHECK(check_values(&g->base[0][0], 3 * (size_t)g->n_base, COORDINATE_LIMIT, "/base/points", diag));
    CHECK(check_values(&g->roots[0][0], 3 * n, COORDINATE_LIMIT, "/strands/roots", diag));
    CHECK(check_values(&g->root_uv[0][0], 2 * n, COORDINATE_LIMIT, "/strands/root_uv", diag));
    CHECK(check_values(&g->guides[0][0], 3 * (size_t)g->n_guides * g->n_vertices, COORDINATE_LIMIT, "/guides/points", diag));
    CHECK(check_values(&g->guide_uv[0][0], 2 * (size_t)g->n_guides, COORDINATE_LIMIT, "/guides/root_uv", diag));
    CHECK(check_indices(g->instancing_guide, n * k, g->n_guides, "/instancing/guide", diag));
    CHECK(check_values(g->instancing_weight, n * k, WEIGHT_LIMIT, "/instancing/weight", diag));
    if (!g->base)
        CHECK(check_weights(g, diag));
    CHECK(check_indices(g->operator_guide, g->n_operator_guides, g->n_guides, "/operator_guides/guide", diag));
    CHECK(check_indices(g->operator_guide_of, g->n_operator_guides ? n : 0, g->n_operator_guides, "/operator_guides/of_strand", diag));
    CHECK(check_operators(g, diag));
#undef CHECK
    return status;
}
