/* How near the distributions of a fitted groom's strands come to a known truth, style by style: distances of the quality
 * report, over those that the truth with other random numbers scores, and the errors of single strands after stage `randoms`
 * over its own. 3 000 strands x 100, operators named; asked are 1.3 for the distances and 0.5 for strands.
 *
 * Distances are of one half of the target from the other half of the groom. With random numbers that are found, the groom's
 * half is the target's other half, and what sets the target's halves apart is in the distance: the truth itself scores that,
 * and is told beside.
 *
 *     bench_distances [n_strands [style|all]] */
#include <stdio.h>

#include "groom/quality.h"
#include "tests/support/known.h"

enum { DRAWS = 3 }; /* of the truth: their mean is the yardstick */

static const char *const names[] = {"spectra", "segments", "curvature", "torsion", "length", "direction", "vertex"};
enum { MEASURES = sizeof names / sizeof names[0] };

static void list_measures(const struct groom_quality *q, double measures[MEASURES])
{
    const double all[MEASURES] = {q->spectra.distance, q->segments.distance, q->curvature.distance, q->torsion.distance,
                                  q->length.distance, q->pair_direction, q->pair_distance};
    for (int k = 0; k < MEASURES; k++)
        measures[k] = all[k];
}

static void measure(const struct groom_quality_target *target, const struct groom *groom, double as_it_is[MEASURES],
                    double drawn[MEASURES], const struct groom_context *context)
{
    struct groom_quality after, before;
    struct groom_diag diag = {0};
    known_must(groom_quality_of_groom(target, groom, context, &after, &before, &diag), &diag);
    list_measures(&after, as_it_is);
    list_measures(&before, drawn);
}

/* The truth drawn anew, with seeds of its own. */
static void measure_truth(const struct groom_quality_target *target, const struct groom *truth, double mean[MEASURES],
                          const struct groom_context *context)
{
    double one[MEASURES], drawn[MEASURES];
    for (int k = 0; k < MEASURES; k++)
        mean[k] = 0;
    for (uint64_t seed = 1; seed <= DRAWS; seed++) {
        struct groom *other = known_redrawn(truth, 1000 + seed, context);
        measure(target, other, one, drawn, context);
        for (int k = 0; k < MEASURES; k++)
            mean[k] += one[k] / DRAWS;
        groom_destroy(other);
    }
}

/* Distributions before `randoms` as the groom draws them, single strands after it. */
static void judge(groom_sample_style style, const struct known_run *run)
{
    const struct groom_context *context = run->context;
    struct groom_sample *sample = guides_sample(style, run->n_strands, 100, 5, context);
    struct groom_fit_options options = known_options(sample, 0);
    struct groom_fit *fit = guides_fit(sample, &options, "", context);
    struct groom *groom;
    struct groom_quality_target *target;
    struct groom_diag diag = {0};
    double truth[MEASURES], exact[MEASURES], fitted[MEASURES], drawn[MEASURES];
    known_must(groom_fit_result(fit, context, &groom, &diag), &diag);
    known_must(groom_quality_target_create(sample->capture, sample->head, NULL, context, &target, &diag), &diag);
    measure_truth(target, sample->truth, truth, context);
    measure(target, sample->truth, exact, drawn, context);
    measure(target, groom, fitted, drawn, context);
    for (int k = 0; k < MEASURES; k++)
        printf("figure distances_%s_%s %.2f 1 after randoms, %.2f before, of the truth with other random numbers (%.4g), the truth itself %.2f\n",
               groom_sample_style_name(style), names[k], fitted[k] / truth[k], drawn[k] / truth[k], truth[k], exact[k] / truth[k]);
    fflush(stdout);
    groom_quality_target_destroy(target);
    groom_destroy(groom);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

int main(int argc, char **argv) { return known_styles(argc, argv, judge); }
