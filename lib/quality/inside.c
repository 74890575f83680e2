#include "quality/inside.h"

#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"

#define DEEP 0.001 /* metres inside that count */
#define STRANDS_PER_PIECE 64u

struct looking {
    const struct quality_set *set;
    const struct groom_bvh *head;
    struct groom_quality_head *pieces; /* share: metres for now */
};

static double between(const float *a, const float *b)
{
    double x = (double)b[0] - a[0], y = (double)b[1] - a[1], z = (double)b[2] - a[2];
    return sqrt(x * x + y * y + z * z);
}

/* A vertex d metres outside has none inside within d metres along its strand: those are passed over. */
static void look_at(const struct looking *job, uint32_t i, struct groom_quality_head *sum)
{
    uint32_t m = job->set->m, deep = 0;
    const float (*x)[3] = (const float (*)[3])(job->set->points + (size_t)i * m);
    int before = 0;
    for (uint32_t j = 1; j < m; j++) {
        double depth = -(double)groom_bvh_signed_distance(job->head, x[j]), walked = 0;
        if (depth > DEEP) {
            deep++;
            sum->deepest = fmax(sum->deepest, depth);
            sum->segments += before != 0;
            sum->share += before ? between(x[j - 1], x[j]) : 0;
            before = 1;
            continue;
        }
        before = 0;
        while (j + 1 < m && (walked += between(x[j], x[j + 1])) < DEEP - depth)
            j++;
    }
    sum->vertices += deep;
    sum->strands += deep > 0;
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
