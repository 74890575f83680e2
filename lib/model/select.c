/* A groom of fewer strands. */
#include <string.h>

#include "groom/groom.h"
#include "groom/random.h"
#include "model/model.h"

/* "fair" in a stream of its own, so that no operator's numbers are used. */
static const struct groom_random_key fair_key = {0x66616972, 0xffffffff};

void groom_fair_order(uint32_t n, uint32_t *order)
{
    for (uint32_t i = 0; i < n; i++)
        order[i] = i;
    for (uint32_t i = n; i > 1; i--) { /* Fisher and Yates, from the end */
        uint32_t j = groom_random_below(fair_key, i, 0, i), last = order[i - 1];
        order[i - 1] = order[j];
        order[j] = last;
    }
}

static void copy_rows(void *to, const void *from, size_t row_bytes, const uint32_t *strand, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        memcpy((char *)to + i * row_bytes, (const char *)from + strand[i] * row_bytes, row_bytes);
}

static void copy_strands(const struct groom *from, const uint32_t *strand, uint32_t count, struct groom *to)
{
    size_t k = from->n_instancing;
    copy_rows(to->roots, from->roots, sizeof *from->roots, strand, count);
    copy_rows(to->root_uv, from->root_uv, sizeof *from->root_uv, strand, count);
    copy_rows(to->instancing_guide, from->instancing_guide, k * sizeof *from->instancing_guide, strand, count);
    copy_rows(to->instancing_weight, from->instancing_weight, k * sizeof *from->instancing_weight, strand, count);
    if (from->n_operator_guides)
        copy_rows(to->operator_guide_of, from->operator_guide_of, sizeof *from->operator_guide_of, strand, count);
}

static void copy_guides(const struct groom *from, struct groom *to)
{
    size_t n_points = (size_t)from->n_guides * from->n_vertices;
    memcpy(to->guides, from->guides, n_points * sizeof *from->guides);
    memcpy(to->guide_uv, from->guide_uv, from->n_guides * sizeof *from->guide_uv);
    memcpy(to->operator_guide, from->operator_guide, from->n_operator_guides * sizeof *from->operator_guide);
    memcpy(to->name, from->name, sizeof to->name);
    to->scalp = from->scalp;
    memcpy(to->axes, from->axes, sizeof to->axes);
}

static groom_status copy_operator(const struct groom *from, uint32_t index, const uint32_t *strand, uint32_t count,
                                  struct groom *to, struct groom_diag *diag)
{
    const struct groom_operator *source = &from->operators[index];
    groom_status status = groom_insert_operator(to, index, source->type, source->seed, diag);
    if (status != GROOM_OK)
        return status;
    struct groom_operator *op = &to->operators[index];
    op->id = source->id;
    op->enabled = source->enabled; /* a layer is not, and stays empty: it names strands that are not here */
    memcpy(op->parameter, source->parameter, sizeof op->parameter);
    for (uint32_t i = 0; i < groom_operator_random_arrays(source->type); i++)
        if (groom_operator_random_per_guide(source->type))
            memcpy(op->random[i], source->random[i], from->n_operator_guides * sizeof(float));
        else
            copy_rows(op->random[i], source->random[i], sizeof(float), strand, count);
    return GROOM_OK;
}

/* The base of these strands alone. */
static groom_status gather_base(const struct groom *from, const uint32_t *strand, uint32_t count,
                                const struct groom_context *context, struct groom_strands **out, struct groom_diag *diag)
{
    uint64_t n_vertices = 0;
    for (uint32_t i = 0; i < count; i++)
        n_vertices += from->first[strand[i] + 1] - from->first[strand[i]];
    groom_status status = groom_strands_create(count, n_vertices, context, out, diag);
    for (uint32_t i = 0; status == GROOM_OK && i < count; i++) {
        uint32_t at = from->first[strand[i]], n = from->first[strand[i] + 1] - at;
        memcpy((*out)->points + (*out)->first[i], from->base + at, n * sizeof *from->base);
        (*out)->first[i + 1] = (*out)->first[i] + n;
    }
    return status;
}

static groom_status create_selected(const struct groom *from, const uint32_t *strand, uint32_t count,
                                    const struct groom_context *context, struct groom **out, struct groom_diag *diag)
{
    struct groom_shape shape = {count, from->n_vertices, from->n_guides, from->n_operator_guides, from->n_instancing};
    struct groom_strands *base = NULL;
    groom_status status = GROOM_OK;
    if (from->base && count > 0)
        status = gather_base(from, strand, count, context, &base, diag);
    if (status == GROOM_OK)
        status = from->n_guides || !base ? groom_create(shape, context, out, diag)
                                         : groom_create_of_strands(base, context, out, diag);
    if (status == GROOM_OK && base && from->n_guides) {
        if ((status = model_give_base(*out, base->n_vertices)) != GROOM_OK) {
            groom_destroy(*out);
            groom_fail(diag, status, "no memory for %u strands", count);
        } else {
            memcpy((*out)->first, base->first, ((size_t)count + 1) * sizeof *base->first);
            memcpy((*out)->base, base->points, (size_t)base->n_vertices * sizeof *base->points);
        }
    }
    groom_strands_destroy(base);
    return status;
}

static groom_status check_selection(const struct groom *groom, const uint32_t *strand, uint32_t count,
                                    struct groom_diag *diag)
{
    if (model_first_layer(groom) < groom->n_operators)
        return groom_fail(diag, GROOM_EINVAL, "operator %u is a layer, which looks at all strands: select behind it",
                          model_first_layer(groom));
    for (uint32_t i = 0; i < count; i++)
        if (strand[i] >= groom->n_strands)
            return groom_fail(diag, GROOM_EINVAL, "strand %u is not among the groom's %u", strand[i],
                              groom->n_strands);
    return GROOM_OK;
}

groom_status groom_select(const struct groom *groom, const uint32_t *strand, uint32_t count,
                          const struct groom_context *context, struct groom **selected, struct groom_diag *diag)
{
    struct groom *out = NULL;
    groom_status status = check_selection(groom, strand, count, diag);
    if (status == GROOM_OK)
        status = create_selected(groom, strand, count, context, &out, diag);
    if (status != GROOM_OK)
        return status;
    copy_strands(groom, strand, count, out);
    copy_guides(groom, out);
    for (uint32_t i = 0; i < groom->n_operators && status == GROOM_OK; i++)
        status = copy_operator(groom, i, strand, count, out, diag);
    if (status == GROOM_OK)
        *selected = out;
    else
        groom_destroy(out);
    return status;
}
