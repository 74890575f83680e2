/* The truth: a groom whose guides grow on the scalp and whose operators are known. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "groom/scalp.h"
#include "sample/parts.h"

#define GUIDES_PER_PIECE 8
#define GUIDE_ROOTS 0.37 /* the offset of the guides' roots in their sequence */

/* --- guides -------------------------------------------------------------------- */

struct growing {
    const struct sample_style *style;
    uint64_t seed;
    struct groom *groom;
    const float (*root)[3];
    float (*fine)[3]; /* [threads][SAMPLE_FINE + 1] */
};

static void grow_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct growing *job = user;
    uint32_t m = job->groom->n_vertices, begin = piece * GUIDES_PER_PIECE;
    for (uint32_t g = begin; g < job->groom->n_guides && g < begin + GUIDES_PER_PIECE; g++)
        sample_guide_grow(job->style, job->seed, g, job->root[g], m, job->fine + (size_t)thread * (SAMPLE_FINE + 1),
                          job->groom->guides + (size_t)g * m);
}

static groom_status grow_guides(struct groom *groom, const struct sample_style *style, uint64_t seed,
                                const float (*roots)[3], const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_fine = (size_t)parallel_threads(context) * (SAMPLE_FINE + 1);
    struct growing job = {style, seed, groom, roots, memory_array(allocator, n_fine, 3 * sizeof(float))};
    if (!job.fine)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to grow %u guides", groom->n_guides);
    parallel_for(context, (groom->n_guides + GUIDES_PER_PIECE - 1) / GUIDES_PER_PIECE, grow_piece, &job);
    memory_release(allocator, job.fine, n_fine, 3 * sizeof(float));
    return GROOM_OK;
}

/* --- scalp coordinates ------------------------------------------------------------ */

/* The chart of all roots: the strands' and the guides'. roots [n_strands + n_guides] */
static groom_status place_in_chart(struct groom *groom, const struct groom_mesh *head, const float (*roots)[3],
                                   const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_bvh *bvh = NULL;
    struct groom_scalp *scalp = NULL;
    groom_status st = groom_bvh_create(head, context, &bvh, diag);
    if (st == GROOM_OK)
        st = groom_scalp_create(roots, groom->n_strands + groom->n_guides, bvh, context, &scalp, diag);
    if (st == GROOM_OK) {
        groom->scalp = groom_scalp_source_of(scalp);
        groom_scalp_coordinates(scalp, roots, groom->n_strands, groom->root_uv, context);
        groom_scalp_coordinates(scalp, roots + groom->n_strands, groom->n_guides, groom->guide_uv, context);
    }
    groom_scalp_destroy(scalp);
    groom_bvh_destroy(bvh);
    return st;
}

/* --- instancing -------------------------------------------------------------------- */

static float squared_distance(const float a[2], const float b[2])
{
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

/* On which side of the parting, in front of the crown: -1, 1; 0 where there is none. */
static int side_of(const struct sample_style *style, const float root[3])
{
    if (isnan(style->parting) || root[2] < -0.03f)
        return 0;
    return root[0] > style->parting ? 1 : -1;
}

static int opposite(const struct sample_style *style, const float a[3], const float b[3])
{
    return side_of(style, a) * side_of(style, b) < 0;
}

static uint32_t nearest_on_side(const struct groom *groom, const struct sample_style *style, uint32_t strand,
                                const uint32_t *among, uint32_t n)
{
    uint32_t best = 0;
    float least = INFINITY;
    for (uint32_t a = 0; a < n; a++) {
        uint32_t g = among ? among[a] : a;
        float d = squared_distance(groom->root_uv[strand], groom->guide_uv[g]);
        if (d < least && !opposite(style, groom->roots[strand], groom->guides[(size_t)g * groom->n_vertices])) {
            least = d;
            best = a;
        }
    }
    return best;
}

/* A parting stays one: strands take nothing from guides on its other side. */
static void keep_parting(struct groom *groom, const struct sample_style *style)
{
    uint32_t k = groom->n_instancing;
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        float *weight = groom->instancing_weight + (size_t)i * k, sum = 0;
        uint32_t *guide = groom->instancing_guide + (size_t)i * k;
        for (uint32_t a = 0; a < k; a++) {
            if (opposite(style, groom->roots[i], groom->guides[(size_t)guide[a] * groom->n_vertices]))
                weight[a] = 0;
            sum += weight[a];
        }
        if (sum == 0) {
            guide[0] = nearest_on_side(groom, style, i, NULL, groom->n_guides);
            weight[0] = sum = 1;
        }
        for (uint32_t a = 0; a < k; a++)
            weight[a] /= sum;
    }
}

/* Operator guides spread evenly: each next one is the guide farthest from those so far. */
static groom_status choose_operator_guides(struct groom *groom, const struct groom_context *context,
                                           struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    float *distance = memory_array(allocator, groom->n_guides, sizeof *distance);
    uint32_t next = 0;
    if (!distance)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to choose operator guides");
    for (uint32_t g = 0; g < groom->n_guides; g++)
        distance[g] = INFINITY;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        groom->operator_guide[o] = next;
        distance[next] = -1;
        for (uint32_t g = 0; g < groom->n_guides; g++)
            distance[g] = fminf(distance[g], squared_distance(groom->guide_uv[g], groom->guide_uv[groom->operator_guide[o]]));
        distance[next] = -1;
        for (uint32_t g = 0; g < groom->n_guides; g++)
            if (distance[g] > distance[next])
                next = g;
    }
    memory_release(allocator, distance, groom->n_guides, sizeof *distance);
    return GROOM_OK;
}

struct following { struct groom *groom; const struct sample_style *style; };

static void follow_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct following *job = user;
    (void)thread;
    for (uint32_t i = piece * 256; i < job->groom->n_strands && i < (piece + 1) * 256; i++)
        job->groom->operator_guide_of[i] =
            nearest_on_side(job->groom, job->style, i, job->groom->operator_guide, job->groom->n_operator_guides);
}

/* --- the whole ----------------------------------------------------------------------- */

static groom_status insert_operators(struct groom *groom, const struct sample_style *style, uint64_t seed,
                                     struct groom_diag *diag)
{
    for (uint32_t i = 0; i < style->n_operators; i++) {
        groom_status st = groom_insert_operator(groom, i, style->operators[i].type, seed, diag);
        if (st != GROOM_OK)
            return st;
        memcpy(groom->operators[i].parameter, style->operators[i].parameter, sizeof groom->operators[i].parameter);
    }
    return GROOM_OK;
}

static groom_status fill(struct groom *groom, const struct sample_style *style, uint64_t seed,
                         const struct groom_mesh *head, const float (*roots)[3], const struct groom_context *context,
                         struct groom_diag *diag)
{
    struct following job = {groom, style};
    groom_status st;
    memcpy(groom->roots, roots, groom->n_strands * sizeof *roots);
    if ((st = grow_guides(groom, style, seed, roots + groom->n_strands, context, diag)) != GROOM_OK ||
        (st = place_in_chart(groom, head, roots, context, diag)) != GROOM_OK ||
        (st = groom_instance_by_distance(groom, 0, context, diag)) != GROOM_OK ||
        (st = choose_operator_guides(groom, context, diag)) != GROOM_OK)
        return st;
    if (!isnan(style->parting))
        keep_parting(groom, style);
    parallel_for(context, (groom->n_strands + 255) / 256, follow_piece, &job);
    return insert_operators(groom, style, seed, diag);
}

groom_status sample_truth_create(const struct groom_sample_options *options, const struct groom_mesh *head,
                                 const struct groom_context *context, struct groom **truth, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_shape shape = {options->n_strands, options->n_vertices, options->n_guides, options->n_operator_guides,
                                options->n_guides < 3 ? options->n_guides : 3};
    size_t n_roots = (size_t)options->n_strands + options->n_guides;
    float (*roots)[3] = memory_array(allocator, n_roots, sizeof *roots);
    struct groom *groom = NULL;
    groom_status st;

    if (!roots)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u roots", options->n_strands);
    double turn = groom_random_uniform((struct groom_random_key){options->seed, STREAM_GUIDE}, UINT32_MAX, 0);
    sample_head_roots(options->n_strands, turn, roots);
    sample_head_roots(options->n_guides, turn + GUIDE_ROOTS, roots + options->n_strands);
    if ((st = groom_create(shape, context, &groom, diag)) != GROOM_OK)
        goto out;
    if ((st = fill(groom, sample_style_of(options->style), options->seed, head, (const float (*)[3])roots, context,
                   diag)) != GROOM_OK)
        goto out;
    if ((st = groom_validate(groom, diag)) != GROOM_OK)
        goto out;
    if (progress_cancelled(context)) {
        st = groom_fail(diag, GROOM_ECANCELLED, "cancelled while a sample was made");
        goto out;
    }
    *truth = groom;
    groom = NULL;
out:
    groom_destroy(groom);
    memory_release(allocator, roots, n_roots, sizeof *roots);
    return st;
}
