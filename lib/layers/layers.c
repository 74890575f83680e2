/* The chain with its layers: dense strands from one layer to the next. */
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "layers/room.h"

#define PIECE 256 /* strands */

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

/* --- back to vertices ------------------------------------------------------------------------ */

struct scatter {
    const struct work *work;
    const struct groom_superhelices *changed;
    float (*sampled)[3];        /* of the input's strands, one after the other */
    struct groom_strands *after;
    uint32_t *n_changed;        /* [pieces] */
};

static int is_same(const struct groom_superhelices *a, const struct groom_superhelices *b, uint32_t i)
{
    uint32_t n = a->first[i + 1] - a->first[i];
    return n == b->first[i + 1] - b->first[i] && memcmp(a->root[i], b->root[i], sizeof a->root[i]) == 0 &&
           memcmp(a->frame[i], b->frame[i], sizeof a->frame[i]) == 0 &&
           memcmp(a->q[a->first[i]], b->q[b->first[i]], n * sizeof *a->q) == 0 &&
           memcmp(&a->length[a->first[i]], &b->length[b->first[i]], n * sizeof *a->length) == 0;
}

static void scatter_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    const struct scatter *job = user;
    const struct groom_layer_input *input = job->work->input;
    uint32_t end = input->n - piece * PIECE < PIECE ? input->n : (piece + 1) * PIECE;
    for (uint32_t k = piece * PIECE; k < end; k++) {
        uint32_t i = input->strand[k], m = job->after->first[i + 1] - job->after->first[i];
        if (is_same(input->conversion->helices, job->changed, k))
            continue;
        memcpy(job->after->points + job->after->first[i], job->sampled + input->conversion->first[k],
               m * sizeof *job->sampled);
        job->n_changed[piece]++;
    }
}

/* Strands that changed get their new vertices; the others keep their own. */
static groom_status scatter(struct scatter *job, const struct groom_allocator *allocator)
{
    const struct work *work = job->work;
    const struct groom_conversion *c = work->input->conversion;
    uint32_t n_pieces = work->input->n / PIECE + (work->input->n % PIECE != 0);
    groom_status status = GROOM_ENOMEM;
    job->sampled = memory_array(allocator, c->n_vertices, sizeof *job->sampled);
    job->n_changed = memory_array_zero(allocator, n_pieces, sizeof *job->n_changed);
    if (job->sampled && job->n_changed)
        status = groom_superhelices_sample_at(job->changed, c->first, c->at, job->sampled, work->context, work->diag);
    else
        groom_fail(work->diag, status, "no memory to sample %u strands", work->input->n);
    if (status == GROOM_OK) {
        parallel_for(work->context, n_pieces, scatter_piece, job);
        for (uint32_t p = 0; p < n_pieces; p++)
            work->report->n_changed += job->n_changed[p];
    }
    memory_release(allocator, job->sampled, c->n_vertices, sizeof *job->sampled);
    memory_release(allocator, job->n_changed, n_pieces, sizeof *job->n_changed);
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

static groom_status change(const struct work *work, struct groom_superhelices **changed)
{
    switch (work->op->type) {
    case GROOM_OPERATOR_RUFFLE: return layer_ruffle(work, changed);
    case GROOM_OPERATOR_SCULPT: return layer_sculpt(work, changed);
    case GROOM_OPERATOR_INTERPOLATE: return layer_interpolate(work, changed);
    case GROOM_OPERATOR_CURL_SCALE: return layer_curl_scale(work, changed);
    default: return groom_fail(work->diag, GROOM_EINVAL, "operator %u is not a layer", work->index);
    }
}

static void tell_input(const struct work *work)
{
    const struct groom_layer_input *input = work->input;
    work->report->n_strands = input->n;
    for (uint32_t k = 0; k < input->n; k++)
        if (input->conversion->reports[k].error_rms_m > work->report->conversion_error_m)
            work->report->conversion_error_m = input->conversion->reports[k].error_rms_m;
}

static groom_status run(const struct work *work, struct groom_strands **out)
{
    struct groom_superhelices *changed = NULL;
    struct groom_strands *after = NULL;
    groom_status status = copy_strands(work, &after);
    if (status == GROOM_OK && work->input->n > 0) {
        tell_input(work);
        status = change(work, &changed);
        struct scatter job = {.work = work, .changed = changed, .after = after};
        if (status == GROOM_OK)
            status = scatter(&job, memory_allocator(work->context));
    }
    groom_superhelices_destroy(changed);
    if (status == GROOM_OK)
        *out = after;
    else
        groom_strands_destroy(after);
    return layer_place(work, status);
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

/* With the input that was kept, or one of its own. */
static groom_status apply(struct work *work, struct groom_strands **after)
{
    struct groom_layer_input *own = NULL;
    groom_status status = check_before(work->groom, work->index, work->before, work->diag);
    if (status != GROOM_OK)
        return status;
    work->op = &work->groom->operators[work->index];
    work->layer = work->op->layer;
    memset(work->report, 0, sizeof *work->report);
    if (!work->input && (status = layer_place(work, groom_layer_input_create(work->groom, work->index, work->before,
                                                                             work->context, &own, work->diag))) == GROOM_OK)
        work->input = own;
    if (status == GROOM_OK)
        status = run(work, after);
    groom_layer_input_destroy(own);
    return status;
}

groom_status groom_layer_apply(const struct groom *groom, uint32_t index, const struct groom_strands *before,
                               const struct groom_layer_input *input, const struct groom_context *context,
                               struct groom_strands **after, struct groom_layer_report *report, struct groom_diag *diag)
{
    struct groom_layer_report unwanted = {0};
    struct work work = {.groom = groom, .index = index, .before = before, .input = input, .context = context,
                        .report = report ? report : &unwanted, .diag = diag};
    return apply(&work, after);
}

groom_status groom_layer_apply_outside(struct groom *groom, uint32_t index, const struct groom_strands *before,
                                       const struct groom_layer_input *input, const struct groom_bvh *head,
                                       const struct groom_context *context, struct groom_strands **after,
                                       struct groom_layer_report *report, struct groom_diag *diag)
{
    struct groom_layer_report unwanted = {0};
    struct work work = {.groom = groom, .index = index, .before = before, .input = input, .head = head, .context = context,
                        .report = report ? report : &unwanted, .diag = diag};
    if (index < groom->n_operators && groom->operators[index].type == GROOM_OPERATOR_SCULPT) {
        work.contact = &groom->operators[index].layer->contact;
        if (groom_layer_anchors_resize(work.contact, 0, groom->allocator) != GROOM_OK)
            return groom_fail(diag, GROOM_ENOMEM, "no memory for a layer");
    }
    return apply(&work, after);
}
