#include "fit/estimate.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "fit/draws.h"
#include "fit/smooth.h"
#include "groom/strands.h"

#define PI 3.14159265358979323846
#define LEAST_MEMBERS 4          /* of a cluster or a bundle that is asked */
#define SPECTRUM_STRANDS 1500    /* looked at for frequencies */
#define LEAST_FREQUENCY 10       /* per metre */
#define N_BINS 256               /* of the spectrum, evenly in the logarithm of the frequency */

static const float (*strand_of(const struct groom_fit *fit, uint32_t i))[3]
{
    return (const float (*)[3])(fit->target + (size_t)i * fit->m);
}

static double length_of(const struct groom_fit *fit, uint32_t i)
{
    return groom_polyline_length(strand_of(fit, i), fit->m) * fit->scale;
}

/* --- scale -------------------------------------------------------------------------- */

struct moments { double n, sum, square; };

static groom_status estimate_scale(const struct groom_fit *fit, const struct groom_allocator *allocator,
                                   struct estimates *estimates)
{
    uint32_t k = fit->n_guides, n = 0;
    struct moments *of = memory_array_zero(allocator, k, sizeof *of);
    double *spread = memory_array(allocator, k, sizeof *spread);
    groom_status st = of && spread ? GROOM_OK : GROOM_ENOMEM;
    for (uint32_t i = 0; st == GROOM_OK && i < fit->n; i++) {
        struct moments *m = &of[fit->cluster_of[i]];
        double length = length_of(fit, i);
        m->n++;
        m->sum += length;
        m->square += length * length;
    }
    for (uint32_t c = 0; st == GROOM_OK && c < k; c++) {
        double mean = of[c].sum / of[c].n, variance = (of[c].square - mean * of[c].sum) / (of[c].n - 1);
        if (of[c].n >= LEAST_MEMBERS && mean > 0)
            spread[n++] = sqrt(fmax(variance, 0)) / mean;
    }
    if (st == GROOM_OK)
        estimates->scale = median_of_doubles(spread, n) / DRAWS_DEVIATION;
    memory_release(allocator, of, k, sizeof *of);
    memory_release(allocator, spread, k, sizeof *spread);
    return st;
}

/* --- bend --------------------------------------------------------------------------- */

static double angle_of_ends(const float (*a)[3], const float (*b)[3], uint32_t m)
{
    uint32_t from = 2 * (m - 1) / 3;
    double ab = 0, aa = 0, bb = 0;
    for (int c = 0; c < 3; c++) {
        double x = (double)a[m - 1][c] - a[from][c], y = (double)b[m - 1][c] - b[from][c];
        ab += x * y;
        aa += x * x;
        bb += y * y;
    }
    double cosine = aa > 0 && bb > 0 ? ab / sqrt(aa * bb) : 1;
    return acos(fmin(fmax(cosine, -1), 1));
}

/* The angle grows from root to tip, so that the last third, on average, has turned by 5/6 of it. */
static groom_status estimate_bend(const struct groom_fit *fit, const struct groom_allocator *allocator,
                                  struct estimates *estimates)
{
    double *angle = memory_array(allocator, fit->n, sizeof *angle);
    if (!angle)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < fit->n; i++)
        angle[i] = angle_of_ends(strand_of(fit, i),
                                 (const float (*)[3])(fit->centroids + (size_t)fit->cluster_of[i] * fit->m), fit->m);
    estimates->bend_angle = median_of_doubles(angle, fit->n) * 6 / 5;
    memory_release(allocator, angle, fit->n, sizeof *angle);
    return GROOM_OK;
}

/* --- clump --------------------------------------------------------------------------- */

/* Mean square distance, over all clusters, of the strands' vertices j to their cluster's mean vertex. */
static double spread_at(const struct groom_fit *fit, uint32_t j, const uint32_t *members)
{
    double square = 0, n = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        uint32_t g = fit->cluster_of[i];
        const float *x = strand_of(fit, i)[j], *mean = fit->centroids[(size_t)g * fit->m + j];
        if (members[g] < LEAST_MEMBERS)
            continue;
        for (int c = 0; c < 3; c++)
            square += ((double)x[c] - mean[c]) * ((double)x[c] - mean[c]);
        n++;
    }
    return n > 0 ? square / n : 0;
}

/* The spread falls like exp(-a v): the slope of its logarithm, through 0 at the root. Waves of the
 * strands add to it and don't fall: they are taken off. */
static groom_status estimate_clump(const struct groom_fit *fit, const struct groom_allocator *allocator,
                                   struct estimates *estimates)
{
    double noise = estimates->wave_power / (fit->scale * fit->scale);
    uint32_t *members = memory_array_zero(allocator, fit->n_guides, sizeof *members);
    double product = 0, square = 0;
    if (!members)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < fit->n; i++)
        members[fit->cluster_of[i]]++;
    double at_root = spread_at(fit, 0, members);
    for (uint32_t step = 1; step <= 12; step++) {
        uint32_t j = step * (fit->m - 1) / 12;
        double v = (double)j / (fit->m - 1), spread = spread_at(fit, j, members) - noise;
        if (spread > 0 && at_root > 0) {
            product += v * 0.5 * log(spread / at_root);
            square += v * v;
        }
    }
    estimates->clump_profile = square > 0 ? fmax(-product / square, 0) : 0;
    memory_release(allocator, members, fit->n_guides, sizeof *members);
    return GROOM_OK;
}

/* --- curl and frizz -------------------------------------------------------------------- */

/* Frequencies per metre from 2 to 2000 on a head of ordinary size, in bins of equal ratio. */
static double bin_frequency(const struct groom_fit *fit, double bin) { return 2 * pow(1000, bin / N_BINS) / fit->ordinary; }
static double bin_of(const struct groom_fit *fit, double frequency)
{
    return N_BINS * log(frequency * fit->ordinary / 2) / log(1000);
}

/* Adds the power (square metres) of one strand's offset from its smoothed self at f turns a strand.
 * Below 3 turns a strand or 10 a metre it is the bow of hair around a head rather than a wave. */
static void add_spectrum(const struct groom_fit *fit, const float (*rough)[3], const float (*smooth)[3], double length,
                         double bins[N_BINS])
{
    uint32_t m = fit->m;
    for (uint32_t f = 3; f <= (m - 1) / 2; f++) {
        double power = 0;
        if (f / length * fit->ordinary < LEAST_FREQUENCY)
            continue;
        for (int c = 0; c < 3; c++) {
            double re = 0, im = 0, turn = 2 * PI * f / (m - 1), cosine = 1, sine = 0;
            for (uint32_t j = 0; j + 1 < m; j++) {
                double offset = ((double)rough[j][c] - smooth[j][c]) * fit->scale, next;
                re += cosine * offset;
                im += sine * offset;
                next = cosine * cos(turn) - sine * sin(turn);
                sine = sine * cos(turn) + cosine * sin(turn);
                cosine = next;
            }
            power += (re * re + im * im) * 2 / ((double)(m - 1) * (m - 1));
        }
        double bin = bin_of(fit, f / length);
        if (bin >= 0 && bin < N_BINS)
            bins[(int)bin] += power;
    }
}

static groom_status spectrum(const struct groom_fit *fit, const struct groom_context *context, double bins[N_BINS],
                             struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->n < SPECTRUM_STRANDS ? fit->n : SPECTRUM_STRANDS, n_used = 0;
    float (*smooth)[3] = memory_array(allocator, (size_t)n * fit->m, sizeof *smooth);
    groom_status st;
    if (!smooth)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to look at the frequencies of strands");
    for (uint32_t s = 0; s < n; s++)
        memcpy(smooth + (size_t)s * fit->m, strand_of(fit, (uint32_t)((uint64_t)s * fit->n / n)), fit->m * sizeof *smooth);
    st = smooth_polylines(smooth, n, fit->m, 1, 1, 80, context, diag);
    for (uint32_t s = 0; st == GROOM_OK && s < n; s++) {
        const float (*rough)[3] = strand_of(fit, (uint32_t)((uint64_t)s * fit->n / n));
        const float (*even)[3] = (const float (*)[3])(smooth + (size_t)s * fit->m);
        /* operators count turns along the strand before they deform it, which is the shorter way */
        double length = groom_polyline_length(even, fit->m) * fit->scale;
        if (length > 0) {
            add_spectrum(fit, rough, even, length, bins);
            n_used++;
        }
    }
    for (int b = 0; b < N_BINS; b++)
        bins[b] /= n_used ? n_used : 1;
    memory_release(allocator, smooth, (size_t)n * fit->m, sizeof *smooth);
    return st;
}

/* The band of a ratio of 1.5 with the most power, and its middle. */
static double strongest_band(const struct groom_fit *fit, const double bins[N_BINS], double *power)
{
    int width = (int)(N_BINS * log(1.5) / log(1000)), best = 0;
    double sum = 0, weighted = 0;
    *power = -1;
    for (int from = 0; from + width <= N_BINS; from++) {
        sum = 0;
        for (int b = from; b < from + width; b++)
            sum += bins[b];
        if (sum > *power) {
            *power = sum;
            best = from;
        }
    }
    for (int b = best; b < best + width; b++)
        weighted += bins[b] * (b + 0.5);
    return bin_frequency(fit, *power > 0 ? weighted / *power : best + 0.5 * width);
}

static groom_status estimate_waves(const struct groom_fit *fit, const struct groom_context *context,
                                   struct estimates *estimates, struct groom_diag *diag)
{
    double bins[N_BINS] = {0}, total = 0, mean = 0, band;
    groom_status st = spectrum(fit, context, bins, diag);
    if (st != GROOM_OK)
        return st;
    for (int b = 0; b < N_BINS; b++) {
        total += bins[b];
        mean += bins[b] * bin_frequency(fit, b + 0.5);
    }
    estimates->curl_frequency = strongest_band(fit, bins, &band);
    double share = total > 0 ? band / total : 0;
    /* frizz has under half of its power in its strongest band, a curl most of it */
    double curl = total * fmin(fmax((share - 0.45) / 0.3, 0), 1), noise = total - curl;
    estimates->curl_radius = sqrt(curl) / 0.83; /* the root mean square of 0.43 + 0.79 v */
    /* frizz moves strands by 0.10 of its amplitude, a part of it slower than what is counted here; the
     * mean of its spectrum is at 0.7 of its frequency */
    estimates->frizz_amplitude = sqrt(noise) / 0.08;
    estimates->frizz_frequency = noise > 0 ? fmax(mean - curl * estimates->curl_frequency, 0) / noise / 0.7 : 0;
    estimates->wave_power = total;
    return GROOM_OK;
}

groom_status estimate_operators(const struct groom_fit *fit, const struct groom_context *context,
                                struct estimates *estimates, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct estimates found = {0};
    groom_status st = estimate_scale(fit, allocator, &found);
    if (st == GROOM_OK)
        st = estimate_bend(fit, allocator, &found);
    if (st == GROOM_OK && (st = estimate_waves(fit, context, &found, diag)) != GROOM_OK)
        return st;
    if (st == GROOM_OK)
        st = estimate_clump(fit, allocator, &found);
    if (st != GROOM_OK)
        return groom_fail(diag, st, "no memory to estimate operators");
    *estimates = found;
    return GROOM_OK;
}

static float within(double value, const struct groom_operator_parameter *parameter)
{
    if (!(value > parameter->minimum))
        return parameter->minimum;
    return value < parameter->maximum ? (float)value : parameter->maximum;
}

static void set(struct groom_operator *op, uint32_t at, double value)
{
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(op->type, &n);
    op->parameter[at] = within(value, &parameters[at]);
}

void estimate_apply(const struct estimates *estimates, struct groom_operator *op)
{
    switch (op->type) {
    case GROOM_OPERATOR_SCALE: set(op, 0, fmin(estimates->scale, 0.5)); break;
    case GROOM_OPERATOR_BEND: set(op, 0, fmin(estimates->bend_angle, 1.5)); break;
    case GROOM_OPERATOR_CURL:
        set(op, 0, estimates->curl_radius);
        set(op, 1, estimates->curl_frequency);
        set(op, 2, 0.1 * estimates->curl_frequency);
        break;
    case GROOM_OPERATOR_CLUMP: set(op, 0, fmin(estimates->clump_profile, 10)); break;
    case GROOM_OPERATOR_FRIZZ:
        set(op, 0, estimates->frizz_frequency);
        set(op, 1, estimates->frizz_amplitude);
        break;
    default: break; /* layers are not fitted */
    }
}
