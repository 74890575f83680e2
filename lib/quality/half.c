#include "base/radix.h"
#include "quality/half.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "quality/loss_wasserstein.h"

#define UNIT 0.1              /* metres, of segments and spectra */
#define STREAM_SLICES 0x71750001u
#define STRANDS_PER_PIECE 256u

static uint32_t pieces_of(uint32_t n) { return n / STRANDS_PER_PIECE + (n % STRANDS_PER_PIECE != 0); }

/* --- curvature and torsion ------------------------------------------------------------------ */

static void difference(const float *a, const float *b, double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (double)b[c] - a[c];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static double norm(const double a[3]) { return sqrt(dot(a, a)); }

/* Turning angle over the mean length of the two segments; 0 where one has none. */
static double curvature_at(const double before[3], const double after[3])
{
    double turned[3], length = 0.5 * (norm(before) + norm(after));
    cross(before, after, turned);
    return length > 0 ? atan2(norm(turned), dot(before, after)) / length : 0;
}

/* Angle between the planes on either side of a segment, over its length; 0 where there is no plane. */
static double torsion_at(const double before[3], const double here[3], const double after[3])
{
    double first[3], second[3], length = norm(here);
    cross(before, here, first);
    cross(here, after, second);
    double sine = length * dot(before, second), cosine = dot(first, second);
    return length > 0 && (sine != 0 || cosine != 0) ? atan2(sine, cosine) / length : 0;
}

/* Vertex j of m_bend of strand i: between two of its m, where these are more. */
static void bend_vertex(const struct quality_half *half, uint32_t i, uint32_t j, float out[3])
{
    uint32_t m = half->set.m;
    double at = (double)j * (m - 1) / (half->m_bend - 1);
    uint32_t k = at < m - 2 ? (uint32_t)at : m - 2;
    const float *a = half->set.points[(size_t)i * m + k], *b = a + 3;
    for (int c = 0; c < 3; c++)
        out[c] = at - k == 0 ? a[c] : (float)((double)a[c] + (at - k) * ((double)b[c] - a[c]));
}

static void bend_segment(const struct quality_half *half, uint32_t i, uint32_t j, double out[3])
{
    float a[3], b[3];
    bend_vertex(half, i, j, a);
    bend_vertex(half, i, j + 1, b);
    difference(a, b, out);
}

static void measure_strand(struct quality_half *half, uint32_t i)
{
    uint32_t m = half->m_bend;
    double segment[3][3];
    half->length[i] = (float)(half->set.start[i + 1] - half->set.start[i]);
    bend_segment(half, i, 0, segment[1]);
    bend_segment(half, i, 1, segment[2]);
    for (uint32_t j = 1; j + 1 < m; j++) {
        half->curvature[(size_t)i * (m - 2) + j - 1] = (float)curvature_at(segment[1], segment[2]);
        if (j + 2 == m)
            break;
        memcpy(segment[0], segment[1], sizeof segment[0]);
        memcpy(segment[1], segment[2], sizeof segment[1]);
        bend_segment(half, i, j + 1, segment[2]);
        half->torsion[(size_t)i * (m - 3) + j - 1] = (float)torsion_at(segment[0], segment[1], segment[2]);
    }
}

static void measure_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct quality_half *half = user;
    uint32_t first = piece * STRANDS_PER_PIECE;
    (void)thread;
    for (uint32_t i = first; i < half->set.n && i < first + STRANDS_PER_PIECE; i++)
        measure_strand(half, i);
}

groom_status quality_half_init(struct quality_half *half, const struct quality_set *from, const uint32_t *strand, uint32_t n,
                               uint32_t m_bend, const struct groom_context *context, struct groom_diag *diag)
{
    float *spare;
    memset(half, 0, sizeof *half);
    groom_status st = quality_set_select(&half->set, from, strand, n, context, diag);
    if (st != GROOM_OK)
        return st;
    const struct groom_allocator *allocator = half->set.allocator;
    half->m_bend = m_bend;
    half->n_curvatures = n * (m_bend - 2);
    half->n_torsions = n * (m_bend - 3);
    half->curvature = memory_array(allocator, half->n_curvatures, sizeof *half->curvature);
    half->torsion = memory_array(allocator, half->n_torsions, sizeof *half->torsion);
    half->length = memory_array(allocator, n, sizeof *half->length);
    spare = memory_array(allocator, half->n_curvatures, sizeof *spare);
    if (half->curvature && half->torsion && half->length && spare) {
        parallel_for(context, pieces_of(n), measure_piece, half);
        radix_sort_floats(half->curvature, spare, half->n_curvatures);
        radix_sort_floats(half->torsion, spare, half->n_torsions);
        radix_sort_floats(half->length, spare, n);
    } else {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to measure %u strands", n);
    }
    memory_release(allocator, spare, half->n_curvatures, sizeof *spare);
    return st;
}

void quality_half_finish(struct quality_half *half)
{
    const struct groom_allocator *allocator = half->set.allocator;
    if (!allocator)
        return;
    memory_release(allocator, half->curvature, half->n_curvatures, sizeof *half->curvature);
    memory_release(allocator, half->torsion, half->n_torsions, sizeof *half->torsion);
    memory_release(allocator, half->length, half->set.n, sizeof *half->length);
    quality_set_finish(&half->set);
}

/* --- distances -------------------------------------------------------------------------------- */

/* Wasserstein-1 of two sorted samples of one size: the mean distance of equal ranks. */
static double distance_of_ranks(const float *a, const float *b, uint32_t n)
{
    double sum = 0;
    for (uint32_t i = 0; i < n; i++)
        sum += fabs((double)a[i] - b[i]);
    return n ? sum / n : 0;
}

groom_status quality_half_compare(const struct quality_half *a, const struct quality_half *b, uint64_t seed,
                                  const struct groom_context *context, struct half_distances *distances,
                                  struct groom_diag *diag)
{
    struct groom_random_key key = {seed, STREAM_SLICES};
    struct loss_shape shape;
    groom_status st = loss_shape((const float (*)[3])a->set.points, (const float (*)[3])b->set.points, a->set.n, a->set.m,
                                 UNIT, 0, key, context, &shape, diag);
    if (st != GROOM_OK)
        return st;
    distances->spectra = sqrt(shape.spectra);
    distances->segments = sqrt(shape.segments);
    distances->curvature = distance_of_ranks(a->curvature, b->curvature, a->n_curvatures);
    distances->torsion = distance_of_ranks(a->torsion, b->torsion, a->n_torsions);
    distances->length = distance_of_ranks(a->length, b->length, a->set.n);
    return GROOM_OK;
}

/* --- histograms --------------------------------------------------------------------------------- */

static double quantile(const float *sorted, uint32_t n, double q) { return sorted[(uint32_t)(q * (n - 1) + 0.5)]; }

static void set_range(struct groom_quality_histogram *histogram, double low, double high)
{
    histogram->low = low;
    histogram->high = high > low ? high : low + 1;
}

void quality_half_ranges(const struct quality_half *half, struct groom_quality *quality)
{
    double twist = fmax(fabs(quantile(half->torsion, half->n_torsions, 0.05)),
                        fabs(quantile(half->torsion, half->n_torsions, 0.95)));
    set_range(&quality->curvatures, 0, 1.2 * quantile(half->curvature, half->n_curvatures, 0.98));
    set_range(&quality->torsions, -twist, twist);
    set_range(&quality->lengths, 0, 1.2 * quantile(half->length, half->set.n, 0.99));
}

static void count_values(const float *values, uint32_t n, double share, double *bins,
                         const struct groom_quality_histogram *histogram)
{
    for (uint32_t i = 0; i < n; i++) {
        double at = (values[i] - histogram->low) / (histogram->high - histogram->low) * GROOM_QUALITY_BINS;
        if (at >= 0 && at <= GROOM_QUALITY_BINS)
            bins[at < GROOM_QUALITY_BINS ? (int)at : GROOM_QUALITY_BINS - 1] += share / n;
    }
}

static double *bins_of(struct groom_quality_histogram *histogram, int of_groom)
{
    return of_groom ? histogram->groom : histogram->target;
}

void quality_half_count(const struct quality_half *half, double share, int of_groom, struct groom_quality *quality)
{
    struct groom_quality_histogram *c = &quality->curvatures, *t = &quality->torsions, *l = &quality->lengths;
    count_values(half->curvature, half->n_curvatures, share, bins_of(c, of_groom), c);
    count_values(half->torsion, half->n_torsions, share, bins_of(t, of_groom), t);
    count_values(half->length, half->set.n, share, bins_of(l, of_groom), l);
}
