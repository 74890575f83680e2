/* What a layer holds beside its parameters: memory, and what can be told of it without strands. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "model/model.h"

#define COORDINATE_LIMIT 1e6f /* metres */
#define MOST_GROUPS 1024

/* --- memory -------------------------------------------------------------------------- */

groom_status layer_create(const struct groom_allocator *allocator, struct groom_layer **layer)
{
    *layer = memory_array_zero(allocator, 1, sizeof **layer);
    return *layer ? GROOM_OK : GROOM_ENOMEM;
}

groom_status groom_layer_anchors_resize(struct groom_layer_anchors *anchors, uint32_t n,
                                        const struct groom_allocator *allocator)
{
    memory_release(allocator, anchors->strand, anchors->n, sizeof *anchors->strand);
    memory_release(allocator, anchors->at, anchors->n, sizeof *anchors->at);
    memory_release(allocator, anchors->position, anchors->n, sizeof *anchors->position);
    *anchors = (struct groom_layer_anchors){0};
    if (n == 0)
        return GROOM_OK;
    *anchors = (struct groom_layer_anchors){n, memory_array_zero(allocator, n, sizeof *anchors->strand),
                                            memory_array_zero(allocator, n, sizeof *anchors->at),
                                            memory_array_zero(allocator, n, sizeof *anchors->position)};
    if (anchors->strand && anchors->at && anchors->position)
        return GROOM_OK;
    groom_status ignored = groom_layer_anchors_resize(anchors, 0, allocator);
    (void)ignored;
    return GROOM_ENOMEM;
}

groom_status groom_layer_frames_resize(struct groom_layer *layer, uint32_t n, const struct groom_allocator *allocator)
{
    memory_release(allocator, layer->frames, layer->n_frames, sizeof *layer->frames);
    layer->n_frames = 0;
    layer->frames = n ? memory_array_zero(allocator, n, sizeof *layer->frames) : NULL;
    if (n && !layer->frames)
        return GROOM_ENOMEM;
    layer->n_frames = n;
    return GROOM_OK;
}

void layer_destroy(struct groom_layer *layer, uint32_t n_strands, const struct groom_allocator *allocator)
{
    groom_status ignored;
    if (!layer)
        return;
    memory_release(allocator, layer->grouping.of_strand, n_strands, sizeof *layer->grouping.of_strand);
    ignored = groom_layer_anchors_resize(&layer->anchors, 0, allocator);
    ignored = groom_layer_anchors_resize(&layer->contact, 0, allocator);
    ignored = groom_layer_frames_resize(layer, 0, allocator);
    (void)ignored;
    groom_strands_destroy(layer->target);
    memory_release(allocator, layer, 1, sizeof *layer);
}

static groom_status copy_anchors(const struct groom_layer_anchors *from, const struct groom_allocator *allocator,
                                 struct groom_layer_anchors *to)
{
    if (groom_layer_anchors_resize(to, from->n, allocator) != GROOM_OK)
        return GROOM_ENOMEM;
    if (from->n) {
        memcpy(to->strand, from->strand, from->n * sizeof *from->strand);
        memcpy(to->at, from->at, from->n * sizeof *from->at);
        memcpy(to->position, from->position, from->n * sizeof *from->position);
    }
    return GROOM_OK;
}

static groom_status copy_target(const struct groom_strands *from, const struct groom_allocator *allocator,
                                struct groom_strands **to)
{
    const struct groom_context context = {.allocator = allocator};
    if (!from)
        return GROOM_OK;
    groom_status status = groom_strands_create(from->n_strands, from->n_vertices, &context, to, NULL);
    if (status == GROOM_OK) {
        memcpy((*to)->first, from->first, ((size_t)from->n_strands + 1) * sizeof *from->first);
        memcpy((*to)->points, from->points, from->n_vertices * sizeof *from->points);
    }
    return status;
}

groom_status layer_copy(const struct groom_layer *from, uint32_t n_strands, const struct groom_allocator *allocator,
                        struct groom_layer *to)
{
    *to = *from;
    to->grouping.of_strand = NULL;
    to->anchors = to->contact = (struct groom_layer_anchors){0};
    to->n_frames = 0;
    to->frames = NULL;
    to->target = NULL;
    if (from->grouping.of_strand) {
        to->grouping.of_strand = memory_array(allocator, n_strands, sizeof *to->grouping.of_strand);
        if (!to->grouping.of_strand)
            return GROOM_ENOMEM;
        memcpy(to->grouping.of_strand, from->grouping.of_strand, n_strands * sizeof *to->grouping.of_strand);
    }
    if (copy_anchors(&from->anchors, allocator, &to->anchors) != GROOM_OK ||
        copy_anchors(&from->contact, allocator, &to->contact) != GROOM_OK ||
        groom_layer_frames_resize(to, from->n_frames, allocator) != GROOM_OK)
        return GROOM_ENOMEM;
    if (from->n_frames)
        memcpy(to->frames, from->frames, from->n_frames * sizeof *from->frames);
    return copy_target(from->target, allocator, &to->target);
}

/* --- what can be told without strands ------------------------------------------------------ */

struct check {
    const struct groom *groom;
    const struct groom_operator *op;
    uint32_t index;
    struct groom_diag *diag;
};

/* A failure at /operators/<index><field>; for the line that returns it. */
__attribute__((format(printf, 3, 4))) static groom_status refuse(const struct check *check, const char *field,
                                                                 const char *format, ...)
{
    char pointer[sizeof check->diag->pointer], detail[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    snprintf(pointer, sizeof pointer, "/operators/%u%s", check->index, field);
    return groom_fail_field(check->diag, GROOM_EINVAL, pointer, "%s", detail);
}

static int is_place(const float p[3])
{
    return fabsf(p[0]) <= COORDINATE_LIMIT && fabsf(p[1]) <= COORDINATE_LIMIT && fabsf(p[2]) <= COORDINATE_LIMIT;
}

static groom_status check_anchors(const struct check *check, const struct groom_layer_anchors *anchors, const char *name)
{
    char field[64];
    for (uint32_t i = 0; i < anchors->n; i++) {
        const char *what = anchors->strand[i] >= check->groom->n_strands      ? "strand"
                           : !(anchors->at[i] >= 0.0f && anchors->at[i] <= 1.0f) ? "at"
                           : !is_place(anchors->position[i])                     ? "position"
                                                                                 : NULL;
        if (!what)
            continue;
        snprintf(field, sizeof field, "/%s/%u/%s", name, i, what);
        if (*what == 's')
            return refuse(check, field, "there is no strand %u: the groom has %u", anchors->strand[i],
                          check->groom->n_strands);
        if (*what == 'a')
            return refuse(check, field, "%g is off the strand: at is 0 (root) to 1 (tip)", (double)anchors->at[i]);
        return refuse(check, field, "a position is three finite numbers, metres, within 1000 km");
    }
    return GROOM_OK;
}

/* How many groups there are, as far as can be told. */
static uint32_t n_groups(const struct check *check)
{
    const struct groom_grouping *grouping = &check->op->layer->grouping;
    if (grouping->kind == GROOM_GROUPING_ALL)
        return 1;
    return grouping->kind == GROOM_GROUPING_OPERATOR_GUIDES ? check->groom->n_operator_guides : grouping->count;
}

static groom_status check_grouping(const struct check *check)
{
    const struct groom_grouping *grouping = &check->op->layer->grouping;
    const char *clusters = check->op->type == GROOM_OPERATOR_SCULPT ? "/clusters/count" : "/groups/count";
    if (grouping->kind == GROOM_GROUPING_OPERATOR_GUIDES && check->groom->n_operator_guides == 0)
        return refuse(check, "/groups", "a groom made of uploaded strands has no operator guides to group them by");
    if (grouping->kind == GROOM_GROUPING_CLUSTERS &&
        (grouping->count < 1 || grouping->count > MOST_GROUPS || grouping->count > check->groom->n_strands))
        return refuse(check, clusters, "%u clusters are asked for; 1 to %u, and no more than strands, can be had",
                      grouping->count, MOST_GROUPS);
    for (uint32_t i = 0; grouping->of_strand && i < check->groom->n_strands; i++)
        if (grouping->of_strand[i] >= grouping->count)
            return refuse(check, "/groups", "strand %u is in group %u; there are %u groups", i, grouping->of_strand[i],
                          grouping->count);
    return GROOM_OK;
}

static groom_status check_frames(const struct check *check)
{
    const struct groom_layer *layer = check->op->layer;
    char field[64];
    if (layer->n_frames && layer->grouping.kind == GROOM_GROUPING_ALL)
        return refuse(check, "/clusters", "frames move clusters: say how many, {\"count\":K,\"seed\":S}");
    for (uint32_t i = 0; i < layer->n_frames; i++) {
        const struct groom_layer_frame *frame = &layer->frames[i];
        snprintf(field, sizeof field, "/frames/%u/cluster", i);
        if (frame->cluster >= n_groups(check))
            return refuse(check, field, "there is no cluster %u: there are %u", frame->cluster, n_groups(check));
        snprintf(field, sizeof field, "/frames/%u/at", i);
        if (!(frame->at >= 0.0f && frame->at <= 1.0f))
            return refuse(check, field, "%g is off the strand: at is 0 (root) to 1 (tip)", (double)frame->at);
        snprintf(field, sizeof field, "/frames/%u/transform", i);
        for (int k = 0; k < 12; k++)
            if (!(fabsf(frame->transform[k / 4][k % 4]) <= COORDINATE_LIMIT))
                return refuse(check, field, "a transform is three rows of four finite numbers");
    }
    return GROOM_OK;
}

static groom_status check_target(const struct check *check)
{
    const struct groom_strands *target = check->op->layer->target;
    for (uint32_t i = 0; target && i < target->n_vertices; i++)
        if (!is_place(target->points[i]))
            return refuse(check, "/target/points", "vertex %u is not finite, or beyond 1000 km", i);
    return GROOM_OK;
}

groom_status layer_validate(const struct groom *groom, uint32_t index, struct groom_diag *diag)
{
    const struct check check = {groom, &groom->operators[index], index, diag};
    const struct groom_layer *layer = check.op->layer;
    groom_status status = check_grouping(&check);
    if (status == GROOM_OK)
        status = check_anchors(&check, &layer->anchors, "anchors");
    if (status == GROOM_OK)
        status = check_anchors(&check, &layer->contact, "contact");
    if (status == GROOM_OK)
        status = check_frames(&check);
    if (status == GROOM_OK)
        status = check_target(&check);
    if (status == GROOM_OK && layer->by_group && layer->group >= n_groups(&check))
        status = refuse(&check, "/group", "there is no group %u: there are %u", layer->group, n_groups(&check));
    return status;
}
