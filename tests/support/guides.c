#include "tests/support/guides.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void must(groom_status st, const struct groom_diag *diag)
{
    if (st == GROOM_OK)
        return;
    fprintf(stderr, "%s: %s\n", groom_status_name(st), diag->detail);
    abort();
}

/* Counts of guides go with the square root of the number of strands, as the fit's do. */
struct groom_sample *guides_sample(groom_sample_style style, uint32_t n_strands, uint32_t n_vertices, uint64_t seed,
                                   const struct groom_context *context)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    struct groom_diag diag = {0};
    groom_sample_options_init(style, &options);
    double share = sqrt((double)n_strands / options.n_strands);
    options.n_strands = n_strands;
    options.n_vertices = n_vertices;
    options.n_guides = (uint32_t)(share * options.n_guides);
    options.n_operator_guides = (uint32_t)(share * options.n_operator_guides);
    options.seed = seed;
    must(groom_sample_create(&options, context, &sample, &diag), &diag);
    return sample;
}

void guides_fit_on(struct groom_fit *fit, const char *stage, const struct groom_context *context)
{
    struct groom_diag diag = {0};
    while (!groom_fit_done(fit) && strcmp(groom_fit_stage_name(fit->stage), stage) != 0)
        must(groom_fit_step(fit, context, &diag), &diag);
}

struct groom_fit *guides_fit(const struct groom_sample *sample, const struct groom_fit_options *options,
                             const char *stage, const struct groom_context *context)
{
    struct groom_fit *fit;
    struct groom_diag diag = {0};
    must(groom_fit_create(sample->capture, sample->head, options, context, &fit, &diag), &diag);
    guides_fit_on(fit, stage, context);
    return fit;
}

/* --- how far from the truth ------------------------------------------------------------ */

static double distance(const float a[3], const float b[3])
{
    double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

/* Dense strands of the groom with those operators alone that the mean of a strand sees: clump, or none. */
static float (*instanced(const struct groom *groom, int with_clump))[3]
{
    struct groom_diag diag = {0};
    struct groom *copy;
    float (*dense)[3] = malloc((size_t)groom->n_strands * groom->n_vertices * sizeof *dense);
    must(groom_clone(groom, NULL, &copy, &diag), &diag);
    for (uint32_t i = 0; i < copy->n_operators; i++)
        copy->operators[i].enabled &= with_clump && copy->operators[i].type == GROOM_OPERATOR_CLUMP;
    must(groom_evaluate(copy, 0, copy->n_strands, dense, NULL, &diag), &diag);
    groom_destroy(copy);
    return dense;
}

static double to_segment(const float p[3], const float a[3], const float b[3])
{
    double along = 0, square = 0, rest = 0;
    for (int c = 0; c < 3; c++) {
        along += ((double)p[c] - a[c]) * ((double)b[c] - a[c]);
        square += ((double)b[c] - a[c]) * ((double)b[c] - a[c]);
    }
    double t = square > 0 ? fmin(fmax(along / square, 0), 1) : 0;
    for (int c = 0; c < 3; c++) {
        double d = p[c] - (a[c] + t * ((double)b[c] - a[c]));
        rest += d * d;
    }
    return sqrt(rest);
}

static double to_polyline(const float p[3], const float (*line)[3], uint32_t m)
{
    double least = INFINITY;
    for (uint32_t j = 0; j + 1 < m; j++)
        least = fmin(least, to_segment(p, line[j], line[j + 1]));
    return least;
}

static double mean_loss(const struct groom_fit *fit, const struct groom *groom)
{
    float (*dense)[3] = instanced(groom, 1);
    double sum = 0;
    for (size_t v = 0; v < (size_t)fit->n * fit->m; v++)
        for (int c = 0; c < 3; c++) {
            double d = dense[v][c] - (fit->centre[c] + (double)fit->scale * fit->target[v][c]);
            sum += d * d;
        }
    free(dense);
    return sum / ((double)fit->n * fit->m);
}

static void measure_shape(const struct groom *groom, struct guides_quality *quality)
{
    uint32_t m = groom->n_vertices;
    quality->ripple = quality->turn = 0;
    for (uint32_t g = 0; g < groom->n_guides; g++) {
        const float (*x)[3] = (const float (*)[3])(groom->guides + (size_t)g * m);
        double sum = 0, squares = 0;
        for (uint32_t j = 0; j + 1 < m; j++) {
            double length = distance(x[j], x[j + 1]), dot = 0;
            sum += length;
            squares += length * length;
            if (j + 2 == m)
                break;
            for (int c = 0; c < 3; c++)
                dot += ((double)x[j + 1][c] - x[j][c]) * ((double)x[j + 2][c] - x[j + 1][c]);
            dot /= length * distance(x[j + 1], x[j + 2]);
            quality->turn = fmax(quality->turn, acos(fmax(fmin(dot, 1), -1)) * 180 / M_PI);
        }
        double mean = sum / (m - 1), variance = fmax(squares / (m - 1) - mean * mean, 0);
        quality->ripple = fmax(quality->ripple, sqrt(variance) / mean);
    }
}

static uint32_t strand_of_root(const struct groom *groom, const float root[3])
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < groom->n_strands; i++)
        if (distance(groom->roots[i], root) < distance(groom->roots[best], root))
            best = i;
    return best;
}

void guides_measure(const struct groom_fit *fit, const struct groom_sample *sample, struct guides_quality *quality)
{
    const struct groom *groom = fit->groom;
    uint32_t m = fit->m;
    float (*ours)[3] = instanced(groom, 0), (*truth)[3] = instanced(sample->truth, 0);
    memset(quality, 0, sizeof *quality);
    for (uint32_t g = 0; g < groom->n_guides; g++) {
        uint32_t i = strand_of_root(groom, groom->guides[(size_t)g * m]);
        for (uint32_t j = 0; j < m; j++)
            quality->guides += distance(groom->guides[(size_t)g * m + j], truth[(size_t)i * m + j]) /
                               ((double)groom->n_guides * m);
    }
    for (size_t v = 0; v < (size_t)fit->n * m; v++)
        quality->strands += distance(ours[v], truth[v]) / ((double)fit->n * m);
    uint32_t n_shapes = 0;
    for (uint32_t i = 0; i < fit->n; i += 7, n_shapes++)
        for (uint32_t j = 0; j < m; j++)
            quality->shapes += to_polyline(ours[(size_t)i * m + j], (const float (*)[3])(truth + (size_t)i * m), m);
    quality->shapes /= (double)n_shapes * m;
    quality->loss = mean_loss(fit, groom);
    quality->truth_loss = mean_loss(fit, sample->truth);
    measure_shape(groom, quality);
    free(ours);
    free(truth);
}
