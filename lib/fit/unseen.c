#include "fit/unseen.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "fit/assign.h"
#include "fit/head_planes.h"
#include "fit/visibility.h"

#define TRIES 200    /* strands around one in the head that it may be like */
#define CHUNK 4000  /* strands that are looked at together */

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
    memcpy(groom->axes, from->axes, sizeof groom->axes);
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

/* Strand i of the whole gets all that strand k of the fit has but for its root. */
static void copy_strand(const struct groom *from, uint32_t k, struct groom *groom, uint32_t i)
{
    uint32_t n_k = from->n_instancing;
    memcpy(groom->instancing_guide + (size_t)i * n_k, from->instancing_guide + (size_t)k * n_k, n_k * sizeof *from->instancing_guide);
    memcpy(groom->instancing_weight + (size_t)i * n_k, from->instancing_weight + (size_t)k * n_k, n_k * sizeof *from->instancing_weight);
    groom->operator_guide_of[i] = from->operator_guide_of[k];
    for (uint32_t o = 0; o < from->n_operators; o++) {
        const struct groom_operator *a = &from->operators[o];
        for (uint32_t r = 0; !groom_operator_random_per_guide(a->type) && r < groom_operator_random_arrays(a->type); r++)
            groom->operators[o].random[r][i] = a->random[r][k];
    }
}

/* Strand k of the fit is strand seen[k] of the whole. */
static void copy_seen(const struct groom_fit *fit, struct groom *groom)
{
    const struct groom *from = fit->groom;
    for (uint32_t k = 0; k < fit->n; k++)
        copy_strand(from, k, groom, fit->all.seen[k]);
    for (uint32_t o = 0; o < from->n_operators; o++) {
        const struct groom_operator *a = &from->operators[o];
        for (uint32_t r = 0; groom_operator_random_per_guide(a->type) && r < groom_operator_random_arrays(a->type); r++)
            memcpy(groom->operators[o].random[r], a->random[r], from->n_operator_guides * sizeof *a->random[r]);
    }
}

/* --- out of the head ---------------------------------------------------------------------------- */

/* Strands of a groom that lie in the head, or out of it. */
struct lying {
    const struct groom_fit *fit;
    struct groom *groom;
    int in;                   /* which are wanted */
    float clearance;          /* metres in the head that do not count */
    uint32_t n, *strand;      /* [n] */
    float (*points)[3];       /* [CHUNK * m] */
    unsigned char *is_in;     /* [CHUNK] */
};

static void look_piece(void *user, uint32_t at, uint32_t thread)
{
    const struct lying *job = user;
    uint32_t m = job->groom->n_vertices;
    (void)thread;
    job->is_in[at] = assign_buried(job->fit->bvh, (const float (*)[3])job->points + (size_t)at * m, m, job->clearance) > 0;
}

/* Keeps those of the list that lie where they are wanted, in order. */
static groom_status keep_lying(struct lying *job, const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t n = 0;
    for (uint32_t first = 0; first < job->n; first += CHUNK) {
        uint32_t count = job->n - first < CHUNK ? job->n - first : CHUNK;
        struct groom *some = NULL;
        groom_status st = groom_select(job->groom, job->strand + first, count, context, &some, diag);
        if (st == GROOM_OK)
            st = groom_evaluate(some, 0, count, job->points, context, diag);
        groom_destroy(some);
        if (st != GROOM_OK)
            return st;
        parallel_for(context, count, look_piece, job);
        for (uint32_t at = 0; at < count; at++)
            if (job->is_in[at] == job->in)
                job->strand[n++] = job->strand[first + at];
    }
    job->n = n;
    return GROOM_OK;
}

static void list_unseen(struct lying *job)
{
    const struct groom_fit *fit = job->fit;
    job->n = 0;
    for (uint32_t i = 0, k = 0; i < fit->all.n; i++)
        if (k < fit->n && fit->all.seen[k] == i)
            k++;
        else
            job->strand[job->n++] = i;
}

/* Strands of the fit that lie out of the head, by where they are. */
struct models { uint32_t n, *strand; float (*uv)[2]; struct groom_neighbours *index; };

static groom_status models_init(struct models *models, const struct lying *job, const struct groom_context *context,
                                struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom_fit *fit = job->fit;
    struct lying seen = *job;
    *models = (struct models){.strand = memory_array(allocator, fit->n, sizeof *models->strand),
                              .uv = memory_array(allocator, fit->n, sizeof *models->uv)};
    if (!models->strand || !models->uv)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to look at %u strands", fit->n);
    for (uint32_t k = 0; k < fit->n; k++)
        models->strand[k] = k;
    seen.groom = fit->groom;
    seen.in = 0;
    seen.n = fit->n;
    seen.strand = models->strand;
    groom_status st = keep_lying(&seen, context, diag);
    models->n = st == GROOM_OK ? seen.n : 0;
    for (uint32_t at = 0; at < models->n; at++)
        memcpy(models->uv[at], fit->root_uv[models->strand[at]], sizeof *models->uv);
    return models->n > 0 ? groom_neighbours_create(models->uv[0], models->n, 2, context, &models->index, diag) : st;
}

static void models_finish(struct models *models, const struct groom_fit *fit, const struct groom_allocator *allocator)
{
    groom_neighbours_destroy(models->index);
    memory_release(allocator, models->strand, fit->n, sizeof *models->strand);
    memory_release(allocator, models->uv, fit->n, sizeof *models->uv);
}

/* Each gets what the model has that is the rank-th nearest to it. uv, near: [n], [n * TRIES] scratch */
static groom_status take_after(struct lying *job, const struct models *models, uint32_t rank, float (*uv)[2],
                               uint32_t *near, const struct groom_context *context, struct groom_diag *diag)
{
    for (uint32_t at = 0; at < job->n; at++)
        memcpy(uv[at], job->groom->root_uv[job->strand[at]], sizeof *uv);
    groom_status st = groom_neighbours_find(models->index, uv[0], job->n, rank + 1, near, NULL, context, diag);
    for (uint32_t at = 0; st == GROOM_OK && at < job->n; at++)
        copy_strand(job->fit->groom, models->strand[near[(size_t)at * (rank + 1) + rank]], job->groom, job->strand[at]);
    return st;
}

/* Nobody knows these strands: in place of the numbers drawn for them they get what the nearest strand has that is seen
 * and keeps them out; where none of a few does, what the nearest one has. */
static groom_status follow_models(struct lying *job, const struct models *models, const struct groom_context *context,
                                  struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = job->n, tries = models->n < TRIES ? models->n : TRIES;
    float (*uv)[2] = memory_array(allocator, n, sizeof *uv);
    uint32_t *near = memory_array(allocator, (size_t)n * TRIES, sizeof *near);
    groom_status st = uv && near ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for %u strands in the head", n);
    for (uint32_t rank = 0; st == GROOM_OK && rank < tries && job->n > 0; rank++)
        if ((st = take_after(job, models, rank, uv, near, context, diag)) == GROOM_OK)
            st = keep_lying(job, context, diag);
    if (st == GROOM_OK && tries > 0 && job->n > 0)
        st = take_after(job, models, 0, uv, near, context, diag);
    memory_release(allocator, uv, n, sizeof *uv);
    memory_release(allocator, near, (size_t)n * TRIES, sizeof *near);
    return st;
}

static groom_status clear_listed(struct lying *job, const struct groom_context *context, struct groom_diag *diag)
{
    struct models models = {0};
    groom_status st = keep_lying(job, context, diag);
    if (st != GROOM_OK || job->n == 0)
        return st;
    if ((st = models_init(&models, job, context, diag)) == GROOM_OK)
        st = follow_models(job, &models, context, diag);
    models_finish(&models, job->fit, memory_allocator(context));
    return st;
}

static groom_status clear_unseen(const struct groom_fit *fit, struct groom *groom, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct lying job = {.fit = fit, .groom = groom, .in = 1, .clearance = (float)HEAD_TOO_DEEP * fit->ordinary};
    size_t n_points = (size_t)CHUNK * groom->n_vertices;
    groom_status st = GROOM_OK;
    if (!fit->bvh)
        return GROOM_OK;
    job.strand = memory_array(allocator, fit->all.n, sizeof *job.strand);
    job.points = memory_array(allocator, n_points, sizeof *job.points);
    job.is_in = memory_array(allocator, CHUNK, 1);
    if (!job.strand || !job.points || !job.is_in)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to look for strands in the head");
    if (st == GROOM_OK) {
        list_unseen(&job);
        st = clear_listed(&job, context, diag);
    }
    memory_release(allocator, job.strand, fit->all.n, sizeof *job.strand);
    memory_release(allocator, job.points, n_points, sizeof *job.points);
    memory_release(allocator, job.is_in, CHUNK, 1);
    return st;
}

groom_status unseen_restore(const struct groom_fit *fit, const struct groom_context *context, struct groom **out,
                            struct groom_diag *diag)
{
    struct groom *groom = NULL;
    groom_status st = make_whole(fit, &groom, diag);
    if (st == GROOM_OK && (st = place_all(fit, groom, context, diag)) == GROOM_OK) {
        copy_seen(fit, groom);
        st = clear_unseen(fit, groom, context, diag);
    }
    if (st == GROOM_OK) {
        *out = groom;
        groom = NULL;
    }
    groom_destroy(groom);
    return st;
}
