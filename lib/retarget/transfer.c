/* The initial transfer: Yu et al., Section 4.1, Eqs. 3 to 6. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "geometry/vec.h"
#include "retarget/job.h"

#define PIECE 64              /* strands */
#define BATCH 32              /* pieces between two looks at progress */
#define SHORTEST 1e-9         /* metres: shorter segments count as this long */
#define STAYS 1e-6            /* metres: a strand whose particles all moved less is where it was */
#define ROOT_DEPTH 1e-4f      /* metres: a root that was deeper below the surface comes to lie on it */

/* --- Eq. 3 -------------------------------------------------------------------------- */

static struct vec surface_point(const struct groom_mesh *mesh, const struct anchor *anchor)
{
    const uint32_t *i = mesh->triangles[anchor->triangle];
    struct vec a = vec_of(mesh->points[i[0]]);
    struct vec e = vec_sub(vec_of(mesh->points[i[1]]), a), f = vec_sub(vec_of(mesh->points[i[2]]), a);
    return vec_add(a, vec_add(vec_scale(e, anchor->v), vec_scale(f, anchor->w)));
}

/* Without a bone: moved as the nearest point of the surface is. */
static struct vec follow_surface(const struct job *job, const struct anchor *anchor, uint32_t vertex, struct vec q)
{
    struct vec before = surface_point(job->source->body, anchor);
    return vec_add(vec_of(job->source->strands->points[vertex]), vec_sub(q, before));
}

void transfer_anchor(const struct job *job, uint32_t vertex, double out[3])
{
    const struct anchor *anchor = &job->source->anchors[vertex];
    struct vec q = surface_point(job->target->body, anchor), p;
    if (anchor->bone == ANCHOR_NO_BONE) {
        p = follow_surface(job, anchor, vertex, q);
    } else {
        const struct groom_bone *bone = &job->target->skeleton->bones[anchor->bone];
        struct vec head = vec_of(bone->head), tail = vec_of(bone->tail);
        struct vec o = vec_add(head, vec_scale(vec_sub(tail, head), (double)anchor->along / UINT32_MAX));
        p = vec_add(q, vec_scale(vec_unit(vec_sub(q, o)), anchor->eta));
    }
    out[0] = p.x, out[1] = p.y, out[2] = p.z;
}

void transfer_root(const struct job *job, uint32_t vertex, double out[3])
{
    const struct anchor *anchor = &job->source->anchors[vertex];
    transfer_anchor(job, vertex, out);
    if (anchor->eta > -ROOT_DEPTH)
        return;
    struct vec q = surface_point(job->target->body, anchor);
    out[0] = q.x, out[1] = q.y, out[2] = q.z;
}

/* --- Eqs. 4 to 6 ------------------------------------------------------------------------ */

/* One strand: what Eq. 4 solves for is the movement e = p - p-bar, since L[p] = L[p-bar] is L[e] = 0: along a run
 * of the index set e goes straight, by arc length, from the particle before it to the one after. */
struct smoothing {
    double (*e)[3];     /* movements by Eq. 3, then by Eq. 4 */
    double *arc;        /* arc length of the source's strand */
    uint8_t *free;      /* in the index set of Eq. 6 */
};

static double discrepancy(const struct smoothing *s, uint32_t i)
{
    double before = s->arc[i] - s->arc[i - 1], after = s->arc[i + 1] - s->arc[i], sum = 0;
    for (int c = 0; c < 3; c++) {
        double d = (s->e[i + 1][c] - s->e[i][c]) / after - (s->e[i][c] - s->e[i - 1][c]) / before;
        sum += d * d;
    }
    return sqrt(sum);
}

static uint32_t extend(const struct smoothing *s, uint32_t n, double threshold)
{
    uint32_t n_new = 0;
    for (uint32_t i = 1; i + 1 < n; i++)
        if (!s->free[i] && discrepancy(s, i) > threshold) {
            s->free[i] = 1;
            n_new++;
        }
    return n_new;
}

static void straighten(const struct smoothing *s, uint32_t n)
{
    for (uint32_t i = 1; i + 1 < n; i++) {
        if (!s->free[i])
            continue;
        uint32_t end = i;
        while (s->free[end])
            end++;
        for (uint32_t j = i; j < end; j++) {
            double t = (s->arc[j] - s->arc[i - 1]) / (s->arc[end] - s->arc[i - 1]);
            for (int c = 0; c < 3; c++)
                s->e[j][c] = s->e[i - 1][c] + t * (s->e[end][c] - s->e[i - 1][c]);
        }
        i = end;
    }
}

/* Iterated until the set is closed, as one pass leaves kinks where a run ends; or so many passes. Returns the size of
 * the set. */
static uint32_t smooth(const struct smoothing *s, uint32_t n, const struct groom_retarget_options *options)
{
    uint32_t n_free = 0, n_new = 1;
    memset(s->free, 0, n);
    for (uint32_t pass = 0; n_new > 0 && (pass < options->smoothing || options->smoothing == 0); pass++) {
        n_new = extend(s, n, options->discrepancy);
        straighten(s, n);
        n_free += n_new;
    }
    return n_free;
}

/* --- all strands --------------------------------------------------------------------------- */

struct transfer {
    struct job *job;
    struct smoothing *spaces; /* [threads] */
    uint64_t *n_free;         /* [pieces] */
};

static double segment_length(const float a[3], const float b[3])
{
    double length = vec_length(vec_sub(vec_of(b), vec_of(a)));
    return length > SHORTEST ? length : SHORTEST;
}

static int stays(const struct smoothing *s, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if (s->e[i][0] * s->e[i][0] + s->e[i][1] * s->e[i][1] + s->e[i][2] * s->e[i][2] > STAYS * STAYS)
            return 0;
    return 1;
}

static uint64_t transfer_strand(struct job *job, const struct smoothing *s, uint32_t strand)
{
    const struct groom_retarget_source *source = job->source;
    uint32_t first = source->strands->first[strand], n = source->strands->first[strand + 1] - first;
    const float(*rest)[3] = (const float(*)[3])source->strands->points + first;
    for (uint32_t i = 0; i < n; i++) {
        double p[3];
        if (i == 0)
            transfer_root(job, first, p);
        else
            transfer_anchor(job, first + i, p);
        for (int c = 0; c < 3; c++)
            s->e[i][c] = p[c] - rest[i][c];
        s->arc[i] = i ? s->arc[i - 1] + segment_length(rest[i - 1], rest[i]) : 0;
    }
    uint32_t n_free = smooth(s, n, job->options);
    job->standing[strand] = !job->shift && stays(s, n) ? STANDING_STAYS : 0;
    if (job->standing[strand] & STANDING_STAYS) /* to the bit */
        memset(s->e, 0, n * sizeof *s->e);
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            job->hat[first + i][c] = (float)(rest[i][c] + s->e[i][c] - job->centre[c]);
    for (int c = 0; job->shift && c < 3; c++)
        job->shift[strand][c] = (float)(job->target->roots[strand][c] - (rest[0][c] + s->e[0][c]));
    return n_free;
}

static void transfer_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct transfer *transfer = user;
    uint32_t n = transfer->job->source->strands->n_strands;
    for (uint32_t i = piece * PIECE; i < n && i - piece * PIECE < PIECE; i++)
        transfer->n_free[piece] += transfer_strand(transfer->job, &transfer->spaces[thread], i);
}

static void smoothing_finish(struct smoothing *s, uint32_t longest, const struct groom_allocator *allocator)
{
    memory_release(allocator, s->e, longest, sizeof *s->e);
    memory_release(allocator, s->arc, longest, sizeof *s->arc);
    memory_release(allocator, s->free, longest, 1);
}

static int smoothing_init(struct smoothing *s, uint32_t longest, const struct groom_allocator *allocator)
{
    s->e = memory_array(allocator, longest, sizeof *s->e);
    s->arc = memory_array(allocator, longest, sizeof *s->arc);
    s->free = memory_array(allocator, longest, 1);
    return s->e && s->arc && s->free;
}

groom_status transfer_all(struct job *job, struct groom_diag *diag)
{
    uint32_t n_threads = parallel_threads(job->context), longest = job->source->longest;
    uint32_t n_pieces = job->source->strands->n_strands / PIECE + 1;
    struct transfer transfer = {.job = job};
    transfer.spaces = memory_array_zero(job->allocator, n_threads, sizeof *transfer.spaces);
    transfer.n_free = memory_array_zero(job->allocator, n_pieces, sizeof *transfer.n_free);
    struct batches batches = {.n_pieces = n_pieces, .batch = BATCH, .to = TRANSFERRED, .doing = "strands were carried to the target"};
    int ready = transfer.spaces && transfer.n_free;
    for (uint32_t i = 0; ready && i < n_threads; i++)
        ready = smoothing_init(&transfer.spaces[i], longest, job->allocator);
    groom_status st = ready ? batches_run(job->context, &batches, transfer_piece, &transfer, diag)
                            : groom_fail(diag, GROOM_ENOMEM, "no memory for the initial transfer");
    for (uint32_t i = 0; st == GROOM_OK && i < n_pieces; i++)
        job->report->n_smoothed += transfer.n_free[i];
    for (uint32_t i = 0; transfer.spaces && i < n_threads; i++)
        smoothing_finish(&transfer.spaces[i], longest, job->allocator);
    memory_release(job->allocator, transfer.spaces, n_threads, sizeof *transfer.spaces);
    memory_release(job->allocator, transfer.n_free, n_pieces, sizeof *transfer.n_free);
    return st;
}

double adaptive_weight(double arc, double travel, double sigma)
{
    if (!(travel > 0))
        return 1;
    double ratio = arc / travel;
    return 1 - exp(-sigma * ratio * ratio);
}
