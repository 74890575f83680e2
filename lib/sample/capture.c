/* What a reconstruction makes of hair: the truth's dense strands with its usual defects. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "sample/parts.h"

#define PI 3.14159265358979323846
#define N_PATCHES 5       /* regions that the capture lost */
#define N_WAVES 4         /* cosines of the smooth error along a strand */
#define RANGE 8192        /* strands evaluated at a time */
#define N_RINGS 24        /* directions around the head, in which strands hide each other */
#define N_SECTORS 48

struct capturing {
    const struct groom_sample_options *options;
    const struct groom *truth;
    float (*points)[3];     /* [n][m] the truth's strands */
    unsigned char *missing; /* [n] */
    unsigned char *cut;     /* [n] ends early: hidden by others */
    uint32_t *list;         /* [n_capture] strands of the capture; duplicates at the end */
    struct groom_strands *out;
};

static const float (*strand_of(const struct capturing *job, uint32_t i))[3]
{
    return (const float (*)[3])(job->points + (size_t)i * job->truth->n_vertices);
}

/* --- which strands ------------------------------------------------------------------ */

struct ranked { float value; uint32_t strand; };

static int compare_ranked(const void *a, const void *b)
{
    const struct ranked *p = a, *q = b;
    if (p->value != q->value)
        return p->value < q->value ? -1 : 1;
    return (p->strand > q->strand) - (p->strand < q->strand);
}

/* Marks the `count` strands of the least value. */
static void mark_least(struct ranked *ranked, uint32_t n, uint32_t count, unsigned char *mark)
{
    qsort(ranked, n, sizeof *ranked, compare_ranked);
    for (uint32_t r = 0; r < count && r < n; r++)
        mark[ranked[r].strand] = 1;
}

/* Those whose roots are nearest to one of a few places. */
static void lose_patches(struct capturing *job, struct ranked *ranked)
{
    const struct groom *truth = job->truth;
    struct groom_random_key key = {job->options->seed, STREAM_PATCH};
    for (uint32_t i = 0; i < truth->n_strands; i++) {
        ranked[i] = (struct ranked){INFINITY, i};
        for (uint32_t p = 0; p < N_PATCHES; p++) {
            const float *patch = truth->root_uv[groom_random_below(key, p, 0, truth->n_strands)];
            float u = truth->root_uv[i][0] - patch[0], v = truth->root_uv[i][1] - patch[1];
            ranked[i].value = fminf(ranked[i].value, u * u + v * v);
        }
    }
    mark_least(ranked, truth->n_strands, (uint32_t)(job->options->missing * truth->n_strands), job->missing);
}

/* The cell of a vertex's direction from the middle of the head, and its distance. */
static uint32_t cell_of(const float p[3], float *distance)
{
    double x = p[0] - sample_head_centre[0], y = p[1] - sample_head_centre[1], z = p[2] - sample_head_centre[2];
    double r = sqrt(x * x + y * y + z * z);
    *distance = (float)r;
    uint32_t ring = (uint32_t)(acos(r > 0 ? y / r : 0) / PI * N_RINGS);
    uint32_t sector = (uint32_t)((atan2(x, z) / (2 * PI) + 0.5) * N_SECTORS);
    return (ring < N_RINGS ? ring : N_RINGS - 1) * N_SECTORS + (sector < N_SECTORS ? sector : N_SECTORS - 1);
}

/* Those that lie below the mean of the hair in their directions: nobody saw them, so a reconstruction
 * makes them too short. */
static void cut_inner(struct capturing *job, struct ranked *ranked)
{
    static const uint32_t n_cells = N_RINGS * N_SECTORS;
    uint32_t n = job->truth->n_strands, m = job->truth->n_vertices, count[N_RINGS * N_SECTORS] = {0};
    double sum[N_RINGS * N_SECTORS] = {0};
    float distance;
    for (size_t v = 0; v < (size_t)n * m; v++) {
        uint32_t cell = cell_of(job->points[v], &distance);
        sum[cell] += distance;
        count[cell]++;
    }
    for (uint32_t c = 0; c < n_cells; c++)
        sum[c] /= count[c] ? count[c] : 1;
    for (uint32_t i = 0; i < n; i++) {
        double above = 0;
        for (uint32_t j = m / 4; j < m; j++) {
            uint32_t cell = cell_of(strand_of(job, i)[j], &distance);
            above += distance - sum[cell];
        }
        ranked[i] = (struct ranked){(float)above, i};
    }
    mark_least(ranked, n, (uint32_t)(job->options->inner_short * n), job->cut);
}

/* --- what becomes of a strand ---------------------------------------------------------- */

static double uniform(const struct capturing *job, uint32_t strand, uint32_t draw)
{
    return groom_random_uniform((struct groom_random_key){job->options->seed, STREAM_DEFECT}, strand, draw);
}

/* The vertices that remain: first .. end-1, the root moved to a share `t` of the first segment. */
struct remains { uint32_t first, end; double t; };

static struct remains remains_of(const struct capturing *job, uint32_t i)
{
    uint32_t m = job->truth->n_vertices;
    const float (*points)[3] = strand_of(job, i);
    struct remains r = {0, m, 0};
    double off = job->options->off_scalp_m > 0 ? uniform(job, i, 0) * job->options->off_scalp_m : 0;
    if (job->cut[i])
        r.end = (uint32_t)(m * (0.25 + 0.35 * uniform(job, i, 1)));
    r.end = r.end < 3 ? (m < 3 ? m : 3) : r.end;
    while (off > 0) {
        double length = groom_polyline_length(points + r.first, 2);
        if (off < length || r.first + 3 >= r.end) {
            r.t = length > 0 ? fmin(off / length, 0.9) : 0;
            break;
        }
        off -= length;
        r.first++;
    }
    return r;
}

/* A sum of cosines along the strand, of standard deviation noise_m at each vertex. */
static void add_noise(const struct capturing *job, uint32_t i, float (*points)[3], uint32_t n)
{
    struct groom_random_key key = {job->options->seed, STREAM_NOISE};
    double size[3][N_WAVES];
    for (uint32_t c = 0; c < 3; c++)
        for (uint32_t w = 0; w < N_WAVES; w++)
            size[c][w] = job->options->noise_m * sqrt(2.0 / (N_WAVES + 1)) * groom_random_normal(key, i, c * N_WAVES + w);
    for (uint32_t j = 0; j < n; j++)
        for (int c = 0; c < 3; c++) {
            double error = 0;
            for (uint32_t w = 0; w < N_WAVES; w++)
                error += (w ? 1 : 0.7071067811865476) * size[c][w] * cos(PI * w * j / (n - 1));
            points[j][c] += (float)error;
        }
}

static void capture_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct capturing *job = user;
    (void)thread;
    for (uint32_t s = piece * 256; s < job->out->n_strands && s < (piece + 1) * 256; s++) {
        uint32_t i = job->list[s];
        struct remains r = remains_of(job, i);
        const float (*points)[3] = strand_of(job, i);
        float (*out)[3] = job->out->points + job->out->first[s];
        memcpy(out, points + r.first, (r.end - r.first) * sizeof *out);
        for (int c = 0; c < 3 && r.t > 0; c++)
            out[0][c] = (float)(points[r.first][c] + r.t * ((double)points[r.first + 1][c] - points[r.first][c]));
        if (job->options->noise_m > 0)
            add_noise(job, i, out, r.end - r.first);
    }
}

/* --- the whole ---------------------------------------------------------------------------- */

static groom_status evaluate(struct capturing *job, const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t n = job->truth->n_strands, m = job->truth->n_vertices;
    for (uint32_t first = 0; first < n; first += RANGE) {
        uint32_t count = n - first < RANGE ? n - first : RANGE;
        groom_status st = groom_evaluate(job->truth, first, count, job->points + (size_t)first * m, context, diag);
        if (st != GROOM_OK)
            return st;
    }
    return GROOM_OK;
}

/* The strands that are left, then those that come twice. Returns how many; `list` may be NULL. */
static uint32_t list_strands(const struct capturing *job, uint32_t *list)
{
    uint32_t n = job->truth->n_strands, at = 0;
    for (int again = 0; again < 2; again++)
        for (uint32_t i = 0; i < n; i++) {
            if (job->missing[i] || (again && uniform(job, i, 2) >= job->options->duplicates))
                continue;
            if (list)
                list[at] = i;
            at++;
        }
    return at;
}

static groom_status make_strands(struct capturing *job, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = list_strands(job, NULL);
    uint64_t n_vertices = 0;
    if (!(job->list = memory_array(allocator, n, sizeof *job->list)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a capture of %u strands", n);
    list_strands(job, job->list);
    for (uint32_t s = 0; s < n; s++) {
        struct remains r = remains_of(job, job->list[s]);
        n_vertices += r.end - r.first;
    }
    groom_status st = groom_strands_create(n, n_vertices, context, &job->out, diag);
    if (st != GROOM_OK) {
        memory_release(allocator, job->list, n, sizeof *job->list);
        return st;
    }
    for (uint32_t s = 0; s < n; s++) {
        struct remains r = remains_of(job, job->list[s]);
        job->out->first[s + 1] = job->out->first[s] + r.end - r.first;
    }
    parallel_for(context, (n + 255) / 256, capture_piece, job);
    return GROOM_OK;
}

groom_status sample_capture_create(const struct groom_sample_options *options, const struct groom *truth,
                                   const struct groom_context *context, struct groom_strands **capture,
                                   uint32_t **strand_of_capture, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = truth->n_strands;
    size_t n_points = (size_t)n * truth->n_vertices;
    struct capturing job = {.options = options, .truth = truth};
    struct ranked *ranked = memory_array(allocator, n, sizeof *ranked);
    groom_status st;

    job.points = memory_array(allocator, n_points, sizeof *job.points);
    job.missing = memory_array_zero(allocator, n, 1);
    job.cut = memory_array_zero(allocator, n, 1);
    if (!ranked || !job.points || !job.missing || !job.cut) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for a capture of %u strands", n);
        goto out;
    }
    if ((st = evaluate(&job, context, diag)) != GROOM_OK)
        goto out;
    lose_patches(&job, ranked);
    cut_inner(&job, ranked);
    if ((st = make_strands(&job, context, diag)) != GROOM_OK)
        goto out;
    *capture = job.out;
    *strand_of_capture = job.list;
out:
    memory_release(allocator, ranked, n, sizeof *ranked);
    memory_release(allocator, job.points, n_points, sizeof *job.points);
    memory_release(allocator, job.missing, n, 1);
    memory_release(allocator, job.cut, n, 1);
    return st;
}
