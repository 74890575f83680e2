#include "quality/inside.h"

#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"

#define DEEP 0.001 /* metres inside that count */
#define STRANDS_PER_PIECE 64u

struct looking {
    const struct quality_set *set;
    const struct groom_bvh *head;
    struct groom_quality_head *pieces; /* share: metres, until the pieces are added up */
};

static double between(const float *a, const float *b)
{
    double x = (double)b[0] - a[0], y = (double)b[1] - a[1], z = (double)b[2] - a[2];
    return sqrt(x * x + y * y + z * z);
}

/* Vertex j is deep; `run`: the one before it is, too. */
static void count_deep(const float (*x)[3], uint32_t j, int run, struct groom_quality_head *sum)
{
    sum->vertices++;
    sum->segments += run != 0;
    sum->share += run ? between(x[j - 1], x[j]) : 0;
}

static double distance_to(const struct groom_bvh *head, const float p[3])
{
    struct groom_surface_point closest;
    return groom_bvh_closest(head, p, INFINITY, &closest) ? closest.distance : INFINITY;
}

/* Which side a vertex is on: that of the one before it, unless the surface is between. */
static int side_of(const struct groom_bvh *head, const float *before, const float *here, int in)
{
    float way[3] = {here[0] - before[0], here[1] - before[1], here[2] - before[2]};
    return groom_bvh_occluded(head, before, way, 0, 1) ? groom_bvh_inside(head, here) : in;
}

/* A vertex that is d metres from deep, or from no longer being so, speaks for those within d metres along
 * its strand, which are not looked at. */
static void look_at(const struct looking *job, uint32_t i, struct groom_quality_head *sum)
{
    uint32_t m = job->set->m, before = sum->vertices;
    const float (*x)[3] = (const float (*)[3])(job->set->points + (size_t)i * m);
    int run = 0, in = groom_bvh_inside(job->head, x[1]);
    for (uint32_t j = 1; j < m;) {
        double distance = distance_to(job->head, x[j]), depth = in ? distance : -distance, walked = 0;
        int deep = depth > DEEP;
        sum->deepest = deep ? fmax(sum->deepest, depth) : sum->deepest;
        do {
            if (deep)
                count_deep(x, j, run, sum);
            run = deep;
            if (++j == m)
                break;
            walked += between(x[j - 1], x[j]);
            if (walked >= distance)
                in = side_of(job->head, x[j - 1], x[j], in);
        } while (walked < fabs(depth - DEEP));
    }
    sum->strands += sum->vertices > before;
}

static void look_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct looking *job = user;
    uint32_t first = piece * STRANDS_PER_PIECE;
    (void)thread;
    for (uint32_t i = first; i < job->set->n && i < first + STRANDS_PER_PIECE; i++)
        look_at(job, i, &job->pieces[piece]);
}

groom_status quality_inside(const struct quality_set *set, const struct groom_bvh *head, const struct groom_context *context,
                            struct groom_quality_head *result, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_pieces = set->n / STRANDS_PER_PIECE + (set->n % STRANDS_PER_PIECE != 0);
    struct looking job = {.set = set, .head = head, .pieces = memory_array_zero(allocator, n_pieces, sizeof *job.pieces)};
    struct groom_quality_head sum = {0};
    if (!job.pieces)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to look for strands inside the head");
    parallel_for(context, n_pieces, look_piece, &job);
    for (uint32_t p = 0; p < n_pieces; p++) {
        sum.strands += job.pieces[p].strands;
        sum.vertices += job.pieces[p].vertices;
        sum.segments += job.pieces[p].segments;
        sum.share += job.pieces[p].share;
        sum.deepest = fmax(sum.deepest, job.pieces[p].deepest);
    }
    sum.share /= quality_set_length(set);
    *result = sum;
    memory_release(allocator, job.pieces, n_pieces, sizeof *job.pieces);
    return GROOM_OK;
}
