#include "fit/assign.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/side.h"

#define STRANDS_PER_PIECE 64
#define CANDIDATES 24 /* operator guides that a strand may go to, the nearest one counted */

/* --- the nearest ---------------------------------------------------------------- */

static groom_status index_operator_guides(const struct groom *groom, const struct groom_context *context,
                                          struct groom_neighbours **index, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    float (*uv)[2] = memory_array(allocator, groom->n_operator_guides, sizeof *uv);
    if (!uv)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to find operator guides");
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        memcpy(uv[o], groom->guide_uv[groom->operator_guide[o]], sizeof uv[o]);
    groom_status st = groom_neighbours_create(uv[0], groom->n_operator_guides, 2, context, index, diag);
    memory_release(allocator, uv, groom->n_operator_guides, sizeof *uv);
    return st;
}

groom_status assign_nearest(struct groom *groom, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_neighbours *index;
    groom_status st = index_operator_guides(groom, context, &index, diag);
    if (st != GROOM_OK)
        return st;
    st = groom_neighbours_find(index, groom->root_uv[0], groom->n_strands, 1, groom->operator_guide_of, NULL, context,
                               diag);
    groom_neighbours_destroy(index);
    return st;
}

/* --- out of the head ---------------------------------------------------------------- */

uint32_t assign_buried(const struct groom_bvh *head, const float (*points)[3], uint32_t n, float clearance)
{
    struct side_walk walk = side_walk_begin(head);
    struct groom_surface_point near;
    uint32_t buried = 0;
    for (uint32_t j = 1; j < n; j++) {
        int inside = side_walk(&walk, points[j]);
        buried += inside && !groom_bvh_closest(head, points[j], clearance, &near);
    }
    return buried;
}

struct avoiding {
    struct groom *groom;
    const struct groom_bvh *head;
    float profile, clearance;
    uint32_t first, count, n_candidates;
    const uint32_t *candidate;  /* [count][n_candidates] nearest first */
    float (*scratch)[3];        /* [threads][2 m] */
    float *scratch_v;           /* [threads][m] */
    struct assign_counts *piece_counts;
};

/* Eq. 3 */
static void instance_strand(const struct groom *groom, uint32_t i, float (*out)[3])
{
    uint32_t k = groom->n_instancing, m = groom->n_vertices;
    for (uint32_t j = 0; j < m; j++)
        memcpy(out[j], groom->roots[i], sizeof out[j]);
    for (uint32_t a = 0; a < k; a++) {
        const float (*guide)[3] =
            (const float (*)[3])(groom->guides + (size_t)groom->instancing_guide[(size_t)i * k + a] * m);
        float weight = groom->instancing_weight[(size_t)i * k + a];
        for (uint32_t j = 1; j < m; j++)
            for (int c = 0; c < 3; c++)
                out[j][c] += weight * (guide[j][c] - guide[0][c]);
    }
}

/* 1 - exp(-profile v), v the share of arc length from the root */
static void clump_blend(const float (*points)[3], uint32_t m, float profile, float *blend)
{
    blend[0] = 0;
    for (uint32_t j = 1; j < m; j++) {
        float x = points[j][0] - points[j - 1][0], y = points[j][1] - points[j - 1][1];
        float z = points[j][2] - points[j - 1][2];
        blend[j] = blend[j - 1] + sqrtf(x * x + y * y + z * z);
    }
    float length = blend[m - 1];
    for (uint32_t j = 1; j < m; j++)
        blend[j] = length > 0 ? 1 - expf(-profile * blend[j] / length) : 0;
}

static uint32_t buried_with(const struct avoiding *job, const float (*base)[3], const float *blend, uint32_t candidate,
                            float (*clumped)[3])
{
    const struct groom *groom = job->groom;
    uint32_t m = groom->n_vertices;
    const float (*guide)[3] = (const float (*)[3])(groom->guides + (size_t)groom->operator_guide[candidate] * m);
    for (uint32_t j = 0; j < m; j++)
        for (int c = 0; c < 3; c++)
            clumped[j][c] = base[j][c] + blend[j] * (guide[j][c] - base[j][c]);
    return assign_buried(job->head, (const float (*)[3])clumped, m, job->clearance);
}

/* The one it has, else the nearest that adds nothing to what of the strand is in the head already without it. */
static void avoid_strand(const struct avoiding *job, uint32_t at, float (*scratch)[3], float *blend,
                         struct assign_counts *counts)
{
    struct groom *groom = job->groom;
    uint32_t i = job->first + at, m = groom->n_vertices;
    const uint32_t *candidate = job->candidate + (size_t)at * job->n_candidates;
    float (*base)[3] = scratch, (*clumped)[3] = scratch + m;

    instance_strand(groom, i, base);
    clump_blend((const float (*)[3])base, m, job->profile, blend);
    if (buried_with(job, (const float (*)[3])base, blend, groom->operator_guide_of[i], clumped) == 0)
        return;
    uint32_t own = assign_buried(job->head, (const float (*)[3])base, m, job->clearance);
    for (uint32_t c = 0; c < job->n_candidates; c++)
        if (buried_with(job, (const float (*)[3])base, blend, candidate[c], clumped) <= own) {
            counts->n_reassigned += groom->operator_guide_of[i] != candidate[c];
            groom->operator_guide_of[i] = candidate[c];
            counts->n_penetrating += own > 0;
            return;
        }
    counts->n_penetrating++;
}

static void avoid_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct avoiding *job = user;
    uint32_t m = job->groom->n_vertices, begin = piece * STRANDS_PER_PIECE;
    job->piece_counts[piece] = (struct assign_counts){0};
    for (uint32_t at = begin; at < job->count && at < begin + STRANDS_PER_PIECE; at++)
        avoid_strand(job, at, job->scratch + (size_t)thread * 2 * m, job->scratch_v + (size_t)thread * m,
                     &job->piece_counts[piece]);
}

groom_status assign_out_of_head(struct groom *groom, const struct groom_bvh *head, float profile, float clearance,
                                uint32_t first, uint32_t count, const struct groom_context *context,
                                struct assign_counts *counts, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_threads = parallel_threads(context), m = groom->n_vertices;
    uint32_t n_pieces = (count + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE;
    uint32_t k = groom->n_operator_guides < CANDIDATES ? groom->n_operator_guides : CANDIDATES;
    struct avoiding job = {.groom = groom, .head = head, .profile = profile, .clearance = clearance,
                           .first = first, .count = count, .n_candidates = k};
    struct groom_neighbours *index = NULL;
    uint32_t *candidate = memory_array(allocator, (size_t)count * k, sizeof *candidate);
    groom_status st = GROOM_OK;

    job.candidate = candidate;
    job.scratch = memory_array(allocator, (size_t)n_threads * 2 * m, sizeof *job.scratch);
    job.scratch_v = memory_array(allocator, (size_t)n_threads * m, sizeof *job.scratch_v);
    job.piece_counts = memory_array(allocator, n_pieces, sizeof *job.piece_counts);
    if (!candidate || !job.scratch || !job.scratch_v || !job.piece_counts) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to assign %u strands to operator guides", count);
        goto out;
    }
    if ((st = index_operator_guides(groom, context, &index, diag)) != GROOM_OK)
        goto out;
    if ((st = groom_neighbours_find(index, groom->root_uv[first], count, k, candidate, NULL, context, diag)) != GROOM_OK)
        goto out;
    parallel_for(context, n_pieces, avoid_piece, &job);
    for (uint32_t p = 0; p < n_pieces; p++) {
        counts->n_reassigned += job.piece_counts[p].n_reassigned;
        counts->n_penetrating += job.piece_counts[p].n_penetrating;
    }
out:
    groom_neighbours_destroy(index);
    memory_release(allocator, candidate, (size_t)count * k, sizeof *candidate);
    memory_release(allocator, job.scratch, (size_t)n_threads * 2 * m, sizeof *job.scratch);
    memory_release(allocator, job.scratch_v, (size_t)n_threads * m, sizeof *job.scratch_v);
    memory_release(allocator, job.piece_counts, n_pieces, sizeof *job.piece_counts);
    return st;
}
