/* How near the distributions of a fitted groom's strands come to a known truth, style by style: distances of the quality
 * report, over those that the truth with other random numbers scores, and the errors of single strands after stage `randoms`
 * over its own. 3 000 strands x 100, operators named; asked are 1.3 for the distances and 0.5 for strands.
 *
 *     bench_distances [n_strands [style]] */
#include <stdio.h>
#include <stdlib.h>

#include "groom/quality.h"
#include "groom/strands.h"
#include "tests/support/guides.h"

enum { DRAWS = 3 }; /* of the truth: their mean is the yardstick */

static void require(groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "bench_distances: %s: %s\n", groom_status_name(status), diag->detail);
    exit(1);
}

static const char *const names[] = {"spectra", "segments", "curvature", "torsion", "length", "direction", "vertex"};
enum { MEASURES = sizeof names / sizeof names[0] };

static void list_measures(const struct groom_quality *q, double measures[MEASURES])
{
    const double all[MEASURES] = {q->spectra.distance, q->segments.distance, q->curvature.distance, q->torsion.distance,
                                  q->length.distance, q->pair_direction, q->pair_distance};
    for (int k = 0; k < MEASURES; k++)
        measures[k] = all[k];
}

/* The truth drawn anew, with seeds of its own. */
static void measure_truth(const struct groom_quality_target *target, const struct groom *truth, double mean[MEASURES],
                          const struct groom_context *context)
{
    struct groom_diag diag = {0};
    struct groom_quality as_it_is, drawn;
    double one[MEASURES];
    for (int k = 0; k < MEASURES; k++)
        mean[k] = 0;
    for (uint64_t seed = 1; seed <= DRAWS; seed++) {
        struct groom *other;
        require(groom_clone(truth, context, &other, &diag), &diag);
        for (uint32_t o = 0; o < other->n_operators; o++)
            groom_draw_random(other, &other->operators[o], 1000 + seed);
        require(groom_quality_of_groom(target, other, context, &as_it_is, &drawn, &diag), &diag);
        list_measures(&as_it_is, one);
        for (int k = 0; k < MEASURES; k++)
            mean[k] += one[k] / DRAWS;
        groom_destroy(other);
    }
}

static struct groom *fit_groom(const struct groom_sample *sample, const struct groom_context *context)
{
    struct groom_fit_options options;
    struct groom *groom;
    struct groom_diag diag = {0};
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    options.operators_auto = 0;
    options.n_operators = sample->truth->n_operators;
    for (uint32_t o = 0; o < options.n_operators; o++)
        options.operators[o] = sample->truth->operators[o].type;
    struct groom_fit *fit = guides_fit(sample, &options, "", context);
    require(groom_fit_result(fit, context, &groom, &diag), &diag);
    groom_fit_destroy(fit);
    return groom;
}

/* Distributions before `randoms` as the groom draws them, single strands after it. */
static void judge(groom_sample_style style, uint32_t n, const struct groom_context *context)
{
    struct groom_sample *sample = guides_sample(style, n, 100, 5, context);
    struct groom_quality_target *target;
    struct groom_quality after, before;
    struct groom_diag diag = {0};
    double truth[MEASURES], fitted[MEASURES], drawn[MEASURES];
    struct groom *groom = fit_groom(sample, context);
    require(groom_quality_target_create(sample->capture, sample->head, NULL, context, &target, &diag), &diag);
    measure_truth(target, sample->truth, truth, context);
    require(groom_quality_of_groom(target, groom, context, &after, &before, &diag), &diag);
    list_measures(&after, fitted);
    list_measures(&before, drawn);
    for (int k = 0; k < MEASURES; k++)
        printf("figure distances_%s_%s %.2f 1 after randoms, %.2f before, of the truth with other random numbers (%.4g)\n",
               groom_sample_style_name(style), names[k], fitted[k] / truth[k], drawn[k] / truth[k], truth[k]);
    fflush(stdout);
    groom_quality_target_destroy(target);
    groom_destroy(groom);
    groom_sample_destroy(sample);
}

int main(int argc, char **argv)
{
    uint32_t n = argc > 1 ? (uint32_t)atoi(argv[1]) : 3000;
    groom_sample_style only = GROOM_SAMPLE_STYLE_COUNT;
    struct groom_pool *pool;
    struct groom_diag diag = {0};
    if (argc > 2)
        require(groom_sample_style_parse(argv[2], &only, &diag), &diag);
    require(groom_pool_create(0, &pool), &diag);
    struct groom_context context = {.pool = pool};
    for (int style = 0; style < GROOM_SAMPLE_STYLE_COUNT; style++)
        if (only == GROOM_SAMPLE_STYLE_COUNT || only == (groom_sample_style)style)
            judge((groom_sample_style)style, n, &context);
    groom_pool_destroy(pool);
    return 0;
}
