#include "fit/moments.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "fit/correlation.h"
#include "fit/dense.h"
#include "model/kernel.h"

#define PI 3.14159265358979323846
#define PAIRS_PER_PIECE 16
#define N_FREQ MOMENTS_FREQUENCIES
#define LEAST_TURNS 1.5         /* of a strand, at the lowest frequency */
#define MOST_TURNS 40.0         /* at the highest */
#define LEAST_LOCAL_TURNS 4.5   /* of a strand, in a third */
#define FIRST_PHASE_WINDOW 2    /* the second on: curls often set in later than at the root */
#define LEAST_PHASE_TURNS 3.0   /* of a strand, in the windows of phases */
#define NYQUIST_SHARE 0.45      /* of a turn a segment */
#define POWER_FLOOR 1e-5        /* of squared segments: a wobble of 3e-3 rad; rounding is far below it */
#define DISTANCE_FLOOR 1e-8     /* of squared lengths */
#define SHRINKAGE 0.1           /* of correlations */

#define FEWEST_TELL 8           /* pairs; a statistic that fewer have is left out, */
#define LEAST_SHARE 0.02        /* or of which fewer than this share: one pair does not scatter at all, which is no certainty */

/* Times the floor, for statistics that lean on */
#define BASE_FLOOR 5.0    /* base strands: what these do not share with their neighbours is smoothed away, and they are a few per
                           * cent too close; */
#define GUIDE_FLOOR 10.0  /* base strands and operator guides: they only keep clumps from where nothing else speaks; */
#define BORDER_FLOOR 30.0 /* which strands are of two bundles: one that was given to the wrong one is as far from its neighbour as
                           * a clump is wide, or as near */

/* --- the plan ------------------------------------------------------------------------ */

static double squared(const float a[3], const float b[3])
{
    double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
    return x * x + y * y + z * z;
}

/* Through a dozen of its vertices, so that waves count little. */
static double coarse_length(const float (*points)[3], uint32_t m)
{
    double sum = 0;
    uint32_t n = m - 1 < 12 ? m - 1 : 12, last = 0;
    for (uint32_t s = 1; s <= n; s++) {
        uint32_t j = (uint32_t)((uint64_t)s * (m - 1) / n);
        sum += sqrt(squared(points[j], points[last]));
        last = j;
    }
    return sum;
}

static double full_length(const float (*points)[3], uint32_t m)
{
    double sum = 0;
    for (uint32_t j = 1; j < m; j++)
        sum += sqrt(squared(points[j], points[j - 1]));
    return sum;
}

static uint32_t place(uint32_t p, uint32_t m) { return (uint32_t)((uint64_t)(p + 1) * (m - 1) / MOMENTS_PLACES); }

groom_status moments_plan_init(struct moments_plan *plan, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = plan->n_pairs, m = plan->m, middle = m / 2;
    double *values = memory_array(allocator, 2 * (size_t)n, sizeof *values);
    if (!values)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to compare %u pairs of strands", n);
    for (uint32_t i = 0; i < 2 * n; i++)
        values[i] = full_length(plan->base + (size_t)i * m, m);
    double length = fmax(median_of_doubles(values, 2 * n), 1e-9);
    for (uint32_t i = 0; i < n; i++)
        values[i] = squared(plan->base[(size_t)i * m], plan->base[(size_t)(n + i) * m]);
    plan->apart = fmax(median_of_doubles(values, n), DISTANCE_FLOOR * length * length);
    for (uint32_t i = 0; i < 2 * n; i++)
        values[i] = squared(plan->base[(size_t)i * m + middle], plan->guide[(size_t)i * m + middle]);
    plan->off_guide = fmax(median_of_doubles(values, 2 * n), DISTANCE_FLOOR * length * length);
    for (int q = 0; q < N_FREQ; q++)
        plan->frequency[q] = LEAST_TURNS / length * pow(MOST_TURNS / LEAST_TURNS, (double)q / (N_FREQ - 1));
    memset(plan->level, 0, sizeof plan->level);
    plan->centroid = plan->phase = 0;
    plan->peak = N_FREQ / 2;
    memory_release(allocator, values, 2 * (size_t)n, sizeof *values);
    return GROOM_OK;
}

/* --- spectra ---------------------------------------------------------------------------- */

/* Transforms of a strand's segments: over the whole, then over each third. Thirds are there where somebody asks: at every
 * other frequency, and at the peak. */
struct spectrum { float re[1 + MOMENTS_WINDOWS][3][N_FREQ], im[1 + MOMENTS_WINDOWS][3][N_FREQ]; };

/* Hann's window from `from` to `to`; 0 outside. */
static float hann(double at, double from, double to)
{
    return at <= from || at >= to ? 0 : (float)(0.5 - 0.5 * cos(2 * PI * (at - from) / (to - from)));
}

struct windows {
    float weight[1 + MOMENTS_WINDOWS][MOMENTS_MOST_VERTICES]; /* of each segment */
    uint32_t first[1 + MOMENTS_WINDOWS], end[1 + MOMENTS_WINDOWS]; /* segments that have any */
};

static void make_windows(uint32_t m, struct windows *windows)
{
    for (int w = 0; w < 1 + MOMENTS_WINDOWS; w++) {
        double from = w == 0 ? 0 : (w - 1) / 6.0, to = w == 0 ? 1 : from + 1 / 3.0;
        float *weight = windows->weight[w];
        for (uint32_t j = 0; j + 1 < m; j++)
            weight[j] = hann((j + 0.5) / (m - 1), from, to);
        windows->first[w] = 0;
        windows->end[w] = m - 1;
        while (windows->first[w] < windows->end[w] && weight[windows->first[w]] == 0)
            windows->first[w]++;
        while (windows->end[w] > windows->first[w] && weight[windows->end[w] - 1] == 0)
            windows->end[w]--;
    }
}

/* Frequencies side by side: the compiler's own vector type, element by element, as wide as a register. */
#define SIDE_BY_SIDE 8
#define GROUPS (N_FREQ / SIDE_BY_SIDE)
typedef float waves __attribute__((vector_size(sizeof(float) * SIDE_BY_SIDE)));

/* In which group a frequency is, and where: those that thirds are asked about together. */
static int group_of(int q) { return (q + 1) % GROUPS; }
static int lane_of(int q) { return q / GROUPS; }

/* The waves at a group's frequencies at each segment, which both strands of a pair are compared with. */
struct wave_table { waves cosine[MOMENTS_MOST_VERTICES], sine[MOMENTS_MOST_VERTICES]; };

LANES_INLINE void make_waves(uint32_t m, const double turns[N_FREQ], int group, struct wave_table *table)
{
    waves cosine = {0}, sine = {0}, step_cosine = {0}, step_sine = {0};
    for (int q = 0; q < N_FREQ; q++)
        if (group_of(q) == group) {
            cosine[lane_of(q)] = 1;
            step_cosine[lane_of(q)] = (float)cos(2 * PI * turns[q]);
            step_sine[lane_of(q)] = (float)sin(2 * PI * turns[q]);
        }
    for (uint32_t j = 0; j + 1 < m; j++) {
        table->cosine[j] = cosine;
        table->sine[j] = sine;
        waves next = cosine * step_cosine - sine * step_sine;
        sine = sine * step_cosine + cosine * step_sine;
        cosine = next;
    }
}

/* Over one window. */
LANES_INLINE void add_window(const struct windows *windows, int w, const float (*points)[3], const struct wave_table *table,
                             waves re[3], waves im[3])
{
    const float *weight = windows->weight[w];
    waves rx = {0}, ry = {0}, rz = {0}, ix = {0}, iy = {0}, iz = {0};
    for (uint32_t j = windows->first[w]; j < windows->end[w]; j++) {
        float x = weight[j] * (points[j + 1][0] - points[j][0]), y = weight[j] * (points[j + 1][1] - points[j][1]);
        float z = weight[j] * (points[j + 1][2] - points[j][2]);
        waves cosine = table->cosine[j], sine = table->sine[j];
        rx += cosine * x, ry += cosine * y, rz += cosine * z;
        ix += sine * x, iy += sine * y, iz += sine * z;
    }
    re[0] = rx, re[1] = ry, re[2] = rz;
    im[0] = ix, im[1] = iy, im[2] = iz;
}

LANES_INLINE void transform_body(const struct windows *windows, const float (*points)[3], const struct wave_table *table,
                                 int group, int n_windows, struct spectrum *spectrum)
{
    for (int w = 0; w < n_windows; w++) {
        waves re[3], im[3];
        add_window(windows, w, points, table, re, im);
        for (int c = 0; c < 3; c++)
            for (int q = 0; q < N_FREQ; q++)
                if (group_of(q) == group) {
                    spectrum->re[w][c][q] = re[c][lane_of(q)];
                    spectrum->im[w][c][q] = im[c][lane_of(q)];
                }
    }
}

struct pair_points { const float (*a)[3], (*b)[3]; };

LANES_INLINE void transform_pair_body(const struct windows *windows, struct pair_points pair, uint32_t m, uint32_t peak,
                                      const double turns[N_FREQ], struct spectrum *of_a, struct spectrum *of_b)
{
    struct wave_table table;
    for (int group = 0; group < GROUPS; group++) {
        int n_windows = group == group_of(1) || group == group_of((int)peak) ? 1 + MOMENTS_WINDOWS : 1;
        make_waves(m, turns, group, &table);
        transform_body(windows, pair.a, &table, group, n_windows, of_a);
        transform_body(windows, pair.b, &table, group, n_windows, of_b);
    }
}

static void transform_pair_baseline(const struct windows *windows, struct pair_points pair, uint32_t m, uint32_t peak,
                                    const double turns[N_FREQ], struct spectrum *of_a, struct spectrum *of_b)
{
    transform_pair_body(windows, pair, m, peak, turns, of_a, of_b);
}

#if defined(__x86_64__)
KERNEL_TARGET_AVX2 static void transform_pair_avx2(const struct windows *windows, struct pair_points pair, uint32_t m,
                                                   uint32_t peak, const double turns[N_FREQ], struct spectrum *of_a,
                                                   struct spectrum *of_b)
{
    transform_pair_body(windows, pair, m, peak, turns, of_a, of_b);
}
#endif

/* The same bits in all variants: a frequency a lane, and no multiply-adds in one. */
static void transform_pair(const struct windows *windows, struct pair_points pair, uint32_t m, uint32_t peak,
                           const double turns[N_FREQ], struct spectrum *of_a, struct spectrum *of_b)
{
#if defined(__x86_64__)
    if (kernel_best_variant() == KERNEL_AVX2) {
        transform_pair_avx2(windows, pair, m, peak, turns, of_a, of_b);
        return;
    }
#endif
    transform_pair_baseline(windows, pair, m, peak, turns, of_a, of_b);
}

/* Power in window w at frequency q over that of a straight strand of the same length. */
static double power(const struct spectrum *a, const struct spectrum *b, int w, int q, double straight)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        double re = (double)a->re[w][c][q] - (b ? b->re[w][c][q] : 0), im = (double)a->im[w][c][q] - (b ? b->im[w][c][q] : 0);
        sum += re * re + im * im;
    }
    return sum / (straight * straight);
}

/* The mean logarithm of the frequency, weighed by power. */
static double centroid_of(const struct moments_plan *plan, const struct spectrum *s, const int use[N_FREQ])
{
    double sum = 0, all = 0;
    for (int q = 3; q < N_FREQ; q++) {
        if (!use[q])
            continue;
        double p = power(s, NULL, 0, q, 1);
        sum += p * log(plan->frequency[q] / plan->frequency[0]);
        all += p;
    }
    return all > 0 ? sum / all : 0;
}

/* By how many turns the wave at the plan's peak is ahead from window to window, towards the tip. */
static double phase_of(const struct moments_plan *plan, const struct spectrum *s)
{
    double re = 0, im = 0;
    uint32_t q = plan->peak;
    for (int w = FIRST_PHASE_WINDOW; w < MOMENTS_WINDOWS; w++)
        for (int c = 0; c < 3; c++) {
            double x = (double)s->re[w][c][q], y = (double)s->im[w][c][q];
            double u = (double)s->re[w + 1][c][q], v = (double)s->im[w + 1][c][q];
            re += x * u + y * v;
            im += x * v - y * u;
        }
    return atan2(im, re) / (2 * PI);
}

/* Between -1/2 and 1/2 turn. */
static double turn_between(double a, double b) { return a - b - floor(a - b + 0.5); }

static void measure_phases(const struct moments_plan *plan, const struct spectrum *of_a, const struct spectrum *of_b,
                           float *out)
{
    double a = turn_between(phase_of(plan, of_a), plan->phase), b = turn_between(phase_of(plan, of_b), plan->phase);
    out[MOMENTS_PHASE] = (float)(plan->phase + 0.5 * (a + b));
    out[MOMENTS_PHASE + 1] = (float)(0.5 * (fabs(a) + fabs(b)));
    out[MOMENTS_PHASE + 2] = (float)fabs(turn_between(a, b));
}

/* Segments of both strands of a pair at the same turns a segment, so that their difference means something. */
static void measure_spectra(const struct moments_plan *plan, const struct windows *windows, const float (*a)[3],
                            const float (*b)[3], double length, float *out)
{
    struct spectrum of_a, of_b;
    uint32_t m = plan->m;
    double turns[N_FREQ], straight = length / 2, third = length / 6;
    int use[N_FREQ];
    for (int q = 0; q < N_FREQ; q++) {
        double f = plan->frequency[q] * length;
        turns[q] = f / (m - 1);
        use[q] = f >= LEAST_TURNS && turns[q] <= NYQUIST_SHARE;
    }
    transform_pair(windows, (struct pair_points){a, b}, m, plan->peak, turns, &of_a, &of_b);
    for (int q = 0; q < N_FREQ; q++) {
        if (!use[q])
            continue;
        double log_a = log(power(&of_a, NULL, 0, q, straight) + POWER_FLOOR);
        double log_b = log(power(&of_b, NULL, 0, q, straight) + POWER_FLOOR);
        out[MOMENTS_SPECTRUM + q] = (float)(0.5 * (log_a + log_b));
        out[MOMENTS_SPREAD + q] = (float)(0.5 * (fabs(log_a - plan->level[q]) + fabs(log_b - plan->level[q])));
        out[MOMENTS_COHERENCE + q] = (float)log(power(&of_a, &of_b, 0, q, straight) + POWER_FLOOR);
    }
    for (int w = 0; w < MOMENTS_WINDOWS; w++)
        for (int k = 0; k < MOMENTS_COARSE; k++) {
            int q = 2 * k + 1, at = w * MOMENTS_COARSE + k;
            if (!use[q] || turns[q] * (m - 1) < LEAST_LOCAL_TURNS)
                continue;
            out[MOMENTS_LOCAL + at] = (float)(0.5 * (log(power(&of_a, NULL, 1 + w, q, third) + POWER_FLOOR) +
                                                     log(power(&of_b, NULL, 1 + w, q, third) + POWER_FLOOR)));
            out[MOMENTS_LOCAL_COHERENCE + at] = (float)log(power(&of_a, &of_b, 1 + w, q, third) + POWER_FLOOR);
        }
    if (use[plan->peak] && turns[plan->peak] * (m - 1) >= LEAST_PHASE_TURNS)
        measure_phases(plan, &of_a, &of_b, out);
    double f_a = centroid_of(plan, &of_a, use), f_b = centroid_of(plan, &of_b, use);
    out[MOMENTS_CENTROID] = (float)(0.5 * (f_a + f_b));
    out[MOMENTS_CENTROID + 1] = (float)(0.5 * (fabs(f_a - plan->centroid) + fabs(f_b - plan->centroid)));
    out[MOMENTS_CENTROID + 2] = (float)fabs(f_a - f_b);
}

/* --- lengths and distances ------------------------------------------------------------------- */

static void measure_lengths(const float (*a)[3], const float (*b)[3], const float (*base_a)[3],
                            const float (*base_b)[3], uint32_t m, float *out)
{
    double least = 1e-9;
    double coarse_a = log(fmax(coarse_length(a, m), least)), coarse_b = log(fmax(coarse_length(b, m), least));
    double full_a = log(fmax(full_length(a, m), least)), full_b = log(fmax(full_length(b, m), least));
    double coarse = log(fmax(coarse_length(base_a, m), least)) + log(fmax(coarse_length(base_b, m), least));
    double full = log(fmax(full_length(base_a, m), least)) + log(fmax(full_length(base_b, m), least));
    out[MOMENTS_LENGTH] = (float)(0.5 * (coarse_a + coarse_b - coarse));
    out[MOMENTS_LENGTH + 1] = (float)fabs(coarse_a - coarse_b);
    out[MOMENTS_LENGTH + 2] = (float)(0.5 * (full_a + full_b - full));
    out[MOMENTS_LENGTH + 3] = (float)fabs(full_a - full_b);
}

/* How much of the distance from q to p is left of that from base_q to base_p: falls under a clump. `scale` keeps it small where those are close. */
static double share_left(const float p[3], const float q[3], const float base_p[3], const float base_q[3], double scale)
{
    double dot = 0, square = 0;
    for (int c = 0; c < 3; c++) {
        double base = (double)base_p[c] - base_q[c];
        dot += ((double)p[c] - q[c]) * base;
        square += base * base;
    }
    return dot / (square + scale);
}

/* How differently two strands have gone from their roots: as a part of the way, and off it. */
static void measure_stretch(const struct moments_plan *plan, uint32_t pair, const float (*points)[3], double length,
                            float *out)
{
    uint32_t m = plan->m;
    size_t first_a = (size_t)pair * m, first_b = (size_t)(plan->n_pairs + pair) * m;
    for (uint32_t p = 0; p < MOMENTS_PLACES; p++) {
        size_t a = first_a + place(p, m), b = first_b + place(p, m);
        double way[3], apart[3], dot = 0, square = 1e-6 * length * length, aside = DISTANCE_FLOOR * length * length;
        for (int c = 0; c < 3; c++) {
            double x = (double)points[a][c] - points[first_a][c], y = (double)points[b][c] - points[first_b][c];
            way[c] = 0.5 * (x + y);
            apart[c] = x - y;
            dot += way[c] * apart[c];
            square += way[c] * way[c];
        }
        for (int c = 0; c < 3; c++)
            aside += pow(apart[c] - dot / square * way[c], 2);
        out[MOMENTS_STRETCH + p] = (float)fmin(fabs(dot / square), 2);
        out[MOMENTS_ASIDE + p] = (float)log(aside);
    }
}

static void measure_distances(const struct moments_plan *plan, uint32_t pair, const float (*points)[3], double length,
                              float *out)
{
    uint32_t m = plan->m;
    size_t first_a = (size_t)pair * m, first_b = (size_t)(plan->n_pairs + pair) * m;
    double floor = DISTANCE_FLOOR * length * length;
    int distance = plan->bundle[pair] == plan->bundle[plan->n_pairs + pair] ? MOMENTS_DISTANCE : MOMENTS_BORDER;
    for (uint32_t p = 0; p < MOMENTS_PLACES; p++) {
        size_t a = first_a + place(p, m), b = first_b + place(p, m);
        const float *x = points[a], *y = points[b], *g = plan->guide[a], *h = plan->guide[b];
        out[distance + p] = (float)log(squared(x, y) + floor);
        out[MOMENTS_ALONG + p] = (float)share_left(x, y, points[first_a], points[first_b], plan->apart);
        out[MOMENTS_GUIDE_DISTANCE + p] = (float)(0.5 * (log(squared(x, g) + floor) + log(squared(y, h) + floor)));
        out[MOMENTS_GUIDE_ALONG + p] = (float)(0.5 * (share_left(x, g, plan->base[a], g, plan->off_guide) +
                                                      share_left(y, h, plan->base[b], h, plan->off_guide)));
    }
}

/* --- all -------------------------------------------------------------------------------------- */

struct measuring {
    const struct moments_plan *plan;
    const float (*points)[3];
    float *values;
};

static void measure_pair(const struct measuring *job, const struct windows *windows, uint32_t pair)
{
    const struct moments_plan *plan = job->plan;
    uint32_t m = plan->m;
    size_t a = (size_t)pair * m, b = (size_t)(plan->n_pairs + pair) * m;
    float *out = job->values + (size_t)pair * MOMENTS_COUNT;
    double length = full_length(plan->base + a, m);
    for (int f = 0; f < MOMENTS_COUNT; f++)
        out[f] = NAN;
    if (!(length > 0))
        return;
    measure_spectra(plan, windows, job->points + a, job->points + b, length, out);
    measure_lengths(job->points + a, job->points + b, plan->base + a, plan->base + b, m, out);
    measure_stretch(plan, pair, job->points, length, out);
    measure_distances(plan, pair, job->points, length, out);
}

static void measure_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct measuring *job = user;
    struct windows windows = {0};
    (void)thread;
    make_windows(job->plan->m, &windows);
    for (uint32_t i = piece * PAIRS_PER_PIECE; i < job->plan->n_pairs && i < (piece + 1) * PAIRS_PER_PIECE; i++)
        measure_pair(job, &windows, i);
}

void moments_measure(const struct moments_plan *plan, const float (*points)[3], float *values,
                     const struct groom_context *context)
{
    struct measuring job = {plan, points, values};
    parallel_for(context, plan->n_pairs / PAIRS_PER_PIECE + 1, measure_piece, &job);
}

void moments_mean(const float *values, uint32_t n_pairs, double mean[MOMENTS_COUNT])
{
    uint32_t n[MOMENTS_COUNT] = {0};
    for (int f = 0; f < MOMENTS_COUNT; f++)
        mean[f] = 0;
    for (uint32_t i = 0; i < n_pairs; i++)
        for (int f = 0; f < MOMENTS_COUNT; f++) {
            float value = values[(size_t)i * MOMENTS_COUNT + f];
            if (!isnan(value)) {
                mean[f] += value;
                n[f]++;
            }
        }
    for (int f = 0; f < MOMENTS_COUNT; f++)
        mean[f] = n[f] > 0 ? mean[f] / n[f] : 0;
}

/* --- covariance ----------------------------------------------------------------------------------- */

_Static_assert(MOMENTS_COUNT % CORRELATION_ROWS == 0 && MOMENTS_COUNT >= CORRELATION_COLUMNS && MOMENTS_COUNT <= CORRELATION_MOST,
               "statistics are correlated some at a time");

static int is_deviation(int f)
{
    return f == MOMENTS_CENTROID + 1 || f == MOMENTS_CENTROID + 2 || f == MOMENTS_PHASE + 1 || f == MOMENTS_PHASE + 2 || f == MOMENTS_LENGTH + 1 || f == MOMENTS_LENGTH + 3 ||
           (f >= MOMENTS_STRETCH && f < MOMENTS_ASIDE);
}

static double leaning(int f)
{
    if (f >= MOMENTS_GUIDE_DISTANCE || f == MOMENTS_LENGTH || f == MOMENTS_LENGTH + 2)
        return GUIDE_FLOOR;
    if (f >= MOMENTS_BORDER && f < MOMENTS_STRETCH)
        return BORDER_FLOOR;
    return f >= MOMENTS_DISTANCE && f < MOMENTS_BORDER ? BASE_FLOOR : 1;
}

/* Variances of the means from sums over bundles; values become deviations of standard size. */
static void standardize(float *values, uint32_t n_pairs, const uint32_t *bundle, uint32_t n_bundles,
                        const double mean[MOMENTS_COUNT], double *sums, double variance[MOMENTS_COUNT])
{
    for (int f = 0; f < MOMENTS_COUNT; f++) {
        double square = 0, of_bundles = 0;
        uint32_t n = 0;
        memset(sums, 0, n_bundles * sizeof *sums);
        for (uint32_t i = 0; i < n_pairs; i++) {
            float *value = &values[(size_t)i * MOMENTS_COUNT + f];
            n += !isnan(*value);
            *value = isnan(*value) ? 0 : (float)(*value - mean[f]);
            square += (double)*value * *value;
            sums[bundle[i]] += *value;
        }
        for (uint32_t b = 0; b < n_bundles; b++)
            of_bundles += sums[b] * sums[b];
        variance[f] = n >= FEWEST_TELL && n >= LEAST_SHARE * n_pairs ? fmax(of_bundles, square) / ((double)n * n) : 1e6;
        float scale = square > 0 ? (float)(1 / sqrt(square)) : 0;
        for (uint32_t i = 0; i < n_pairs; i++)
            values[(size_t)i * MOMENTS_COUNT + f] *= scale;
    }
}

groom_status moments_covariance(float *values, uint32_t n_pairs, const uint32_t *bundle, uint32_t n_bundles,
                                const double size[MOMENTS_COUNT], double floor, double *cholesky,
                                const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    int n = MOMENTS_COUNT;
    double mean[MOMENTS_COUNT], variance[MOMENTS_COUNT];
    double *sums = memory_array(allocator, n_bundles, sizeof *sums);
    float *correlation = memory_array(allocator, (size_t)n * (size_t)n, sizeof *correlation);
    groom_status st = GROOM_OK;
    if (!sums || !correlation) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the covariance of %d statistics", n);
        goto out;
    }
    moments_mean(values, n_pairs, mean);
    standardize(values, n_pairs, bundle, n_bundles, mean, sums, variance);
    correlation_of(values, n_pairs, MOMENTS_COUNT, correlation, context);
    for (int f = 0; f < n; f++)
        for (int g = 0; g <= f; g++) {
            double *c = &cholesky[(size_t)f * (size_t)n + (size_t)g];
            *c = (1 - SHRINKAGE) * (double)correlation[(size_t)f * (size_t)n + (size_t)g] * sqrt(variance[f] * variance[g]);
            if (f == g)
                *c = variance[f] + pow(floor * leaning(f) * (is_deviation(f) ? size[f] : 1), 2) + 1e-12;
        }
    if (!dense_cholesky(cholesky, (uint32_t)n))
        st = groom_fail(diag, GROOM_EINTERNAL, "the covariance of the strands' statistics is not positive definite");
out:
    memory_release(allocator, sums, n_bundles, sizeof *sums);
    memory_release(allocator, correlation, (size_t)n * (size_t)n, sizeof *correlation);
    return st;
}
