/* The fit as an object: made from inputs, driven step by step, asked for its groom. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "base/checksum.h"
#include "fit/head_planes.h"
#include "fit/state.h"
#include "fit/unseen.h"
#include "groom/mesh.h"
#include "groom/strands.h"

/* --- what was put in --------------------------------------------------------------- */

static void add_head(struct checksum *sum, const struct groom_mesh *head)
{
    checksum_add(sum, head->points, head->n_vertices * sizeof *head->points);
    checksum_add(sum, head->triangles, head->n_triangles * sizeof *head->triangles);
    if (!head->uvs)
        return;
    checksum_add(sum, head->uvs, head->n_uvs * sizeof *head->uvs);
    checksum_add(sum, head->uv_triangles, head->n_triangles * sizeof *head->uv_triangles);
}

static groom_status checksum_inputs(struct groom_fit *fit, const struct groom_strands *strands,
                                    const struct groom_mesh *head, struct groom_diag *diag)
{
    struct checksum sum = {0};
    char *options;
    groom_status st = groom_fit_options_print(&fit->options, &options, diag);
    if (st != GROOM_OK)
        return st;
    checksum_add(&sum, options, strlen(options));
    free(options);
    checksum_add(&sum, strands->first, ((size_t)strands->n_strands + 1) * sizeof *strands->first);
    checksum_add(&sum, strands->points, strands->first[strands->n_strands] * sizeof *strands->points);
    if (strands->root_uv)
        checksum_add(&sum, strands->root_uv, strands->n_strands * sizeof *strands->root_uv);
    if (head)
        add_head(&sum, head);
    fit->inputs = checksum_finish(&sum);
    return GROOM_OK;
}

/* --- life ----------------------------------------------------------------------------- */

groom_status groom_fit_create(const struct groom_strands *strands, const struct groom_mesh *head,
                              const struct groom_fit_options *options, const struct groom_context *context,
                              struct groom_fit **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_fit *fit = memory_array_zero(allocator, 1, sizeof *fit);
    groom_status st;
    if (!fit)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a fit");
    fit->allocator = allocator;
    fit->options = *options;
    if ((st = target_create(fit, strands, head, context, diag)) != GROOM_OK)
        goto out;
    if ((st = checksum_inputs(fit, strands, head, diag)) != GROOM_OK)
        goto out;
    *out = fit;
    fit = NULL;
out:
    groom_fit_destroy(fit);
    return st;
}

void groom_fit_destroy(struct groom_fit *fit)
{
    if (!fit)
        return;
    const struct groom_allocator *allocator = fit->allocator;
    memory_release(allocator, fit->roots, fit->n, sizeof *fit->roots);
    memory_release(allocator, fit->root_uv, fit->n, sizeof *fit->root_uv);
    memory_release(allocator, fit->target, (size_t)fit->n * fit->m, sizeof *fit->target);
    memory_release(fit->allocator, fit->head_plane, (size_t)fit->n * head_planes_of(fit->m), sizeof *fit->head_plane);
    unseen_finish(fit);
    memory_release(allocator, fit->centroids, (size_t)fit->n_guides * fit->m, sizeof *fit->centroids);
    memory_release(allocator, fit->cluster_of, fit->n, sizeof *fit->cluster_of);
    memory_release(allocator, fit->moments, fit->n_moments, sizeof *fit->moments);
    groom_destroy(fit->groom);
    groom_scalp_destroy(fit->scalp);
    groom_bvh_destroy(fit->bvh);
    memory_release(allocator, fit, 1, sizeof *fit);
}

/* --- steps ------------------------------------------------------------------------------ */

int groom_fit_done(const struct groom_fit *fit) { return fit->stage == FIT_N_STAGES; }

groom_status groom_fit_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_fit_progress progress;
    int ended = 0;
    groom_status st;
    if (groom_fit_done(fit))
        return groom_fail(diag, GROOM_EINVAL, "the fit is done; there is no step left");
    if (progress_cancelled(context))
        return groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage %s", fit_stages[fit->stage].name);
    if ((st = fit_stages[fit->stage].step(fit, &ended, context, diag)) != GROOM_OK)
        return st;
    if (ended) {
        fit->stage++;
        fit->phase = fit->iteration = 0;
    }
    groom_fit_progress(fit, &progress);
    progress_report(context, progress.fraction);
    return GROOM_OK;
}

void groom_fit_progress(const struct groom_fit *fit, struct groom_fit_progress *progress)
{
    uint32_t index = groom_fit_done(fit) ? FIT_N_STAGES - 1 : fit->stage;
    double done = 0, all = 0;
    progress->stage = fit_stages[index].name;
    progress->index = index;
    progress->count = FIT_N_STAGES;
    progress->stage_fraction = groom_fit_done(fit) ? 1 : fit_stages[index].fraction(fit);
    for (uint32_t i = 0; i < FIT_N_STAGES; i++) {
        all += fit_stages[i].weight;
        done += fit_stages[i].weight * (i < index ? 1 : i == index ? progress->stage_fraction : 0);
    }
    progress->fraction = done / all;
}

groom_status groom_fit_result(const struct groom_fit *fit, const struct groom_context *context, struct groom **groom,
                              struct groom_diag *diag)
{
    if (fit->stage == 0)
        return groom_fail(diag, GROOM_EINVAL, "stage %s has not ended: there is no groom yet", fit_stages[0].name);
    return fit->all.n ? unseen_restore(fit, context, groom, diag) : groom_clone(fit->groom, context, groom, diag);
}
