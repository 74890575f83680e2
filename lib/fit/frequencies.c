#include "fit/frequencies.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "fit/draws.h"
#include "fit/spread.h"
#include "groom/strands.h"

enum { FREQUENCY = 1, RANDOM_FREQUENCY }; /* of a curl's parameters */

#define LEAST_GUIDES 12         /* that tell a law */
#define LEAST_STRANDS 2         /* of an operator guide that counts */
#define WIDER 1.1               /* than the law is looked for in */
#define MIDDLE_FROM 0.2         /* of the middle three fifths, */
#define MIDDLE_WIDTH 1.0766     /* and how wide they are: of N(0,1) truncated to [-1,1] */
#define ROUGHLY_WIDER 1.1
#define COMMON_SPREAD 0.15      /* of a frequency, that curls may have before it is known */
#define MOST_TURNS 4.0          /* over a guide, that this may make: more cannot be looked through */
#define LEAST_SPREAD 0.005      /* of a frequency: less is none */
#define MOST_ERROR 0.75         /* of the variance that was found */
#define USUAL_SQUARE 0.4549     /* median of the square of a normal number of variance 1 */
#define PHASE_TURNS 3.9f        /* of the second number, */
#define PHASE_PLACE 0.6f        /* and where it keeps the phase as frequencies change: past the middle, as curls set in late */

static double length_of(const struct groom *groom, uint32_t guide)
{
    const float (*x)[3] = (const float (*)[3])groom->guides + (size_t)groom->operator_guide[guide] * groom->n_vertices;
    return groom_polyline_length(x, groom->n_vertices);
}

static double mean_length(const struct groom *groom)
{
    double sum = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        sum += length_of(groom, o);
    return sum / groom->n_operator_guides;
}

int frequencies_tell(const struct groom *groom)
{
    return groom->n_operator_guides >= LEAST_GUIDES && groom->n_strands >= LEAST_STRANDS * groom->n_operator_guides;
}

/* --- numbers of another law ------------------------------------------------------------------- */

static double frequency_of(const struct groom_operator *curl, uint32_t guide)
{
    return curl->parameter[FREQUENCY] + (double)curl->parameter[RANDOM_FREQUENCY] * curl->random[0][guide];
}

/* The curl keeps its phase where it shows most. */
static void set_number(struct groom *groom, struct groom_operator *curl, uint32_t guide, double was, double number)
{
    curl->random[0][guide] = (float)fmin(fmax(number, -1), 1);
    double turns = (was - frequency_of(curl, guide)) * PHASE_PLACE * length_of(groom, guide);
    float u = curl->random[1][guide] + (float)turns / PHASE_TURNS;
    u += u < 0 ? ceilf(-u * PHASE_TURNS) / PHASE_TURNS : 0;
    u -= u > 1 ? ceilf((u - 1) * PHASE_TURNS) / PHASE_TURNS : 0;
    curl->random[1][guide] = fminf(fmaxf(u, 0), 1);
}

void frequencies_widen(struct groom *groom, struct groom_operator *curl)
{
    double spread = curl->parameter[RANDOM_FREQUENCY];
    double common = fmin(COMMON_SPREAD * curl->parameter[FREQUENCY], MOST_TURNS / fmax(mean_length(groom), 1e-9));
    double wide = fmax(WIDER * spread, common);
    curl->parameter[RANDOM_FREQUENCY] = (float)wide;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        curl->random[0][o] *= wide > 0 ? (float)(spread / wide) : 1;
}

/* --- the law ------------------------------------------------------------------------------------- */

static void count_strands(const struct groom *groom, uint32_t *count)
{
    for (uint32_t i = 0; i < groom->n_strands; i++)
        count[groom->operator_guide_of[i]]++;
}

struct counted { double number, strands; };

static int compare_counted(const void *a, const void *b)
{
    const struct counted *x = a, *y = b;
    if (x->number != y->number)
        return x->number < y->number ? -1 : 1;
    return (x->strands > y->strands) - (x->strands < y->strands);
}

/* The number below which a share of the strands are. Sorts. */
static double quantile(struct counted *counted, uint32_t n, double share)
{
    double all = 0, below = 0;
    qsort(counted, n, sizeof *counted, compare_counted);
    for (uint32_t k = 0; k < n; k++)
        all += counted[k].strands;
    for (uint32_t k = 0; k < n; k++)
        if ((below += counted[k].strands) >= share * all)
            return counted[k].number;
    return 0;
}

/* A frequency is as uncertain as its curl is short: what is off is the turns over it. */
static double error_size(const struct groom *groom, uint32_t guide, double usual)
{
    return usual / fmax(length_of(groom, guide), 1e-3 * usual);
}

/* Of the numbers that are found, at the usual length, from how far those of two halves are apart: that of their mean is
 * a quarter of the square. By the median, as a half may be another curl's. */
static double error_variance(const struct groom *groom, const float (*half)[2], double usual, struct counted *counted)
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        if (isfinite(half[o][0]) && isfinite(half[o][1])) {
            double off = 0.5 * ((double)half[o][0] - (double)half[o][1]) / error_size(groom, o, usual);
            counted[n++] = (struct counted){off * off, 1};
        }
    return n > 0 ? quantile(counted, n, 0.5) / USUAL_SQUARE : 0;
}

/* The law that the middle of the numbers is of. */
static struct spread_law middle_of(const struct groom *groom, const struct groom_operator *curl, const uint32_t *count,
                                   struct counted *counted)
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        if (count[o] >= LEAST_STRANDS)
            counted[n++] = (struct counted){curl->random[0][o], count[o]};
    double low = quantile(counted, n, MIDDLE_FROM), high = quantile(counted, n, 1 - MIDDLE_FROM);
    double deviation = ROUGHLY_WIDER * DRAWS_DEVIATION * (high - low) / MIDDLE_WIDTH;
    return (struct spread_law){0.5 * (low + high), deviation * deviation, 0};
}

/* The numbers as samples of the law, each curl as often as it has strands. sample [n_gop]; returns how many count */
static uint32_t list_samples(const struct groom *groom, const struct groom_operator *curl, const uint32_t *count,
                             double usual, struct spread_sample *sample)
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        if (count[o] >= LEAST_STRANDS)
            sample[n++] = (struct spread_sample){curl->random[0][o], count[o], error_size(groom, o, usual)};
    return n;
}

/* Not all differences of the numbers are explained away. */
static struct spread_law likeliest(const struct groom *groom, const struct groom_operator *curl, const uint32_t *count,
                                   const float (*half)[2], double usual, struct counted *counted,
                                   struct spread_sample *sample)
{
    uint32_t n = list_samples(groom, curl, count, usual, sample);
    struct spread_law law, plain;
    spread_find(sample, n, error_variance(groom, half, usual, counted), &law);
    for (uint32_t i = 0; i < n; i++)
        sample[i].size = 0;
    spread_find(sample, n, 0, &plain);
    law.variance = fmax(law.variance, (1 - MOST_ERROR) * plain.variance);
    return law;
}

/* The law is the operator's from now on, and each curl has the frequency that it is expected to have by it: those of
 * long guides as they were found, those of short ones nearer to the mean. */
static void apply_law(struct groom *groom, struct groom_operator *curl, const struct spread_law *law, double usual)
{
    double frequency = curl->parameter[FREQUENCY], random = curl->parameter[RANDOM_FREQUENCY];
    double centre = fmax(frequency + random * law->mean, 0);
    double spread = fmax(random * sqrt(law->variance) / DRAWS_DEVIATION, LEAST_SPREAD * centre);
    curl->parameter[FREQUENCY] = (float)centre;
    curl->parameter[RANDOM_FREQUENCY] = (float)spread;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        struct spread_sample sample = {curl->random[0][o], 1, error_size(groom, o, usual)};
        double number = spread > 0 ? random * (spread_expect(law, &sample) - law->mean) / spread : 0;
        set_number(groom, curl, o, frequency + random * sample.value, number);
    }
}

groom_status frequencies_restate(struct groom *groom, struct groom_operator *curl, const float (*half)[2],
                                 const struct groom_allocator *allocator, struct groom_diag *diag)
{
    uint32_t n = groom->n_operator_guides;
    uint32_t *count = memory_array_zero(allocator, n, sizeof *count);
    struct counted *counted = memory_array(allocator, n, sizeof *counted);
    struct spread_sample *sample = memory_array(allocator, n, sizeof *sample);
    groom_status st = count && counted && sample ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for the frequencies of curls");
    if (st == GROOM_OK) {
        double usual = mean_length(groom);
        count_strands(groom, count);
        struct spread_law law = half ? likeliest(groom, curl, count, half, usual, counted, sample)
                                     : middle_of(groom, curl, count, counted);
        apply_law(groom, curl, &law, usual);
    }
    memory_release(allocator, count, n, sizeof *count);
    memory_release(allocator, counted, n, sizeof *counted);
    memory_release(allocator, sample, n, sizeof *sample);
    return st;
}
