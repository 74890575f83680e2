/* A layer's strands: which they are, and as super-helices. */
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "layers/room.h"

/* --- groups ------------------------------------------------------------------------ */

const uint32_t *input_groups(const struct groom *groom, const struct groom_layer *layer,
                             const struct groom_clusters *clusters, uint32_t *n)
{
    *n = layer->grouping.count;
    switch (layer->grouping.kind) {
    case GROOM_GROUPING_GIVEN: return layer->grouping.of_strand;
    case GROOM_GROUPING_CLUSTERS: return clusters->of_strand;
    case GROOM_GROUPING_OPERATOR_GUIDES: *n = groom->n_operator_guides; return groom->operator_guide_of;
    case GROOM_GROUPING_ALL: break;
    }
    *n = 1;
    return NULL;
}

static groom_status make_clusters(const struct groom_layer *layer, const struct groom_strands *before,
                                  const struct groom_context *context, struct groom_layer_input *input,
                                  struct groom_diag *diag)
{
    if (layer->grouping.kind != GROOM_GROUPING_CLUSTERS)
        return GROOM_OK;
    input->cluster_seed = layer->grouping.seed;
    return groom_strands_cluster(before, layer->grouping.count, layer->grouping.seed, context, &input->clusters, diag);
}

/* --- which strands -------------------------------------------------------------------- */

static void mark_anchors(const struct groom_layer_anchors *anchors, uint8_t *wanted)
{
    for (uint32_t i = 0; i < anchors->n; i++)
        wanted[anchors->strand[i]] = 1;
}

static void mark_clusters(const struct groom_layer *layer, const struct groom_clusters *clusters, uint8_t *wanted)
{
    for (uint32_t i = 0; i < layer->n_frames; i++)
        for (uint32_t k = clusters->first[layer->frames[i].cluster]; k < clusters->first[layer->frames[i].cluster + 1]; k++)
            wanted[clusters->strands[k]] = 1;
}

static void mark_group(const struct groom *groom, const struct groom_layer *layer, const struct groom_clusters *clusters,
                       uint8_t *wanted)
{
    uint32_t n;
    const uint32_t *group = input_groups(groom, layer, clusters, &n);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        wanted[i] = !layer->by_group || (group ? group[i] : 0) == layer->group;
}

/* 1 for each strand that the layer may change. */
static void mark_wanted(const struct groom *groom, uint32_t index, const struct groom_clusters *clusters, uint8_t *wanted)
{
    const struct groom_operator *op = &groom->operators[index];
    memset(wanted, op->type == GROOM_OPERATOR_RUFFLE || op->type == GROOM_OPERATOR_INTERPOLATE, groom->n_strands);
    if (op->type == GROOM_OPERATOR_CURL_SCALE)
        mark_group(groom, op->layer, clusters, wanted);
    if (op->type == GROOM_OPERATOR_SCULPT) {
        mark_anchors(&op->layer->anchors, wanted);
        mark_anchors(&op->layer->contact, wanted);
        if (clusters)
            mark_clusters(op->layer, clusters, wanted);
    }
}

static groom_status check_frames(const struct groom *groom, uint32_t index, const struct groom_clusters *clusters,
                                 struct groom_diag *diag)
{
    const struct groom_layer *layer = groom->operators[index].layer;
    char pointer[64];
    for (uint32_t i = 0; clusters && i < layer->n_frames; i++) {
        uint32_t cluster = layer->frames[i].cluster;
        if (clusters->first[cluster] < clusters->first[cluster + 1])
            continue;
        snprintf(pointer, sizeof pointer, "/operators/%u/frames/%u/cluster", index, i);
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "cluster %u has no strand: there are fewer places than clusters",
                                cluster);
    }
    return GROOM_OK;
}

/* --- their super-helices ------------------------------------------------------------------ */

static groom_status gather(const struct groom_layer_input *input, const struct groom_strands *before,
                           const struct groom_context *context, struct groom_strands **out, struct groom_diag *diag)
{
    uint64_t n_vertices = 0;
    for (uint32_t k = 0; k < input->n; k++)
        n_vertices += before->first[input->strand[k] + 1] - before->first[input->strand[k]];
    groom_status status = groom_strands_create(input->n, n_vertices, context, out, diag);
    for (uint32_t k = 0; status == GROOM_OK && k < input->n; k++) {
        uint32_t at = before->first[input->strand[k]], m = before->first[input->strand[k] + 1] - at;
        memcpy((*out)->points + (*out)->first[k], before->points + at, m * sizeof *before->points);
        (*out)->first[k + 1] = (*out)->first[k] + m;
    }
    return status;
}

static groom_status convert(struct groom_layer_input *input, const struct groom_strands *before,
                            const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_strands *some = NULL;
    groom_status status = GROOM_OK;
    if (input->n == 0)
        return GROOM_OK;
    options.n_elements = input->n_elements;
    if (input->n < before->n_strands)
        status = gather(input, before, context, &some, diag);
    if (status == GROOM_OK)
        status = groom_strands_convert(some ? some : before, &options, context, &input->conversion, diag);
    groom_strands_destroy(some);
    return status;
}

static groom_status list_strands(const struct groom *groom, uint32_t index, struct groom_layer_input *input)
{
    uint8_t *wanted = memory_array(input->allocator, groom->n_strands, sizeof *wanted);
    if (!wanted)
        return GROOM_ENOMEM;
    mark_wanted(groom, index, input->clusters, wanted);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        input->n += wanted[i];
    input->strand = memory_array(input->allocator, input->n, sizeof *input->strand);
    for (uint32_t i = 0, k = 0; input->strand && i < groom->n_strands; i++)
        if (wanted[i])
            input->strand[k++] = i;
    memory_release(input->allocator, wanted, groom->n_strands, sizeof *wanted);
    return input->strand ? GROOM_OK : GROOM_ENOMEM;
}

groom_status input_begin(const struct groom *groom, uint32_t index, const struct groom_strands *before,
                         const struct groom_context *context, struct groom_layer_input **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom_layer *layer = groom->operators[index].layer;
    struct groom_layer_input *input = memory_array_zero(allocator, 1, sizeof *input);
    if (!input)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a layer");
    input->allocator = allocator;
    input->n_elements = layer->n_elements;
    groom_status status = make_clusters(layer, before, context, input, diag);
    if (status == GROOM_OK)
        status = check_frames(groom, index, input->clusters, diag);
    if (status == GROOM_OK && list_strands(groom, index, input) != GROOM_OK)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a layer over %u strands", groom->n_strands);
    if (status == GROOM_OK)
        *out = input;
    else
        groom_layer_input_destroy(input);
    return status;
}

groom_status groom_layer_count(const struct groom *groom, uint32_t index, const struct groom_strands *before,
                               const struct groom_context *context, uint32_t *n, struct groom_diag *diag)
{
    struct groom_layer_input *input = NULL;
    groom_status status = input_begin(groom, index, before, context, &input, diag);
    if (status == GROOM_OK)
        *n = input->n;
    groom_layer_input_destroy(input);
    return status;
}

groom_status groom_layer_input_create(const struct groom *groom, uint32_t index, const struct groom_strands *before,
                                      const struct groom_context *context, struct groom_layer_input **out,
                                      struct groom_diag *diag)
{
    struct groom_layer_input *input = NULL;
    groom_status status = input_begin(groom, index, before, context, &input, diag);
    if (status == GROOM_OK && (status = convert(input, before, context, diag)) != GROOM_OK) {
        groom_layer_input_destroy(input);
        return status;
    }
    if (status == GROOM_OK)
        *out = input;
    return status;
}

/* --- a part of it ---------------------------------------------------------------------------- */

/* Offsets from the part's first. */
static uint32_t *rebase(const uint32_t *first, uint32_t n, const struct groom_allocator *allocator)
{
    uint32_t *out = memory_array(allocator, (size_t)n + 1, sizeof *out);
    for (uint32_t k = 0; out && k <= n; k++)
        out[k] = first[k] - first[0];
    return out;
}

static groom_status view_conversion(struct input_part *part, const struct groom_conversion *whole, uint32_t begin,
                                    struct groom_diag *diag)
{
    uint32_t n = part->input.n, element = whole->helices->first[begin], vertex = whole->first[begin];
    part->first_element = rebase(whole->helices->first + begin, n, part->input.allocator);
    part->first_vertex = rebase(whole->first + begin, n, part->input.allocator);
    if (!part->first_element || !part->first_vertex)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a layer");
    part->helices = *whole->helices;
    part->helices.n_strands = n;
    part->helices.n_elements = part->first_element[n];
    part->helices.first = part->first_element;
    part->helices.root += begin;
    part->helices.frame += begin;
    part->helices.length += element;
    part->helices.q += element;
    part->view = *whole;
    part->view.helices = &part->helices;
    part->view.n_strands = n;
    part->view.n_vertices = part->first_vertex[n];
    part->view.first = part->first_vertex;
    part->view.at += vertex;
    part->view.reports += begin;
    part->input.conversion = &part->view;
    return GROOM_OK;
}

groom_status input_part_init(struct input_part *part, const struct groom_layer_input *whole, uint32_t begin, uint32_t n,
                             const struct groom_strands *before, const struct groom_context *context,
                             struct groom_diag *diag)
{
    *part = (struct input_part){.input = *whole};
    part->input.n = n;
    part->input.strand += begin;
    if (whole->conversion)
        return view_conversion(part, whole->conversion, begin, diag);
    groom_status status = convert(&part->input, before, context, diag);
    part->own = part->input.conversion;
    return status;
}

void input_part_finish(struct input_part *part)
{
    const struct groom_allocator *allocator = part->input.allocator;
    groom_conversion_destroy(part->own);
    memory_release(allocator, part->first_element, (size_t)part->input.n + 1, sizeof *part->first_element);
    memory_release(allocator, part->first_vertex, (size_t)part->input.n + 1, sizeof *part->first_vertex);
}

/* --- kept ------------------------------------------------------------------------------------ */

void groom_layer_input_destroy(struct groom_layer_input *input)
{
    if (!input)
        return;
    groom_conversion_destroy(input->conversion);
    groom_clusters_destroy(input->clusters);
    memory_release(input->allocator, input->strand, input->n, sizeof *input->strand);
    memory_release(input->allocator, input, 1, sizeof *input);
}

int groom_layer_input_serves(const struct groom_layer_input *input, const struct groom *groom, uint32_t index)
{
    const struct groom_layer *layer = groom->operators[index].layer;
    int clustered = layer->grouping.kind == GROOM_GROUPING_CLUSTERS;
    if (input->n_elements != layer->n_elements || clustered != (input->clusters != NULL) ||
        (clustered && (input->clusters->n_clusters != layer->grouping.count || input->cluster_seed != layer->grouping.seed)) ||
        check_frames(groom, index, input->clusters, NULL) != GROOM_OK)
        return 0;
    uint8_t *wanted = memory_array(input->allocator, groom->n_strands, sizeof *wanted);
    if (!wanted)
        return 0;
    uint32_t n = 0, hits = 0;
    mark_wanted(groom, index, input->clusters, wanted);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        n += wanted[i];
    for (uint32_t k = 0; k < input->n; k++)
        hits += input->strand[k] < groom->n_strands && wanted[input->strand[k]];
    memory_release(input->allocator, wanted, groom->n_strands, sizeof *wanted);
    return n == input->n && hits == n;
}

size_t groom_layer_input_bytes(const struct groom_layer_input *input)
{
    const struct groom_conversion *c = input->conversion;
    size_t bytes = sizeof *input + input->n * sizeof *input->strand;
    if (c)
        bytes += (size_t)c->n_strands * (sizeof *c->reports + 120) + (size_t)c->n_vertices * sizeof *c->at +
                 (size_t)c->helices->n_elements * 4 * sizeof(double);
    if (input->clusters)
        bytes += (size_t)input->clusters->n_strands * 8;
    return bytes;
}

const uint32_t *groom_layer_input_strands(const struct groom_layer_input *input, uint32_t *n)
{
    *n = input->n;
    return input->strand;
}
