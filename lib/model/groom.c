/* A groom's memory: create, destroy, clone. */
#include <string.h>

#include "base/memory.h"
#include "groom/groom.h"
#include "model/model.h"

/* One row of the table below: an array of the groom, and its size. */
struct array {
    void **memory;
    size_t count, size;
};

#define N_ARRAYS 8

static void list_arrays(struct groom *g, struct array arrays[N_ARRAYS])
{
    size_t n = g->n_strands, k = g->n_instancing;
    const struct array list[N_ARRAYS] = {
        {(void **)&g->roots, n, sizeof *g->roots},
        {(void **)&g->root_uv, n, sizeof *g->root_uv},
        {(void **)&g->guides, (size_t)g->n_guides * g->n_vertices, sizeof *g->guides},
        {(void **)&g->guide_uv, g->n_guides, sizeof *g->guide_uv},
        {(void **)&g->instancing_guide, n * k, sizeof *g->instancing_guide},
        {(void **)&g->instancing_weight, n * k, sizeof *g->instancing_weight},
        {(void **)&g->operator_guide, g->n_operator_guides, sizeof *g->operator_guide},
        {(void **)&g->operator_guide_of, n, sizeof *g->operator_guide_of},
    };
    memcpy(arrays, list, sizeof list);
}

static groom_status check_shape(struct groom_shape shape, struct groom_diag *diag)
{
    if (shape.n_strands == 0 || shape.n_guides == 0 || shape.n_operator_guides == 0 || shape.n_instancing == 0)
        return groom_fail(diag, GROOM_EINVAL,
                          "a groom needs strands, guides, operator guides and guides to a strand; it has %u, %u, %u, %u",
                          shape.n_strands, shape.n_guides, shape.n_operator_guides, shape.n_instancing);
    if (shape.n_vertices < 3)
        return groom_fail(diag, GROOM_EINVAL, "strands have %u vertices; they need at least 3", shape.n_vertices);
    if (shape.n_instancing > shape.n_guides)
        return groom_fail(diag, GROOM_EINVAL, "each strand blends %u guides, but there are only %u",
                          shape.n_instancing, shape.n_guides);
    if (shape.n_operator_guides > shape.n_guides)
        return groom_fail(diag, GROOM_EINVAL, "%u operator guides are chosen from only %u guides",
                          shape.n_operator_guides, shape.n_guides);
    return GROOM_OK;
}

/* Whether the numbers of array elements fit a size_t (they may not where that has 32 bits). */
static int shape_fits(struct groom_shape shape)
{
    size_t points, weights;
    return !__builtin_mul_overflow((size_t)shape.n_guides, (size_t)shape.n_vertices, &points) &&
           !__builtin_mul_overflow((size_t)shape.n_strands, (size_t)shape.n_instancing, &weights);
}

groom_status groom_create(struct groom_shape shape, const struct groom_context *context, struct groom **out,
                          struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    groom_status status = check_shape(shape, diag);
    if (status != GROOM_OK)
        return status;
    struct groom *groom = shape_fits(shape) ? memory_array_zero(allocator, 1, sizeof *groom) : NULL;
    if (!groom)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom");
    groom->allocator = allocator;
    groom->n_strands = shape.n_strands;
    groom->n_vertices = shape.n_vertices;
    groom->n_guides = shape.n_guides;
    groom->n_operator_guides = shape.n_operator_guides;
    groom->n_instancing = shape.n_instancing;

    struct array arrays[N_ARRAYS];
    list_arrays(groom, arrays);
    for (int i = 0; i < N_ARRAYS; i++)
        if (!(*arrays[i].memory = memory_array_zero(allocator, arrays[i].count, arrays[i].size))) {
            groom_destroy(groom);
            return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom of %u strands and %u guides",
                              shape.n_strands, shape.n_guides);
        }
    *out = groom;
    return GROOM_OK;
}

void groom_destroy(struct groom *groom)
{
    if (!groom)
        return;
    struct array arrays[N_ARRAYS];
    list_arrays(groom, arrays);
    for (int i = 0; i < N_ARRAYS; i++)
        memory_release(groom->allocator, *arrays[i].memory, arrays[i].count, arrays[i].size);
    for (uint32_t i = 0; i < groom->n_operators; i++)
        model_operator_finish(groom, &groom->operators[i]);
    memory_release(groom->allocator, groom->operators, groom->n_operators, sizeof *groom->operators);
    memory_release(groom->allocator, groom, 1, sizeof *groom);
}

struct groom_shape model_shape(const struct groom *groom)
{
    return (struct groom_shape){groom->n_strands, groom->n_vertices, groom->n_guides, groom->n_operator_guides,
                                groom->n_instancing};
}

static groom_status clone_operators(const struct groom *groom, struct groom *copy)
{
    if (groom->n_operators == 0)
        return GROOM_OK;
    copy->operators = memory_array_zero(copy->allocator, groom->n_operators, sizeof *copy->operators);
    if (!copy->operators)
        return GROOM_ENOMEM;
    copy->n_operators = groom->n_operators;
    for (uint32_t i = 0; i < groom->n_operators; i++) {
        const struct groom_operator *from = &groom->operators[i];
        struct groom_operator *to = &copy->operators[i];
        *to = *from;
        if (model_operator_allocate(copy, to) != GROOM_OK)
            return GROOM_ENOMEM;
        for (uint32_t a = 0; a < groom_operator_random_arrays(from->type); a++)
            memcpy(to->random[a], from->random[a], model_random_count(groom, from->type) * sizeof(float));
    }
    return GROOM_OK;
}

groom_status groom_clone(const struct groom *groom, const struct groom_context *context, struct groom **out,
                         struct groom_diag *diag)
{
    struct groom *copy;
    groom_status status = groom_create(model_shape(groom), context, &copy, diag);
    if (status != GROOM_OK)
        return status;
    memcpy(copy->name, groom->name, sizeof copy->name);
    copy->scalp = groom->scalp;
    struct array from[N_ARRAYS], to[N_ARRAYS];
    list_arrays((struct groom *)groom, from);
    list_arrays(copy, to);
    for (int i = 0; i < N_ARRAYS; i++)
        memcpy(*to[i].memory, *from[i].memory, from[i].count * from[i].size);
    if (clone_operators(groom, copy) != GROOM_OK) {
        groom_destroy(copy);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a copy of the groom's operators");
    }
    *out = copy;
    return GROOM_OK;
}
