#include "fit/unseen.h"

#include <string.h>

#include "base/memory.h"
#include "fit/assign.h"
#include "fit/visibility.h"

/* --- out of the target ---------------------------------------------------------------------- */

/* Makes an array of the rows that are seen; the old one is the fit's allocator's to take back. */
static void *keep_rows(const struct groom_fit *fit, const void *rows, size_t size, uint32_t n_seen)
{
    char *kept = memory_array(fit->allocator, n_seen, size);
    for (uint32_t k = 0; kept && k < n_seen; k++)
        memcpy(kept + k * size, (const char *)rows + fit->all.seen[k] * size, size);
    return kept;
}

static groom_status compact(struct groom_fit *fit, uint32_t n_seen, struct groom_diag *diag)
{
    size_t strand = fit->m * sizeof *fit->target;
    void *roots = keep_rows(fit, fit->roots, sizeof *fit->roots, n_seen);
    void *root_uv = keep_rows(fit, fit->root_uv, sizeof *fit->root_uv, n_seen);
    void *target = keep_rows(fit, fit->target, strand, n_seen);
    if (!roots || !root_uv || !target) {
        memory_release(fit->allocator, roots, n_seen, sizeof *fit->roots);
        memory_release(fit->allocator, root_uv, n_seen, sizeof *fit->root_uv);
        memory_release(fit->allocator, target, n_seen, strand);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the %u strands that cameras see", n_seen);
    }
    memory_release(fit->allocator, fit->target, fit->n, strand);
    fit->all.n = fit->n;
    fit->all.roots = fit->roots;
    fit->all.root_uv = fit->root_uv;
    fit->roots = roots;
    fit->root_uv = root_uv;
    fit->target = target;
    fit->n = n_seen;
    return GROOM_OK;
}

static void report_unseen(struct groom_fit *fit, const float *share)
{
    uint32_t n_seen = 0;
    for (uint32_t i = 0; i < fit->n; i++)
        n_seen += share[i] > 0 && share[i] >= (float)fit->options.least_seen;
    fit->report.n_unseen = n_seen > 0 ? fit->n - n_seen : 0;
    if (n_seen == 0)
        report_note(&fit->report, "No camera sees any strand, so that all are used: are cameras and strands in one frame?");
    else
        report_note(&fit->report, "%u of %u strands are seen by no camera and left out of the fit.", fit->n - n_seen, fit->n);
}

/* Marks strands of which cameras see too little as left out. */
static groom_status mark_unseen(struct groom_fit *fit, unsigned char *left_out, const struct groom_context *context,
                                struct groom_diag *diag)
{
    struct visibility_scene scene = {.points = (const float (*)[3])fit->target, .scale = fit->scale, .n = fit->n, .m = fit->m,
                                     .head = fit->bvh ? groom_bvh_mesh(fit->bvh) : NULL, .ordinary = fit->ordinary};
    const struct groom_allocator *allocator = memory_allocator(context);
    float *share = memory_array(allocator, fit->n, sizeof *share);
    if (!share)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to look at %u strands", fit->n);
    memcpy(scene.centre, fit->centre, sizeof scene.centre);
    groom_status st = visibility_shares(&scene, fit->options.cameras, fit->options.n_cameras, share, context, diag);
    if (st == GROOM_OK) {
        report_unseen(fit, share);
        for (uint32_t i = 0; i < fit->n && fit->report.n_unseen > 0; i++)
            left_out[i] |= !(share[i] > 0 && share[i] >= (float)fit->options.least_seen);
    }
    memory_release(allocator, share, fit->n, sizeof *share);
    return st;
}

static groom_status keep_others(struct groom_fit *fit, const unsigned char *left_out, struct groom_diag *diag)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < fit->n; i++)
        n += !left_out[i];
    if (n == fit->n || n == 0)
        return GROOM_OK;
    if (!(fit->all.seen = memory_array(fit->allocator, fit->n, sizeof *fit->all.seen)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to list the strands that cameras see");
    fit->all.n = fit->n;
    n = 0;
    for (uint32_t i = 0; i < fit->n; i++)
        if (!left_out[i])
            fit->all.seen[n++] = i;
    return compact(fit, n, diag);
}

groom_status unseen_remove(struct groom_fit *fit, const unsigned char *outlier, const struct groom_context *context,
                           struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->n;
    unsigned char *left_out;
    groom_status st = GROOM_OK;
    if (fit->report.n_outliers > 0)
        report_note(&fit->report, "Left out of the fit, as they start or reach too far from the others to be hair of one head: %u strands.",
                    fit->report.n_outliers);
    if (fit->options.n_cameras == 0 && fit->report.n_outliers == 0)
        return GROOM_OK;
    if (!(left_out = memory_array(allocator, n, 1)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to look at %u strands", n);
    memcpy(left_out, outlier, n);
    if (fit->options.n_cameras > 0)
        st = mark_unseen(fit, left_out, context, diag);
    if (st == GROOM_OK)
        st = keep_others(fit, left_out, diag);
    memory_release(allocator, left_out, n, 1);
    return st;
}

void unseen_finish(struct groom_fit *fit)
{
    memory_release(fit->allocator, fit->all.seen, fit->all.n, sizeof *fit->all.seen);
    memory_release(fit->allocator, fit->all.roots, fit->all.n, sizeof *fit->all.roots);
    memory_release(fit->allocator, fit->all.root_uv, fit->all.n, sizeof *fit->all.root_uv);
}

/* --- back into the groom ---------------------------------------------------------------------- */

static groom_status copy_operators(const struct groom *from, struct groom *to, struct groom_diag *diag)
{
    for (uint32_t o = 0; o < from->n_operators; o++) {
        const struct groom_operator *a = &from->operators[o];
        groom_status st = groom_insert_operator(to, o, a->type, a->seed, diag);
        if (st != GROOM_OK)
            return st;
        struct groom_operator *b = &to->operators[o];
        b->enabled = a->enabled;
        b->id = a->id;
        memcpy(b->parameter, a->parameter, sizeof b->parameter);
        groom_draw_random(to, b, a->seed);
    }
    return GROOM_OK;
}

/* The groom but for what each strand has of its own. */
static groom_status make_whole(const struct groom_fit *fit, struct groom **out, struct groom_diag *diag)
{
    const struct groom *from = fit->groom;
    struct groom_context own = {.allocator = fit->allocator};
    struct groom_shape shape = {fit->all.n, from->n_vertices, from->n_guides, from->n_operator_guides, from->n_instancing};
    struct groom *groom = NULL;
    groom_status st = groom_create(shape, &own, &groom, diag);
    if (st != GROOM_OK)
        return st;
    memcpy(groom->name, from->name, sizeof groom->name);
    groom->scalp = from->scalp;
    memcpy(groom->roots, fit->all.roots, fit->all.n * sizeof *groom->roots);
    memcpy(groom->root_uv, fit->all.root_uv, fit->all.n * sizeof *groom->root_uv);
    memcpy(groom->guides, from->guides, (size_t)from->n_guides * from->n_vertices * sizeof *groom->guides);
    memcpy(groom->guide_uv, from->guide_uv, from->n_guides * sizeof *groom->guide_uv);
    memcpy(groom->operator_guide, from->operator_guide, from->n_operator_guides * sizeof *groom->operator_guide);
    if ((st = copy_operators(from, groom, diag)) == GROOM_OK)
        *out = groom;
    else
        groom_destroy(groom);
    return st;
}

static groom_status place_all(const struct groom_fit *fit, struct groom *groom, const struct groom_context *context,
                              struct groom_diag *diag)
{
    float profile = assign_clump_profile(groom);
    float clearance = (float)fit->options.stages.initialize.head_clearance * fit->ordinary;
    struct assign_counts counts = {0};
    groom_status st = groom_instance_by_distance(groom, (float)fit->options.stages.initialize.sigma_instance, context, diag);
    if (st == GROOM_OK)
        st = assign_nearest(groom, context, diag);
    if (st == GROOM_OK && fit->bvh && profile > 0)
        st = assign_out_of_head(groom, fit->bvh, profile, clearance, 0, groom->n_strands, context, &counts, diag);
    return st;
}

/* Strand k of the fit is strand seen[k] of the whole. */
static void copy_seen(const struct groom_fit *fit, struct groom *groom)
{
    const struct groom *from = fit->groom;
    uint32_t n_k = from->n_instancing;
    for (uint32_t k = 0; k < fit->n; k++) {
        uint32_t i = fit->all.seen[k];
        memcpy(groom->instancing_guide + (size_t)i * n_k, from->instancing_guide + (size_t)k * n_k, n_k * sizeof *from->instancing_guide);
        memcpy(groom->instancing_weight + (size_t)i * n_k, from->instancing_weight + (size_t)k * n_k, n_k * sizeof *from->instancing_weight);
        groom->operator_guide_of[i] = from->operator_guide_of[k];
    }
    for (uint32_t o = 0; o < from->n_operators; o++) {
        const struct groom_operator *a = &from->operators[o];
        int per_guide = groom_operator_random_per_guide(a->type);
        uint32_t n = per_guide ? from->n_operator_guides : fit->n;
        for (uint32_t r = 0; r < groom_operator_random_arrays(a->type); r++)
            for (uint32_t k = 0; k < n; k++)
                groom->operators[o].random[r][per_guide ? k : fit->all.seen[k]] = a->random[r][k];
    }
}

groom_status unseen_restore(const struct groom_fit *fit, const struct groom_context *context, struct groom **out,
                            struct groom_diag *diag)
{
    struct groom *groom = NULL;
    groom_status st = make_whole(fit, &groom, diag);
    if (st == GROOM_OK && (st = place_all(fit, groom, context, diag)) == GROOM_OK) {
        copy_seen(fit, groom);
        *out = groom;
        groom = NULL;
    }
    groom_destroy(groom);
    return st;
}
