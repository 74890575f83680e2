/* Stage `initialize`: Chang et al. 2025, Section 5.2.
 *
 * Strands are clustered; the clusters' mean strands, put on a root of theirs and smoothed, are the
 * guides; medoids among the guides are the operator guides; strands are instanced by distance and
 * follow the nearest operator guide that keeps them out of the head. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "fit/assign.h"
#include "fit/bundles.h"
#include "fit/coils.h"
#include "fit/estimate.h"
#include "fit/medoids.h"
#include "fit/smooth.h"
#include "fit/state.h"
#include "geometry/kmeans.h"

enum phase { SEED, CLUSTER, GUIDES, OPERATOR_GUIDES, OPERATORS, BUNDLES, INSTANCE, ASSIGN, ENDED };

#define STREAM_CLUSTERS 0x66690001u
#define STREAM_MEDOIDS 0x66690002u

#define FEATURE_VERTICES 16        /* of a strand, where seeds are drawn; */
#define CLUSTER_SHARE 3            /* one in so many, where clusters are looked for; */
#define WHOLE_ITERATIONS 2         /* of K-means, the last ones: all of them */
#define STEP_PRODUCTS 3e10         /* multiplications of K-means in a step: about half a second on two cores */
#define LEAST_CLUSTER 4            /* strands a guide, where the number of guides is automatic */
#define FEW_STRANDS 16             /* so many may each be their own guide: they need not be alike */
#define AS_NEAR 1.01f              /* squared distances that are the same but for rounding */
#define GUIDES_PER_ROOT 4.0        /* guides for each square root of the number of strands */
#define BUNDLE_GUIDES 2            /* guides an operator guide, where it has strands enough: a bundle that two share can be told, but not
                                    * two bundles that share one, nor what any of their strands do; */
#define BUNDLE_STRANDS 16          /* with fewer, */
#define FEW_BUNDLE_GUIDES 4        /* so many guides: to stand in the middle of a bundle costs a guide what its own strands are like */

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }
static uint32_t most(uint32_t a, uint32_t b) { return a > b ? a : b; }
static uint32_t share_of(uint32_t n, uint32_t parts) { return (n + parts - 1) / parts; }

/* --- seeds -------------------------------------------------------------------- */

/* Curls to have guides for, where there may be curls. */
static groom_status count_coils(const struct groom_fit *fit, const struct groom_context *context, uint32_t *n_coils,
                                struct groom_diag *diag)
{
    int winds = 0;
    *n_coils = 0;
    for (uint32_t i = 0; i < fit->options.n_operators; i++)
        winds |= fit->options.operators[i] == GROOM_OPERATOR_CURL;
    return winds ? coils_count(fit, context, n_coils, diag) : GROOM_OK;
}

static uint32_t automatic_guides(uint32_t n, uint32_t n_coils)
{
    uint32_t guides = (uint32_t)(GUIDES_PER_ROOT * sqrt(n) + 0.5);
    return least(most(guides, n_coils), most(least(n, FEW_STRANDS), n / LEAST_CLUSTER));
}

static groom_status count_guides(const struct groom_fit *fit, const struct groom_context *context, uint32_t *wanted,
                                 struct groom_diag *diag)
{
    uint32_t n_coils;
    *wanted = least(fit->options.guides, fit->n);
    if (fit->options.guides != GROOM_FIT_AUTO)
        return GROOM_OK;
    groom_status st = count_coils(fit, context, &n_coils, diag);
    *wanted = automatic_guides(fit->n, n_coils);
    return st;
}

/* q vertices of each of n strands of m, evenly. out [n][q] */
static void take_features(const float (*points)[3], uint32_t n, uint32_t m, uint32_t q, float (*out)[3])
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t a = 0; a < q; a++)
            memcpy(out[(size_t)i * q + a], points[(size_t)i * m + a * (m - 1) / (q - 1)], sizeof *out);
}

static groom_status keep_seeds(struct groom_fit *fit, const uint32_t *chosen, uint32_t n_guides,
                               struct groom_diag *diag)
{
    size_t m = fit->m;
    fit->centroids = memory_array(fit->allocator, n_guides * m, sizeof *fit->centroids);
    fit->cluster_of = memory_array_zero(fit->allocator, fit->n, sizeof *fit->cluster_of);
    if (!fit->centroids || !fit->cluster_of) {
        memory_release(fit->allocator, fit->centroids, n_guides * m, sizeof *fit->centroids);
        memory_release(fit->allocator, fit->cluster_of, fit->n, sizeof *fit->cluster_of);
        fit->centroids = NULL;
        fit->cluster_of = NULL;
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u clusters", n_guides);
    }
    for (uint32_t g = 0; g < n_guides; g++)
        memcpy(fit->centroids + g * m, fit->target + chosen[g] * m, m * sizeof *fit->centroids);
    fit->n_guides = n_guides;
    return GROOM_OK;
}

static groom_status seed_clusters(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t asked = fit->options.guides, n_vertices = least(fit->m, FEATURE_VERTICES), n_chosen, wanted;
    groom_status st = count_guides(fit, context, &wanted, diag);
    if (st != GROOM_OK)
        return st;
    float (*features)[3] = memory_array(allocator, (size_t)fit->n * n_vertices, sizeof *features);
    uint32_t *chosen = memory_array(allocator, wanted, sizeof *chosen);
    struct groom_random_key key = {FIT_OWN_SEED, STREAM_CLUSTERS};

    if (!features || !chosen) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to seed %u clusters", wanted);
        goto out;
    }
    take_features((const float (*)[3])fit->target, fit->n, fit->m, n_vertices, features); /* enough where only seeds are wanted */
    st = kmeans_seed(features[0], fit->n, 3 * n_vertices, wanted, key, context, chosen, &n_chosen, diag);
    if (st != GROOM_OK || (st = keep_seeds(fit, chosen, n_chosen, diag)) != GROOM_OK)
        goto out;
    if (asked > n_chosen)
        report_note(&fit->report, "%u guides were asked for; %u different strands allow %u.", asked, n_chosen, n_chosen);
    fit->phase = CLUSTER;
out:
    memory_release(allocator, features, (size_t)fit->n * n_vertices, sizeof *features);
    memory_release(allocator, chosen, wanted, sizeof *chosen);
    return st;
}

/* --- clusters -------------------------------------------------------------------- */

/* The loss of K-means in square metres a vertex, like Eq. 5. */
static void note_objective(struct groom_fit *fit, double objective, uint32_t n_vertices, const struct groom_context *context)
{
    struct groom_fit_report *report = &fit->report;
    double value = objective * fit->scale * fit->scale / n_vertices;
    if (fit->iteration == 0)
        report_loss(report, "initialize", "cluster", value, value);
    report->losses[report->n_losses - 1].after = value;
    progress_loss(context, "cluster", fit->iteration, value);
}

/* An iteration of K-means on q vertices of each strand; all vertices follow. */
static groom_status iterate_on_features(struct groom_fit *fit, uint32_t q, struct kmeans_step *step,
                                        const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_rows = (size_t)fit->n * q, n_centres = (size_t)fit->n_guides * q;
    float (*rows)[3] = memory_array(allocator, n_rows, sizeof *rows);
    float (*centres)[3] = memory_array(allocator, n_centres, sizeof *centres);
    uint32_t *cluster_of = memory_array(allocator, fit->n, sizeof *cluster_of);
    groom_status st = rows && centres && cluster_of ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to cluster %u strands", fit->n);
    if (st == GROOM_OK) {
        take_features((const float (*)[3])fit->target, fit->n, fit->m, q, rows);
        take_features((const float (*)[3])fit->centroids, fit->n_guides, fit->m, q, centres);
        memcpy(cluster_of, fit->cluster_of, fit->n * sizeof *cluster_of);
        st = kmeans_iterate(rows[0], fit->n, 3 * q, fit->n_guides, centres[0], cluster_of, context, step, diag);
    }
    if (st == GROOM_OK)
        st = kmeans_means(fit->target[0], fit->n, 3 * fit->m, fit->n_guides, cluster_of, fit->centroids[0], context, diag);
    if (st == GROOM_OK)
        memcpy(fit->cluster_of, cluster_of, fit->n * sizeof *cluster_of);
    memory_release(allocator, rows, n_rows, sizeof *rows);
    memory_release(allocator, centres, n_centres, sizeof *centres);
    memory_release(allocator, cluster_of, fit->n, sizeof *cluster_of);
    return st;
}

/* Neighbouring vertices say much the same: where clusters are only on their way, some are enough. */
static uint32_t vertices_of_iteration(const struct groom_fit *fit)
{
    uint32_t limit = fit->options.stages.initialize.cluster_iterations, some = fit->m / CLUSTER_SHARE;
    return fit->iteration + WHOLE_ITERATIONS < limit && some >= FEATURE_VERTICES ? some : fit->m;
}

static groom_status iterate(struct groom_fit *fit, uint32_t n_vertices, struct kmeans_step *step,
                            const struct groom_context *context, struct groom_diag *diag)
{
    if (n_vertices < fit->m)
        return iterate_on_features(fit, n_vertices, step, context, diag);
    return kmeans_iterate(fit->target[0], fit->n, 3 * fit->m, fit->n_guides, fit->centroids[0], fit->cluster_of, context, step,
                          diag);
}

static groom_status cluster(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t limit = fit->options.stages.initialize.cluster_iterations;
    struct kmeans_step step;
    for (double spent = 0, products = 0; spent == 0 || spent + products <= STEP_PRODUCTS; spent += products) {
        uint32_t n_vertices = vertices_of_iteration(fit);
        groom_status st = iterate(fit, n_vertices, &step, context, diag);
        if (st != GROOM_OK)
            return st;
        products = (double)fit->n * fit->n_guides * 3 * n_vertices;
        note_objective(fit, step.objective, n_vertices, context);
        int settled = fit->iteration > 0 && step.n_changed == 0;
        fit->iteration++;
        if (settled && n_vertices < fit->m)
            fit->iteration = limit > WHOLE_ITERATIONS ? limit - WHOLE_ITERATIONS : fit->iteration;
        else if (fit->iteration >= limit || settled) {
            fit->phase = GUIDES;
            fit->iteration = 0;
            break;
        }
    }
    return GROOM_OK;
}

/* --- guides ------------------------------------------------------------------------- */

static float off_mean_root(const struct groom_fit *fit, uint32_t i)
{
    const float *root = fit->target[(size_t)i * fit->m], *mean = fit->centroids[(size_t)fit->cluster_of[i] * fit->m];
    float x = root[0] - mean[0], y = root[1] - mean[1], z = root[2] - mean[2];
    return x * x + y * y + z * z;
}

/* For each cluster, the strand among its own whose root is nearest to the mean root: it lends the
 * guide its root, which is on the scalp then, while the mean of roots is below it. Of two strands both are as near:
 * the first one does, and rounding does not decide. */
static void nearest_roots(const struct groom_fit *fit, uint32_t *strand_of, float *squared)
{
    for (uint32_t g = 0; g < fit->n_guides; g++) {
        squared[g] = INFINITY;
        strand_of[g] = 0; /* no cluster is empty, unless a checkpoint was made up */
    }
    for (uint32_t i = 0; i < fit->n; i++)
        squared[fit->cluster_of[i]] = fminf(squared[fit->cluster_of[i]], off_mean_root(fit, i));
    for (uint32_t i = fit->n; i-- > 0;)
        if (off_mean_root(fit, i) <= AS_NEAR * squared[fit->cluster_of[i]])
            strand_of[fit->cluster_of[i]] = i;
}

/* The mean strand moved as a whole: the instanced strands, which take shapes from guides and roots
 * from themselves (Eq. 3), stay where the cluster's mean is. */
static void place_guides(const struct groom_fit *fit, const uint32_t *strand_of, struct groom *groom)
{
    for (uint32_t g = 0; g < fit->n_guides; g++) {
        const float *root = fit->roots[strand_of[g]];
        float (*guide)[3] = groom->guides + (size_t)g * fit->m;
        const float (*mean)[3] = (const float (*)[3])(fit->centroids + (size_t)g * fit->m);
        memcpy(groom->guide_uv[g], fit->root_uv[strand_of[g]], sizeof groom->guide_uv[g]);
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++)
                guide[j][c] = root[c] + fit->scale * (mean[j][c] - mean[0][c]);
    }
}

static groom_status count_operator_guides(const struct groom_fit *fit, const struct groom_context *context, uint32_t *wanted,
                                          struct groom_diag *diag)
{
    uint32_t n_coils, n_guides = fit->n_guides;
    *wanted = least(fit->options.operator_guides, n_guides);
    if (fit->options.operator_guides != GROOM_FIT_AUTO)
        return GROOM_OK;
    groom_status st = count_coils(fit, context, &n_coils, diag);
    uint32_t for_strands = most(fit->n / BUNDLE_STRANDS, share_of(n_guides, FEW_BUNDLE_GUIDES));
    *wanted = least(most(least(share_of(n_guides, BUNDLE_GUIDES), for_strands), n_coils), n_guides);
    return st;
}

static groom_status choose_shape(const struct groom_fit *fit, const struct groom_context *context, struct groom_shape *shape,
                                 struct groom_diag *diag)
{
    *shape = (struct groom_shape){.n_strands = fit->n, .n_vertices = fit->m, .n_guides = fit->n_guides,
                                  .n_instancing = least(fit->options.interpolation_guides, fit->n_guides)};
    return count_operator_guides(fit, context, &shape->n_operator_guides, diag);
}

static void note_shape(struct groom_fit *fit, const struct groom_shape *shape)
{
    const struct groom_fit_options *options = &fit->options;
    fit->report.n_guides = shape->n_guides;
    fit->report.n_operator_guides = shape->n_operator_guides;
    if (options->operator_guides > shape->n_operator_guides)
        report_note(&fit->report, "%u operator guides were asked for; there are only %u guides.",
                    options->operator_guides, shape->n_guides);
    if (options->interpolation_guides > shape->n_instancing)
        report_note(&fit->report, "Each strand blends all %u guides there are.", shape->n_instancing);
}

static groom_status make_guides(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_shape shape;
    groom_status st = choose_shape(fit, context, &shape, diag);
    if (st != GROOM_OK)
        return st;
    struct groom_context own = {.allocator = fit->allocator}; /* the groom outlives the step's context */
    uint32_t *strand_of = memory_array(allocator, fit->n_guides, sizeof *strand_of);
    float *squared = memory_array(allocator, fit->n_guides, sizeof *squared);
    uint32_t n_fixed = (uint32_t)(fit->options.stages.initialize.fixed_fraction * fit->m);
    struct groom *groom = NULL;

    if (!strand_of || !squared) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for %u guides", fit->n_guides);
        goto out;
    }
    if ((st = groom_create(shape, &own, &groom, diag)) != GROOM_OK)
        goto out;
    groom->scalp = fit->report.scalp;
    memcpy(groom->roots, fit->roots, fit->n * sizeof *fit->roots);
    memcpy(groom->root_uv, fit->root_uv, fit->n * sizeof *fit->root_uv);
    nearest_roots(fit, strand_of, squared);
    place_guides(fit, strand_of, groom);
    st = smooth_polylines(groom->guides, fit->n_guides, fit->m, n_fixed, fit->options.stages.initialize.lambda_smooth,
                          fit->options.stages.initialize.n_smooth, context, diag);
    if (st != GROOM_OK)
        goto out;
    note_shape(fit, &shape);
    fit->groom = groom;
    groom = NULL;
    fit->phase = OPERATOR_GUIDES;
out:
    groom_destroy(groom);
    memory_release(allocator, strand_of, fit->n_guides, sizeof *strand_of);
    memory_release(allocator, squared, fit->n_guides, sizeof *squared);
    return st;
}

/* --- operator guides, instancing ----------------------------------------------------- */

static groom_status choose_operator_guides(struct groom_fit *fit, const struct groom_context *context,
                                           struct groom_diag *diag)
{
    struct groom *groom = fit->groom;
    struct groom_random_key key = {FIT_OWN_SEED, STREAM_MEDOIDS};
    double before, after;
    groom_status st = medoids_choose(groom->guides[0], groom->n_guides, 3 * groom->n_vertices, groom->n_operator_guides,
                                     fit->options.stages.initialize.medoid_iterations, key, context,
                                     groom->operator_guide, &before, &after, diag);
    if (st != GROOM_OK)
        return st;
    double per_vertex = 1 / sqrt(groom->n_vertices);
    report_loss(&fit->report, "initialize", "medoids", before * per_vertex, after * per_vertex);
    fit->phase = OPERATORS;
    return GROOM_OK;
}

/* Whether strands of an operator guide do something together, by which they can be told. */
static int moves_bundles(const struct groom_fit_options *options)
{
    int together = 0;
    for (uint32_t i = 0; i < options->n_operators; i++)
        together |= options->operators[i] == GROOM_OPERATOR_CURL || options->operators[i] == GROOM_OPERATOR_CLUMP;
    return together;
}

/* Estimates look at clusters by their mean strands: they come before, for bundles move some of these. */
static groom_status bundle(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = assign_nearest(fit->groom, context, diag);
    if (st == GROOM_OK && moves_bundles(&fit->options))
        st = bundles_find(fit, context, diag);
    if (st == GROOM_OK)
        fit->phase = INSTANCE;
    return st;
}

static groom_status instance(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    float sigma = (float)fit->options.stages.initialize.sigma_instance;
    groom_status st = groom_instance_by_distance(fit->groom, sigma, context, diag);
    if (st == GROOM_OK)
        fit->phase = ASSIGN;
    return st;
}

/* --- operators ------------------------------------------------------------------------- */

static groom_status make_operators(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom *groom = fit->groom;
    struct estimates estimates;
    int estimate = fit->options.stages.initialize.estimate_operators;
    groom_status st = estimate ? estimate_operators(fit, context, &estimates, diag) : GROOM_OK;
    for (uint32_t i = 0; st == GROOM_OK && i < fit->options.n_operators; i++) {
        st = groom_insert_operator(groom, i, fit->options.operators[i], fit->options.seed, diag);
        if (st == GROOM_OK && estimate)
            estimate_apply(&estimates, &groom->operators[i]);
    }
    if (st == GROOM_OK) {
        fit->phase = BUNDLES;
        return GROOM_OK;
    }
    while (groom->n_operators > 0 && groom_remove_operator(groom, groom->n_operators - 1, NULL) == GROOM_OK)
        continue;
    return st;
}

groom_status initialize_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                             struct groom_diag *diag)
{
    groom_status st = GROOM_EINTERNAL;
    switch ((enum phase)fit->phase) {
    case SEED: st = seed_clusters(fit, context, diag); break;
    case CLUSTER: st = cluster(fit, context, diag); break;
    case GUIDES: st = make_guides(fit, context, diag); break;
    case OPERATOR_GUIDES: st = choose_operator_guides(fit, context, diag); break;
    case OPERATORS: st = make_operators(fit, context, diag); break;
    case BUNDLES: st = bundle(fit, context, diag); break;
    case INSTANCE: st = instance(fit, context, diag); break;
    case ASSIGN: st = assign_step(fit, ended, context, diag); break;
    case ENDED: break;
    }
    return st;
}

double initialize_fraction(const struct groom_fit *fit)
{
    /* where each phase begins, by its time on 30 000 strands */
    static const double begin[] = {0, 0.15, 0.7, 0.72, 0.76, 0.78, 0.81, 0.82, 1};
    double within = 0;
    if (fit->phase == CLUSTER)
        within = (double)fit->iteration / fit->options.stages.initialize.cluster_iterations;
    if (fit->phase == ASSIGN)
        within = (double)fit->iteration / fit->n;
    return fit->phase >= ENDED ? 1 : begin[fit->phase] + within * (begin[fit->phase + 1] - begin[fit->phase]);
}

int initialize_sound(const struct groom_fit *fit)
{
    int has_clusters = fit->n_guides > 0, has_groom = fit->groom != NULL;
    switch ((enum phase)fit->phase) {
    case SEED: return !has_clusters && !has_groom;
    case CLUSTER:
        return has_clusters && !has_groom && fit->iteration < fit->options.stages.initialize.cluster_iterations &&
               (fit->iteration == 0 || fit->report.n_losses > 0);
    case GUIDES: return has_clusters && !has_groom;
    case OPERATOR_GUIDES:
    case OPERATORS: return has_clusters && has_groom && fit->groom->n_operators == 0;
    case BUNDLES:
    case INSTANCE: return has_clusters && has_groom;
    case ASSIGN: return has_clusters && has_groom && fit->iteration < fit->n;
    case ENDED: break;
    }
    return 0;
}
