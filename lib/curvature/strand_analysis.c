/* From polylines to what kind of hair they are, in one call. */
#include "base/memory.h"
#include "groom/analysis.h"

void groom_strand_analysis_destroy(struct groom_strand_analysis *a)
{
    if (!a)
        return;
    if (a->conversion)
        memory_release(a->allocator, a->error_share, a->conversion->n_strands, sizeof *a->error_share);
    groom_conversion_destroy(a->conversion);
    groom_analysis_destroy(a->analysis);
    memory_release(a->allocator, a, 1, sizeof *a);
}

static groom_status measure_errors(struct groom_strand_analysis *a, const struct groom_strands *strands,
                                   struct groom_diag *diag)
{
    const struct groom_conversion *c = a->conversion;
    a->error_share = memory_array(a->allocator, c->n_strands, sizeof *a->error_share);
    if (!a->error_share)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the errors of %u strands", c->n_strands);
    for (uint32_t i = 0; i < c->n_strands; i++) {
        uint32_t n = strands->first[i + 1] - strands->first[i];
        double length = groom_polyline_length((const float (*)[3])strands->points + strands->first[i], n);
        a->error_share[i] = length > 0.0 ? (float)((double)c->reports[i].error_max_m * (n - 1) / length) : 0.0f;
    }
    return GROOM_OK;
}

groom_status groom_strands_analyze(const struct groom_strands *strands,
                                   const struct groom_conversion_options *conversion,
                                   const struct groom_analysis_options *options, const struct groom_context *context,
                                   struct groom_strand_analysis **analysis, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_strand_analysis *a = memory_array_zero(allocator, 1, sizeof *a);
    groom_status st;
    if (!a)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for an analysis");
    a->allocator = allocator;
    if ((st = groom_strands_convert(strands, conversion, context, &a->conversion, diag)) != GROOM_OK ||
        (st = groom_superhelices_analyze(a->conversion->helices, options, context, &a->analysis, diag)) != GROOM_OK ||
        (st = measure_errors(a, strands, diag)) != GROOM_OK) {
        groom_strand_analysis_destroy(a);
        return st;
    }
    *analysis = a;
    return GROOM_OK;
}
