/* The chain with its layers: dense strands from one layer to the next. */
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "layers/room.h"

/* --- pieces of the chain ----------------------------------------------------------------- */

uint32_t groom_next_layer(const struct groom *groom, uint32_t from)
{
    while (from < groom->n_operators &&
           !(groom->operators[from].enabled && groom_operator_is_layer(groom->operators[from].type)))
        from++;
    return from;
}

groom_status groom_evaluate_between(const struct groom *groom, uint32_t begin, uint32_t end,
                                    const struct groom_strands *before, const struct groom_context *context,
                                    struct groom_strands **out, struct groom_diag *diag)
{
    struct groom part = groom_with_base(groom, before, begin, end);
    struct groom_strands *strands = NULL;
    groom_status status = groom_strands_create(part.n_strands, groom_first_vertex(&part, part.n_strands), context,
                                               &strands, diag);
    if (status != GROOM_OK)
        return status;
    for (uint32_t i = 0; i <= part.n_strands; i++)
        strands->first[i] = (uint32_t)groom_first_vertex(&part, i);
    status = groom_evaluate(&part, 0, part.n_strands, strands->points, context, diag);
    if (status == GROOM_OK)
        *out = strands;
    else
        groom_strands_destroy(strands);
    return status;
}

groom_status groom_layers_evaluate(const struct groom *groom, const struct groom_context *context,
                                   struct groom_strands **out, struct groom_diag *diag)
{
    struct groom_strands *strands = NULL, *next = NULL;
    groom_status status = GROOM_OK;
    for (uint32_t begin = 0; status == GROOM_OK;) {
        uint32_t layer = groom_next_layer(groom, begin);
        if ((status = groom_evaluate_between(groom, begin, layer, strands, context, &next, diag)) != GROOM_OK)
            break;
        groom_strands_destroy(strands);
        strands = next;
        if (layer == groom->n_operators) {
            *out = strands;
            return GROOM_OK;
        }
        if ((status = groom_layer_apply(groom, layer, strands, NULL, context, &next, NULL, diag)) != GROOM_OK)
            break;
        groom_strands_destroy(strands);
        strands = next;
        begin = layer + 1;
    }
    groom_strands_destroy(strands);
    return status;
}

static groom_status copy_strands(const struct work *work, struct groom_strands **out)
{
    const struct groom_strands *from = work->before;
    groom_status status = groom_strands_create(from->n_strands, from->n_vertices, work->context, out, work->diag);
    if (status != GROOM_OK)
        return status;
    memcpy((*out)->first, from->first, ((size_t)from->n_strands + 1) * sizeof *from->first);
    memcpy((*out)->points, from->points, from->n_vertices * sizeof *from->points);
    return GROOM_OK;
}

/* --- a layer ------------------------------------------------------------------------------------ */

groom_status layer_place(const struct work *work, groom_status status)
{
    char pointer[sizeof work->diag->pointer];
    if (status == GROOM_OK || !work->diag || strncmp(work->diag->pointer, "/operators/", 11) == 0)
        return status;
    snprintf(pointer, sizeof pointer, "/operators/%u%.100s", work->index, work->diag->pointer);
    memcpy(work->diag->pointer, pointer, sizeof pointer);
    return status;
}

static groom_status run(struct work *work)
{
    groom_status status = GROOM_OK;
    if (work->input->n == 0)
        return status;
    if (work->op->type == GROOM_OPERATOR_SCULPT)
        status = layer_sculpt_begin(work);
    if (status == GROOM_OK)
        status = layer_run_blocks(work);
    if (status == GROOM_OK && work->op->type == GROOM_OPERATOR_SCULPT)
        status = layer_sculpt_tell(work);
    layer_sculpt_end(work);
    return status;
}

static groom_status check_before(const struct groom *groom, uint32_t index, const struct groom_strands *before,
                                 struct groom_diag *diag)
{
    if (index >= groom->n_operators || !groom_operator_is_layer(groom->operators[index].type))
        return groom_fail(diag, GROOM_EINVAL, "operator %u is not a layer", index);
    if (before->n_strands != groom->n_strands)
        return groom_fail(diag, GROOM_EINVAL, "%u strands come into a layer of a groom of %u", before->n_strands,
                          groom->n_strands);
    return GROOM_OK;
}

static groom_status make_input(const struct work *work, struct groom_layer_input **own)
{
    return layer_is_strand_by_strand(work->op->type)
               ? input_begin(work->groom, work->index, work->before, work->context, own, work->diag)
               : groom_layer_input_create(work->groom, work->index, work->before, work->context, own, work->diag);
}

/* With the input that was kept, or one of its own. */
static groom_status apply(struct work *work)
{
    struct groom_layer_input *own = NULL;
    groom_status status = GROOM_OK;
    work->op = &work->groom->operators[work->index];
    work->layer = work->op->layer;
    memset(work->report, 0, sizeof *work->report);
    if (!work->input && (status = make_input(work, &own)) == GROOM_OK)
        work->input = own;
    if (status == GROOM_OK)
        status = run(work);
    groom_layer_input_destroy(own);
    return layer_place(work, status);
}

/* On a copy. */
static groom_status apply_to_copy(struct work *work, struct groom_strands **after)
{
    groom_status status = check_before(work->groom, work->index, work->before, work->diag);
    if (status == GROOM_OK)
        status = copy_strands(work, &work->after);
    if (status == GROOM_OK && (status = apply(work)) == GROOM_OK)
        *after = work->after;
    else
        groom_strands_destroy(work->after);
    return status;
}

/* What held strands outside the head is found anew. */
static groom_status find_contact(struct work *work, struct groom *groom)
{
    if (work->index >= groom->n_operators || groom->operators[work->index].type != GROOM_OPERATOR_SCULPT)
        return GROOM_OK;
    work->contact = &groom->operators[work->index].layer->contact;
    return groom_layer_anchors_resize(work->contact, 0, groom->allocator);
}

groom_status groom_layer_apply(const struct groom *groom, uint32_t index, const struct groom_strands *before,
                               const struct groom_layer_input *input, const struct groom_context *context,
                               struct groom_strands **after, struct groom_layer_report *report, struct groom_diag *diag)
{
    struct groom_layer_report unwanted = {0};
    struct work work = {.groom = groom, .index = index, .before = before, .input = input, .context = context,
                        .report = report ? report : &unwanted, .diag = diag};
    return apply_to_copy(&work, after);
}

groom_status groom_layer_apply_outside(struct groom *groom, uint32_t index, const struct groom_strands *before,
                                       const struct groom_layer_input *input, const struct groom_bvh *head,
                                       const struct groom_context *context, struct groom_strands **after,
                                       struct groom_layer_report *report, struct groom_diag *diag)
{
    struct groom_layer_report unwanted = {0};
    struct work work = {.groom = groom, .index = index, .before = before, .input = input, .head = head, .context = context,
                        .report = report ? report : &unwanted, .diag = diag};
    if (find_contact(&work, groom) != GROOM_OK)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a layer");
    return apply_to_copy(&work, after);
}

groom_status groom_layer_change(struct groom *groom, uint32_t index, struct groom_strands *strands,
                                const struct groom_bvh *head, const struct groom_context *context,
                                struct groom_layer_report *report, struct groom_diag *diag)
{
    struct groom_layer_report unwanted = {0};
    struct work work = {.groom = groom, .index = index, .before = strands, .after = strands, .head = head,
                        .context = context, .report = report ? report : &unwanted, .diag = diag};
    groom_status status = check_before(groom, index, strands, diag);
    if (status == GROOM_OK && head && find_contact(&work, groom) != GROOM_OK)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a layer");
    return status == GROOM_OK ? apply(&work) : status;
}
