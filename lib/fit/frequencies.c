#include "fit/frequencies.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "groom/strands.h"

enum { FREQUENCY = 1, RANDOM_FREQUENCY }; /* of a curl's parameters */

#define TRUNCATED_DEVIATION 0.5396 /* of N(0,1) truncated to [-1,1] */
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

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of the numbers that are found, from how far those of two halves are apart: that of their mean is a quarter of the
 * square. By the median, as a half may be another curl's. */
static double error_variance(const struct groom *groom, const float (*half)[2], double *square)
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        if (isfinite(half[o][0]) && isfinite(half[o][1]))
            square[n++] = 0.25 * pow((double)half[o][0] - (double)half[o][1], 2);
    qsort(square, n, sizeof *square, compare_doubles);
    return n > 0 ? square[n / 2] / USUAL_SQUARE : 0;
}

/* Mean and variance of the numbers, each curl as often as it has strands. */
static void spread_of(const struct groom *groom, const struct groom_operator *curl, const uint32_t *count, double *mean,
                      double *variance)
{
    double weight = 0, sum = 0, square = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        double w = count[o] < LEAST_STRANDS ? 0 : count[o], u = curl->random[0][o];
        weight += w;
        sum += w * u;
        square += w * u * u;
    }
    *mean = weight > 0 ? sum / weight : 0;
    *variance = weight > 0 ? fmax(square / weight - *mean * *mean, 0) : 0;
}

struct counted { double number, strands; };

static int compare_counted(const void *a, const void *b)
{
    const struct counted *x = a, *y = b;
    if (x->number != y->number)
        return x->number < y->number ? -1 : 1;
    return (x->strands > y->strands) - (x->strands < y->strands);
}

/* The number below which a share of the strands are. */
static double quantile(const struct counted *counted, uint32_t n, double share)
{
    double all = 0, below = 0;
    for (uint32_t k = 0; k < n; k++)
        all += counted[k].strands;
    for (uint32_t k = 0; k < n; k++)
        if ((below += counted[k].strands) >= share * all)
            return counted[k].number;
    return 0;
}

/* The same as spread_of, of the law that the middle of the numbers is of. */
static void middle_of(const struct groom *groom, const struct groom_operator *curl, const uint32_t *count,
                      struct counted *counted, double *mean, double *variance)
{
    uint32_t n = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++)
        if (count[o] >= LEAST_STRANDS)
            counted[n++] = (struct counted){curl->random[0][o], count[o]};
    qsort(counted, n, sizeof *counted, compare_counted);
    double low = quantile(counted, n, MIDDLE_FROM), high = quantile(counted, n, 1 - MIDDLE_FROM);
    *mean = 0.5 * (low + high);
    *variance = pow(ROUGHLY_WIDER * TRUNCATED_DEVIATION * (high - low) / MIDDLE_WIDTH, 2);
}

groom_status frequencies_restate(struct groom *groom, struct groom_operator *curl, const float (*half)[2],
                                 const struct groom_allocator *allocator, struct groom_diag *diag)
{
    uint32_t n = groom->n_operator_guides;
    uint32_t *count = memory_array_zero(allocator, n, sizeof *count);
    double *square = memory_array(allocator, n, sizeof *square), mean, variance;
    struct counted *counted = memory_array(allocator, n, sizeof *counted);
    groom_status st = count && square && counted ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for the frequencies of curls");
    if (st == GROOM_OK) {
        double frequency = curl->parameter[FREQUENCY], random = curl->parameter[RANDOM_FREQUENCY];
        count_strands(groom, count);
        if (half)
            spread_of(groom, curl, count, &mean, &variance);
        else
            middle_of(groom, curl, count, counted, &mean, &variance);
        double error = half ? fmin(error_variance(groom, half, square), MOST_ERROR * variance) : 0;
        double centre = fmax(frequency + random * mean, 0), found = sqrt(variance) / TRUNCATED_DEVIATION;
        double law = random * sqrt(variance - error) / TRUNCATED_DEVIATION;
        curl->parameter[FREQUENCY] = (float)centre;
        curl->parameter[RANDOM_FREQUENCY] = (float)fmax(law, LEAST_SPREAD * centre);
        for (uint32_t o = 0; o < n; o++) {
            double u = curl->random[0][o];
            set_number(groom, curl, o, frequency + random * u, found > 0 ? (u - mean) / found : 0);
        }
    }
    memory_release(allocator, count, n, sizeof *count);
    memory_release(allocator, square, n, sizeof *square);
    memory_release(allocator, counted, n, sizeof *counted);
    return st;
}
