#include "fit/head_planes.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/side.h"

#define STRANDS_PER_PIECE 64
#define ON_SURFACE 1e-6f /* metres: nearer, the way out is the surface's own normal */

static float apart(const float a[3], const float b[3])
{
    float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrtf(x * x + y * y + z * z);
}

/* Of a point and the nearest one of the surface. */
static struct head_plane plane_at(const float p[3], const float root[3], const struct groom_surface_point *near, int inside)
{
    struct head_plane plane;
    float outside = inside ? -near->distance : near->distance;
    plane.offset = outside;
    for (int c = 0; c < 3; c++) {
        plane.normal[c] = near->distance > ON_SURFACE ? (p[c] - near->position[c]) / outside : near->normal[c];
        plane.offset -= plane.normal[c] * (p[c] - root[c]);
    }
    return plane;
}

/* From a vertex far outside, those within the rest of the way are far outside, too, and not asked for. */
void head_planes_find(const struct groom_bvh *head, const float (*points)[3], uint32_t m, float reach, struct head_plane *out)
{
    struct side_walk walk = side_walk_begin(head);
    float spare = 0;
    memset(out, 0, head_planes_of(m) * sizeof *out);
    for (uint32_t k = 0, at = 0; k < head_planes_of(m); k++) {
        struct groom_surface_point near;
        uint32_t j = head_plane_vertex(k, m);
        for (; at < j; at++)
            spare -= apart(points[at], points[at + 1]);
        if (spare > 0 || !groom_bvh_closest(head, points[j], INFINITY, &near))
            continue;
        int inside = side_walk(&walk, points[j]);
        spare = near.distance - reach;
        if (inside || spare <= 0)
            out[k] = plane_at(points[j], points[0], &near, inside);
        if (inside)
            spare = 0;
    }
}

/* --- of the targets ------------------------------------------------------------------------- */

struct finding { struct groom_fit *fit; float (*scratch)[3]; };

static void find_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct finding *job = user;
    const struct groom_fit *fit = job->fit;
    float (*x)[3] = job->scratch + (size_t)thread * fit->m;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < fit->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++) {
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++)
                x[j][c] = fit->centre[c] + fit->scale * fit->target[(size_t)i * fit->m + j][c];
        memcpy(x[0], fit->roots[i], sizeof x[0]);
        head_planes_find(fit->bvh, (const float (*)[3])x, fit->m, (float)HEAD_REACH * fit->ordinary,
                         fit->head_plane + (size_t)i * head_planes_of(fit->m));
    }
}

groom_status head_planes_create(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_scratch = (size_t)parallel_threads(context) * fit->m;
    if (!fit->bvh)
        return GROOM_OK;
    struct finding job = {fit, memory_array(allocator, n_scratch, sizeof *job.scratch)};
    fit->head_plane = memory_array(fit->allocator, (size_t)fit->n * head_planes_of(fit->m), sizeof *fit->head_plane);
    if (job.scratch && fit->head_plane)
        parallel_for(context, fit->n / STRANDS_PER_PIECE + 1, find_piece, &job);
    memory_release(allocator, job.scratch, n_scratch, sizeof *job.scratch);
    if (!job.scratch || !fit->head_plane)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the head beside %u strands", fit->n);
    return GROOM_OK;
}
