/* The strand container, and what is measured on it. */
#include "groom/strands.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/sort.h"

/* Strands a piece of a parallel loop: enough to be worth a hand-over, fixed so that results are. */
#define STRANDS_PER_PIECE 256

static uint32_t n_pieces(uint32_t n_strands)
{
    return n_strands / STRANDS_PER_PIECE + (n_strands % STRANDS_PER_PIECE != 0);
}

static uint32_t piece_begin(uint32_t piece) { return piece * STRANDS_PER_PIECE; }

static uint32_t piece_end(uint32_t piece, uint32_t n_strands)
{
    uint32_t begin = piece_begin(piece);
    return n_strands - begin < STRANDS_PER_PIECE ? n_strands : begin + STRANDS_PER_PIECE;
}

static uint32_t strand_vertices(const struct groom_strands *strands, uint32_t strand)
{
    return strands->first[strand + 1] - strands->first[strand];
}

static const float (*strand_points(const struct groom_strands *strands, uint32_t strand))[3]
{
    return (const float(*)[3])(strands->points + strands->first[strand]);
}

/* --- the container ------------------------------------------------------------ */

groom_status groom_strands_create(uint64_t n_strands, uint64_t n_vertices,
                                  const struct groom_context *context, struct groom_strands **out,
                                  struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_strands *strands;
    if (n_vertices > UINT32_MAX || n_strands >= UINT32_MAX)
        return groom_fail(diag, GROOM_ETOOBIG,
                          "%llu strands of %llu vertices; a container holds fewer than 2^32 of each",
                          (unsigned long long)n_strands, (unsigned long long)n_vertices);
    strands = memory_array_zero(allocator, 1, sizeof *strands);
    if (!strands)
        goto no_memory;
    strands->allocator = allocator;
    strands->n_strands = (uint32_t)n_strands;
    strands->n_vertices = (uint32_t)n_vertices;
    strands->first = memory_array(allocator, n_strands + 1, sizeof *strands->first);
    strands->points = memory_array(allocator, n_vertices, sizeof *strands->points);
    if (!strands->first || !strands->points)
        goto no_memory;
    strands->first[0] = 0;
    *out = strands;
    return GROOM_OK;

no_memory:
    groom_strands_destroy(strands);
    return groom_fail(diag, GROOM_ENOMEM, "no memory for %llu strands of %llu vertices",
                      (unsigned long long)n_strands, (unsigned long long)n_vertices);
}

void groom_strands_destroy(struct groom_strands *strands)
{
    if (!strands)
        return;
    const struct groom_allocator *allocator = strands->allocator;
    memory_release(allocator, strands->first, (size_t)strands->n_strands + 1, sizeof *strands->first);
    memory_release(allocator, strands->points, strands->n_vertices, sizeof *strands->points);
    memory_release(allocator, strands->root_uv, strands->n_strands, sizeof *strands->root_uv);
    memory_release(allocator, strands, 1, sizeof *strands);
}

/* --- arc length ----------------------------------------------------------------- */

static double segment_length(const float a[3], const float b[3])
{
    double x = (double)b[0] - a[0], y = (double)b[1] - a[1], z = (double)b[2] - a[2];
    return sqrt(x * x + y * y + z * z);
}

double groom_polyline_length(const float (*points)[3], uint32_t n)
{
    double length = 0;
    for (uint32_t i = 1; i < n; i++)
        length += segment_length(points[i - 1], points[i]);
    return length;
}

static void copy_point(float out[3], const float in[3]) { memcpy(out, in, 3 * sizeof *out); }

static void lerp_point(float out[3], const float a[3], const float b[3], double t)
{
    for (int k = 0; k < 3; k++)
        out[k] = (float)(a[k] + t * ((double)b[k] - a[k]));
}

/* Walk along the polyline once; vertex j stands at arc length j / (m - 1) of the whole. */
static void resample_strand(const float (*in)[3], uint32_t n, float (*out)[3], uint32_t m)
{
    double step = groom_polyline_length(in, n) / (m - 1);
    double begin = 0, length = segment_length(in[0], in[1]); /* of the present segment */
    uint32_t segment = 0;
    copy_point(out[0], in[0]);
    for (uint32_t j = 1; j + 1 < m; j++) {
        double at = j * step;
        while (at > begin + length && segment + 2 < n) {
            begin += length;
            segment++;
            length = segment_length(in[segment], in[segment + 1]);
        }
        double t = length > 0 ? (at - begin) / length : 0;
        lerp_point(out[j], in[segment], in[segment + 1], t < 1 ? t : 1);
    }
    copy_point(out[m - 1], in[n - 1]);
}

struct resample {
    const struct groom_strands *in;
    float (*out)[3];
    uint32_t n_vertices;
};

static void resample_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct resample *work = user;
    uint32_t end = piece_end(piece, work->in->n_strands);
    (void)thread;
    for (uint32_t i = piece_begin(piece); i < end; i++)
        resample_strand(strand_points(work->in, i), strand_vertices(work->in, i),
                        work->out + (size_t)i * work->n_vertices, work->n_vertices);
}

groom_status groom_strands_resample(const struct groom_strands *in, uint32_t n_vertices, float (*out)[3],
                                    const struct groom_context *context, struct groom_diag *diag)
{
    if (n_vertices < 2)
        return groom_fail(diag, GROOM_EINVAL, "%u vertices a strand asked for; 2 is the least", n_vertices);
    for (uint32_t i = 0; i < in->n_strands; i++)
        if (strand_vertices(in, i) < 2)
            return groom_fail(diag, GROOM_EINVAL, "strand %u has %u vertices; 2 is the least", i,
                              strand_vertices(in, i));
    struct resample work = {in, out, n_vertices};
    parallel_for(context, n_pieces(in->n_strands), resample_piece, &work);
    return GROOM_OK;
}

/* --- summary -------------------------------------------------------------------- */

struct box {
    float min[3], max[3];
};

static const struct box empty_box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void box_join(struct box *box, const float min[3], const float max[3])
{
    for (int k = 0; k < 3; k++) {
        box->min[k] = min[k] < box->min[k] ? min[k] : box->min[k];
        box->max[k] = max[k] > box->max[k] ? max[k] : box->max[k];
    }
}

/* Four points at a time, so that the compiler works on whole vectors. */
static void box_add(struct box *box, const float (*points)[3], size_t n)
{
    float min[4][3], max[4][3];
    size_t n_fours = n / 4;
    for (int i = 0; i < 4; i++) {
        memcpy(min[i], box->min, sizeof min[i]);
        memcpy(max[i], box->max, sizeof max[i]);
    }
    for (size_t four = 0; four < n_fours; four++)
        for (int i = 0; i < 12; i++) {
            float x = points[4 * four + (size_t)i / 3][i % 3];
            min[i / 3][i % 3] = x < min[i / 3][i % 3] ? x : min[i / 3][i % 3];
            max[i / 3][i % 3] = x > max[i / 3][i % 3] ? x : max[i / 3][i % 3];
        }
    for (int i = 0; i < 4; i++)
        box_join(box, min[i], max[i]);
    for (size_t i = 4 * n_fours; i < n; i++)
        box_join(box, points[i], points[i]);
}

struct measure {
    const struct groom_strands *strands;
    float *length;   /* [n_strands] */
    struct box *box; /* [n_pieces] */
};

static void measure_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct measure *work = user;
    uint32_t end = piece_end(piece, work->strands->n_strands);
    (void)thread;
    work->box[piece] = empty_box;
    for (uint32_t i = piece_begin(piece); i < end; i++) {
        const float (*points)[3] = strand_points(work->strands, i);
        uint32_t n = strand_vertices(work->strands, i);
        work->length[i] = (float)groom_polyline_length(points, n);
        box_add(&work->box[piece], points, n);
    }
}

static void summarize_lengths(float *length, uint32_t n, struct groom_strands_summary *summary)
{
    sort_floats(length, n);
    summary->length_min = length[0];
    summary->length_median = (length[(n - 1) / 2] + length[n / 2]) / 2;
    summary->length_max = length[n - 1];
}

static void summarize_boxes(const struct box *boxes, uint32_t n, struct groom_strands_summary *summary)
{
    struct box all = empty_box;
    for (uint32_t i = 0; i < n; i++)
        box_join(&all, boxes[i].min, boxes[i].max);
    for (int k = 0; k < 3; k++) { /* strands without a vertex have an empty box: a point at 0 */
        summary->bbox_min[k] = all.min[k] <= all.max[k] ? all.min[k] : 0;
        summary->bbox_max[k] = all.min[k] <= all.max[k] ? all.max[k] : 0;
    }
}

groom_status groom_strands_summarize(const struct groom_strands *strands, const struct groom_context *context,
                                     struct groom_strands_summary *summary, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = strands->n_strands;
    if (n == 0)
        return groom_fail(diag, GROOM_EEMPTY, "there are no strands to summarize");
    struct measure work = {strands, memory_array(allocator, n, sizeof *work.length),
                           memory_array(allocator, n_pieces(n), sizeof *work.box)};
    groom_status status = GROOM_OK;
    if (work.length && work.box) {
        parallel_for(context, n_pieces(n), measure_piece, &work);
        summary->n_strands = n;
        summary->n_vertices = strands->n_vertices;
        summarize_lengths(work.length, n, summary);
        summarize_boxes(work.box, n_pieces(n), summary);
    } else {
        status = groom_fail(diag, GROOM_ENOMEM, "no memory to measure %u strands", n);
    }
    memory_release(allocator, work.length, n, sizeof *work.length);
    memory_release(allocator, work.box, n_pieces(n), sizeof *work.box);
    return status;
}
