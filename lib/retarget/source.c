/* What depends on the source alone, made once and asked for every target. */
#include "retarget/source.h"

#include <math.h>
#include <string.h>

#include "base/checksum.h"
#include "base/memory.h"
#include "base/progress.h"

/* Bodies are a few metres about the origin: floats near them stand on multiples of 2^-23 or finer, and less a
 * multiple of 2^-8 they are exact floats again. */
void source_centre(const struct groom_mesh *body, double centre[3])
{
    float low[3], high[3];
    groom_mesh_bounds(body, low, high);
    for (int c = 0; c < 3; c++)
        centre[c] = nearbyint(((double)low[c] + high[c]) / 2 * 256) / 256;
}

int source_has_fine(const struct groom_retarget_source *source)
{
    return source->options.mode == GROOM_RETARGET_MULTISCALE && source->n_guides < source->strands->n_strands;
}

/* --- checks ---------------------------------------------------------------------- */

static groom_status check_strands(const struct groom_strands *strands, struct groom_diag *diag)
{
    if (strands->n_strands == 0)
        return groom_fail(diag, GROOM_EEMPTY, "there is no strand to retarget");
    for (uint32_t i = 0; i < strands->n_strands; i++)
        if (strands->first[i + 1] - strands->first[i] < 2)
            return groom_fail(diag, GROOM_EINVAL, "strand %u has fewer than 2 vertices", i);
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        for (int c = 0; c < 3; c++)
            if (!isfinite(strands->points[i][c]) || fabsf(strands->points[i][c]) > 1e6f)
                return groom_fail(diag, GROOM_EINVAL, "vertex %u of the strands is not finite", i);
    return GROOM_OK;
}

/* --- the struct -------------------------------------------------------------------- */

static void add_u64(struct checksum *sum, uint64_t value) { checksum_add(sum, &value, sizeof value); }
static void add_real(struct checksum *sum, double value) { checksum_add(sum, &value, sizeof value); }

static uint64_t hash_inputs(const struct groom_retarget_source *source, const uint32_t *regions)
{
    const struct groom_strands *strands = source->strands;
    const struct groom_mesh *body = source->body;
    const struct groom_retarget_options *options = &source->options;
    struct checksum sum = {0};
    add_u64(&sum, strands->n_strands);
    checksum_add(&sum, strands->first, ((size_t)strands->n_strands + 1) * sizeof *strands->first);
    checksum_add(&sum, strands->points, strands->n_vertices * sizeof *strands->points);
    checksum_add(&sum, body->points, body->n_vertices * sizeof *body->points);
    checksum_add(&sum, body->triangles, body->n_triangles * sizeof *body->triangles);
    for (uint32_t b = 0; b < source->skeleton.n_bones; b++) {
        checksum_add(&sum, source->skeleton.bones[b].head, sizeof source->skeleton.bones[b].head);
        checksum_add(&sum, source->skeleton.bones[b].tail, sizeof source->skeleton.bones[b].tail);
    }
    checksum_add(&sum, regions, regions ? body->n_triangles * sizeof *regions : 0);
    add_u64(&sum, options->neighbours);
    add_u64(&sum, options->guides);
    add_u64(&sum, options->mode);
    add_u64(&sum, options->sweeps > 0);
    add_u64(&sum, options->seed);
    add_real(&sum, options->sigma_bone);
    return checksum_finish(&sum);
}

groom_status source_init(struct groom_retarget_source **out, const struct groom_strands *strands,
                         const struct groom_mesh *body, const struct groom_skeleton *skeleton, const uint32_t *regions,
                         const struct groom_retarget_options *options, const struct groom_context *context,
                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_retarget_source *source;
    groom_status st;
    if ((st = retarget_options_check(options, diag)) != GROOM_OK || (st = check_strands(strands, diag)) != GROOM_OK ||
        (st = groom_mesh_validate(body, diag)) != GROOM_OK || (st = groom_skeleton_validate(skeleton, diag)) != GROOM_OK)
        return st;
    if (body->n_triangles == 0)
        return groom_fail(diag, GROOM_EEMPTY, "the body has no triangle");
    if (!(source = memory_array_zero(allocator, 1, sizeof *source)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to prepare a retargeting");
    source->strands = strands;
    source->body = body;
    source->skeleton = *skeleton;
    source->options = *options;
    source->allocator = allocator;
    source_centre(body, source->centre);
    for (uint32_t i = 0; i < strands->n_strands; i++)
        if (strands->first[i + 1] - strands->first[i] > source->longest)
            source->longest = strands->first[i + 1] - strands->first[i];
    source->inputs = hash_inputs(source, regions);
    source->anchors = memory_array(allocator, strands->n_vertices, sizeof *source->anchors);
    source->is_guide = memory_array_zero(allocator, strands->n_strands, 1);
    if (!source->anchors || !source->is_guide) {
        groom_retarget_source_destroy(source);
        return groom_fail(diag, GROOM_ENOMEM, "no memory to prepare %u particles", strands->n_vertices);
    }
    *out = source;
    return GROOM_OK;
}

groom_status source_index_guides(struct groom_retarget_source *source, struct groom_diag *diag)
{
    const uint32_t *first = source->strands->first;
    source->guide_first = memory_array_zero(source->allocator, (size_t)source->n_guides + 1, sizeof *source->guide_first);
    if (!source->guide_first)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u guides", source->n_guides);
    for (uint32_t g = 0; g < source->n_guides; g++) {
        uint32_t strand = source->guides[g];
        source->is_guide[strand] = 1;
        source->guide_first[g + 1] = source->guide_first[g] + first[strand + 1] - first[strand];
    }
    return GROOM_OK;
}

groom_status source_find_anchors(struct groom_retarget_source *source, const uint32_t *regions,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t *made = NULL, n = source->body->n_triangles;
    groom_status st = GROOM_OK;
    if (!regions && !(made = memory_array(source->allocator, n, sizeof *made)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the regions of bones");
    if (!regions)
        groom_skeleton_regions(&source->skeleton, source->body, made);
    st = anchors_find(source, regions ? regions : made, context, diag);
    memory_release(source->allocator, made, n, sizeof *made);
    return st;
}

groom_status groom_retarget_source_create(const struct groom_strands *strands, const struct groom_mesh *body,
                                          const struct groom_skeleton *skeleton, const uint32_t *regions,
                                          const struct groom_retarget_options *options,
                                          const struct groom_context *context, struct groom_retarget_source **out,
                                          struct groom_diag *diag)
{
    struct groom_retarget_source *source = NULL;
    groom_status st = source_init(&source, strands, body, skeleton, regions, options, context, diag);
    if (st != GROOM_OK)
        return st;
    if ((st = source_find_anchors(source, regions, context, diag)) != GROOM_OK)
        goto out;
    if (options->mode == GROOM_RETARGET_MULTISCALE && (st = guides_choose(source, context, diag)) != GROOM_OK)
        goto out;
    if ((st = source_index_guides(source, diag)) != GROOM_OK || (st = neighbours_find(source, context, diag)) != GROOM_OK)
        goto out;
    progress_report(context, 1.0);
    *out = source;
    source = NULL;
out:
    groom_retarget_source_destroy(source);
    return st;
}

void groom_retarget_source_destroy(struct groom_retarget_source *source)
{
    if (!source)
        return;
    const struct groom_allocator *allocator = source->allocator;
    memory_release(allocator, source->anchors, source->strands->n_vertices, sizeof *source->anchors);
    memory_release(allocator, source->guides, source->n_guides, sizeof *source->guides);
    memory_release(allocator, source->is_guide, source->strands->n_strands, 1);
    memory_release(allocator, source->guide_first, (size_t)source->n_guides + 1, sizeof *source->guide_first);
    graph_finish(&source->among_guides, allocator);
    graph_finish(&source->to_guides, allocator);
    graph_finish(&source->among_all, allocator);
    memory_release(allocator, source, 1, sizeof *source);
}

uint32_t groom_retarget_source_guides(const struct groom_retarget_source *source) { return source->n_guides; }

int groom_retarget_source_is_guide(const struct groom_retarget_source *source, uint32_t strand)
{
    return source->is_guide[strand];
}
