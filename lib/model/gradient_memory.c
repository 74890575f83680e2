/* A gradient's memory: create, destroy, zero. */
#include <string.h>

#include "base/memory.h"
#include "groom/groom.h"
#include "model/gradient.h"
#include "model/model.h"

size_t gradient_random_count(const struct groom_gradient *g, uint32_t i)
{
    return groom_operator_random_per_guide(g->operators[i].type) ? g->shape.n_operator_guides : g->shape.n_strands;
}

static size_t n_points(const struct groom_gradient *g) { return (size_t)g->shape.n_guides * g->shape.n_vertices; }

static size_t n_weights(const struct groom_gradient *g) { return (size_t)g->shape.n_strands * g->shape.n_instancing; }

static groom_status allocate_operators(const struct groom *groom, struct groom_gradient *g)
{
    g->operators = memory_array_zero(g->allocator, groom->n_operators, sizeof *g->operators);
    if (!g->operators)
        return GROOM_ENOMEM;
    g->n_operators = groom->n_operators;
    for (uint32_t i = 0; i < g->n_operators; i++)
        g->operators[i].type = groom->operators[i].type;
    for (uint32_t i = 0; i < g->n_operators; i++)
        for (uint32_t a = 0; a < groom_operator_random_arrays(g->operators[i].type); a++) {
            g->operators[i].random[a] = memory_array_zero(g->allocator, gradient_random_count(g, i), sizeof(float));
            if (!g->operators[i].random[a])
                return GROOM_ENOMEM;
        }
    return GROOM_OK;
}

groom_status groom_gradient_create(const struct groom *groom, const struct groom_context *context,
                                   struct groom_gradient **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_gradient *g = memory_array_zero(allocator, 1, sizeof *g);
    if (!g)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a gradient");
    g->allocator = allocator;
    g->shape = model_shape(groom);
    g->guides = memory_array_zero(allocator, n_points(g), sizeof *g->guides);
    g->instancing_weight = memory_array_zero(allocator, n_weights(g), sizeof *g->instancing_weight);
    if (!g->guides || !g->instancing_weight || allocate_operators(groom, g) != GROOM_OK) {
        groom_gradient_destroy(g);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the gradient of %u strands", groom->n_strands);
    }
    *out = g;
    return GROOM_OK;
}

void groom_gradient_destroy(struct groom_gradient *g)
{
    if (!g)
        return;
    for (uint32_t i = 0; g->operators && i < g->n_operators; i++)
        for (int a = 0; a < GROOM_OPERATOR_MAX_RANDOM; a++)
            memory_release(g->allocator, g->operators[i].random[a], gradient_random_count(g, i), sizeof(float));
    memory_release(g->allocator, g->operators, g->n_operators, sizeof *g->operators);
    memory_release(g->allocator, g->instancing_weight, n_weights(g), sizeof *g->instancing_weight);
    memory_release(g->allocator, g->guides, n_points(g), sizeof *g->guides);
    memory_release(g->allocator, g, 1, sizeof *g);
}

void gradient_zero(struct groom_gradient *g)
{
    if (g->guides)
        memset(g->guides, 0, n_points(g) * sizeof *g->guides);
    if (g->instancing_weight)
        memset(g->instancing_weight, 0, n_weights(g) * sizeof *g->instancing_weight);
    for (uint32_t i = 0; g->operators && i < g->n_operators; i++) {
        memset(g->operators[i].parameter, 0, sizeof g->operators[i].parameter);
        for (int a = 0; a < GROOM_OPERATOR_MAX_RANDOM; a++)
            if (g->operators[i].random[a])
                memset(g->operators[i].random[a], 0, gradient_random_count(g, i) * sizeof(float));
    }
}

int gradient_matches(const struct groom_gradient *g, const struct groom *groom)
{
    struct groom_shape shape = model_shape(groom);
    if (memcmp(&g->shape, &shape, sizeof shape) != 0 || g->n_operators != groom->n_operators)
        return 0;
    for (uint32_t i = 0; g->operators && i < g->n_operators; i++)
        if (g->operators[i].type != groom->operators[i].type)
            return 0;
    return 1;
}
