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

#define N_ARRAYS 10
#define N_ALWAYS 8 /* the others belong to a base, and are NULL without one */

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
        {(void **)&g->operator_guide_of, g->n_operator_guides ? n : 0, sizeof *g->operator_guide_of},
        {(void **)&g->first, g->n_base ? n + 1 : 0, sizeof *g->first},
        {(void **)&g->base, g->n_base, sizeof *g->base},
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

/* Takes the groom over. */
static groom_status allocate_arrays(struct groom *groom, struct groom **out, struct groom_diag *diag)
{
    struct array arrays[N_ARRAYS];
    list_arrays(groom, arrays);
    for (int i = 0; i < N_ALWAYS; i++)
        if (!(*arrays[i].memory = memory_array_zero(groom->allocator, arrays[i].count, arrays[i].size))) {
            uint32_t n_strands = groom->n_strands;
            groom_destroy(groom);
            return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom of %u strands", n_strands);
        }
    *out = groom;
    return GROOM_OK;
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
    return allocate_arrays(groom, out, diag);
}

/* --- of strands ------------------------------------------------------------------------ */

static groom_status check_strands(const struct groom_strands *strands, struct groom_diag *diag)
{
    if (strands->n_strands == 0)
        return groom_fail(diag, GROOM_EINVAL, "a groom needs strands; there are none");
    for (uint32_t i = 0; i < strands->n_strands; i++)
        if (strands->first[i + 1] < strands->first[i] + 2)
            return groom_fail(diag, GROOM_EINVAL, "strand %u has fewer than 2 vertices", i);
    return GROOM_OK;
}

static uint32_t most_vertices(const uint32_t *first, uint32_t n_strands)
{
    uint32_t most = 0;
    for (uint32_t i = 0; i < n_strands; i++)
        most = first[i + 1] - first[i] > most ? first[i + 1] - first[i] : most;
    return most;
}

static void copy_strands(const struct groom_strands *strands, struct groom *groom)
{
    memcpy(groom->first, strands->first, ((size_t)strands->n_strands + 1) * sizeof *groom->first);
    memcpy(groom->base, strands->points, (size_t)strands->n_vertices * sizeof *groom->base);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        memcpy(groom->roots[i], groom->base[groom->first[i]], sizeof groom->roots[i]);
    if (strands->root_uv)
        memcpy(groom->root_uv, strands->root_uv, groom->n_strands * sizeof *groom->root_uv);
    groom->scalp = strands->root_uv ? GROOM_SCALP_FILE : GROOM_SCALP_ROOTS;
}

groom_status groom_create_of_strands(const struct groom_strands *strands, const struct groom_context *context,
                                     struct groom **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    groom_status status = check_strands(strands, diag);
    if (status != GROOM_OK)
        return status;
    struct groom *made = NULL, *groom = memory_array_zero(allocator, 1, sizeof *groom);
    if (!groom)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom");
    groom->allocator = allocator;
    groom->n_strands = strands->n_strands;
    groom->n_vertices = most_vertices(strands->first, strands->n_strands);
    if ((status = allocate_arrays(groom, &made, diag)) != GROOM_OK)
        return status;
    if (model_give_base(made, strands->n_vertices) != GROOM_OK) {
        groom_destroy(made);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a groom of %u strands", strands->n_strands);
    }
    copy_strands(strands, made);
    *out = made;
    return GROOM_OK;
}

groom_status model_give_base(struct groom *groom, uint32_t n_base)
{
    groom->first = memory_array_zero(groom->allocator, (size_t)groom->n_strands + 1, sizeof *groom->first);
    groom->base = memory_array_zero(groom->allocator, n_base, sizeof *groom->base);
    if (groom->first && groom->base) {
        groom->n_base = n_base;
        return GROOM_OK;
    }
    memory_release(groom->allocator, groom->first, (size_t)groom->n_strands + 1, sizeof *groom->first);
    memory_release(groom->allocator, groom->base, n_base, sizeof *groom->base);
    groom->first = NULL;
    groom->base = NULL;
    return GROOM_ENOMEM;
}

const float *model_root(const struct groom *groom, uint32_t strand)
{
    return groom->base ? groom->base[groom->first[strand]] : groom->roots[strand];
}

size_t groom_first_vertex(const struct groom *groom, uint32_t strand)
{
    return groom->base ? groom->first[strand] : (size_t)strand * groom->n_vertices;
}

struct groom groom_with_base(const struct groom *groom, const struct groom_strands *base, uint32_t begin, uint32_t end)
{
    struct groom view = *groom;
    if (base) {
        view.n_base = base->n_vertices;
        view.first = base->first;
        view.base = base->points;
    }
    view.operators += begin;
    view.n_operators = end - begin;
    return view;
}

const float (*model_axes(const struct groom *groom))[3]
{
    static const float space[3][3];
    return memcmp(groom->axes, space, sizeof space) == 0 ? NULL : (const float (*)[3])groom->axes;
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
        to->type = from->type;
        if (model_operator_allocate(copy, to) != GROOM_OK || model_operator_copy(copy, from, to) != GROOM_OK)
            return GROOM_ENOMEM;
        for (uint32_t a = 0; a < groom_operator_random_arrays(from->type); a++)
            memcpy(to->random[a], from->random[a], model_random_count(groom, from->type) * sizeof(float));
    }
    return GROOM_OK;
}

static groom_status create_like(const struct groom *groom, const struct groom_context *context, struct groom **out,
                                struct groom_diag *diag)
{
    const struct groom_strands base = {groom->n_strands, groom->n_base, groom->first, groom->base, NULL, NULL};
    if (groom->n_guides == 0)
        return groom_create_of_strands(&base, context, out, diag);
    groom_status status = groom_create(model_shape(groom), context, out, diag);
    if (status != GROOM_OK || !groom->base || model_give_base(*out, groom->n_base) == GROOM_OK)
        return status;
    groom_destroy(*out);
    return groom_fail(diag, GROOM_ENOMEM, "no memory for a copy of %u strands", groom->n_strands);
}

groom_status groom_clone(const struct groom *groom, const struct groom_context *context, struct groom **out,
                         struct groom_diag *diag)
{
    struct groom *copy;
    groom_status status = create_like(groom, context, &copy, diag);
    if (status != GROOM_OK)
        return status;
    memcpy(copy->name, groom->name, sizeof copy->name);
    memcpy(copy->base_strands, groom->base_strands, sizeof copy->base_strands);
    copy->scalp = groom->scalp;
    memcpy(copy->axes, groom->axes, sizeof copy->axes);
    struct array from[N_ARRAYS], to[N_ARRAYS];
    list_arrays((struct groom *)groom, from);
    list_arrays(copy, to);
    for (int i = 0; i < N_ARRAYS; i++)
        if (*from[i].memory)
            memcpy(*to[i].memory, *from[i].memory, from[i].count * from[i].size);
    if (clone_operators(groom, copy) != GROOM_OK) {
        groom_destroy(copy);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a copy of the groom's operators");
    }
    *out = copy;
    return GROOM_OK;
}
