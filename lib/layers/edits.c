/* Ruffle, interpolate, curl_scale: what a layer's parameters mean to groom/curvature.h. */
#include <string.h>

#include "base/memory.h"
#include "layers/room.h"

/* The groups of the input's strands, which are all strands: ruffling takes them from the whole groom. */
groom_status layer_ruffle(const struct work *work, struct groom_superhelices **changed)
{
    uint32_t n_groups;
    const uint32_t *group = input_groups(work->groom, work->layer, work->input->clusters, &n_groups);
    const struct groom_ruffle_options options = {.rho = (double)work->op->parameter[0],
                                                 .blend = (double)work->op->parameter[1],
                                                 .match_elements = (uint32_t)work->op->parameter[2],
                                                 .seed = work->op->seed,
                                                 .stream = work->op->id,
                                                 .group = group,
                                                 .n_groups = n_groups};
    return groom_superhelices_ruffle(work->input->conversion->helices, &options, work->context, changed, work->diag);
}

static groom_status match(const struct work *work, const struct groom_superhelices *target, double t,
                          struct groom_superhelices **changed)
{
    const struct groom_allocator *allocator = memory_allocator(work->context);
    const struct groom_superhelices *own = work->input->conversion->helices;
    uint32_t *partner = memory_array(allocator, own->n_strands, sizeof *partner);
    if (!partner)
        return groom_fail(work->diag, GROOM_ENOMEM, "no memory to match %u strands", own->n_strands);
    groom_status status = groom_superhelices_match_roots(own, target, work->context, partner, work->diag);
    if (status == GROOM_OK)
        status = groom_superhelices_interpolate(own, target, partner, t, work->context, changed, work->diag);
    memory_release(allocator, partner, own->n_strands, sizeof *partner);
    return status;
}

groom_status layer_interpolate(const struct work *work, struct groom_superhelices **changed)
{
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_conversion *target = NULL;
    double t = (double)work->op->parameter[0];
    if (!work->layer->target || t <= 0.0)
        return groom_superhelices_copy(work->input->conversion->helices, work->context, changed, work->diag);
    options.n_elements = work->layer->n_elements;
    groom_status status = groom_strands_convert(work->layer->target, &options, work->context, &target, work->diag);
    if (status == GROOM_OK)
        status = match(work, target->helices, t, changed);
    groom_conversion_destroy(target);
    return status;
}

groom_status layer_curl_scale(const struct work *work, struct groom_superhelices **changed)
{
    const float *p = work->op->parameter;
    struct groom_curl_scale_options options = groom_curl_scale_options_default();
    options.radius = (double)p[0];
    options.step = (double)p[1];
    options.ramp[0] = (double)p[2];
    options.ramp[1] = (double)p[3];
    options.largest_radius_m = (double)p[4];
    options.keep = work->layer->keep_turns ? GROOM_CURL_KEEP_TURNS : GROOM_CURL_KEEP_LENGTH;
    options.hold_direction = !work->layer->free_direction;
    groom_status status =
        groom_superhelices_copy(work->input->conversion->helices, work->context, changed, work->diag);
    if (status == GROOM_OK)
        status = groom_superhelices_scale_curls(*changed, &options, work->context, work->diag);
    return status;
}
