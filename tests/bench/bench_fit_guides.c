/* How near the fit's guides come to the truth's, style by style, before and after stage `guides`, and
 * how long the stage takes. */
#include <stdio.h>
#include <string.h>

#include "tests/support/known.h"

#define STRANDS 3000

static void row(groom_sample_style style, const struct groom_context *context)
{
    const char *name = groom_sample_style_name(style);
    struct groom_sample *sample = guides_sample(style, STRANDS, 100, 1, context);
    struct groom_fit_options options;
    struct guides_quality before, weighted, after;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    struct groom_fit *fit = guides_fit(sample, &options, "instance_weights", context);
    guides_measure(fit, sample, &before);
    guides_fit_on(fit, "guides", context);
    guides_measure(fit, sample, &weighted);
    double begin = known_seconds();
    guides_fit_on(fit, "operators", context);
    double seconds = known_seconds() - begin;
    guides_measure(fit, sample, &after);
    printf("figure guides_%s_guide_mm %.2f mm mean distance of guides from the truth; after instance_weights %.2f, initialize %.2f\n",
           name, 1e3 * after.guides, 1e3 * weighted.guides, 1e3 * before.guides);
    printf("figure guides_%s_strand_mm %.2f mm mean distance of instanced strands from the truth's; after instance_weights %.2f, initialize %.2f\n",
           name, 1e3 * after.strands, 1e3 * weighted.strands, 1e3 * before.strands);
    printf("figure guides_%s_shape_mm %.2f mm nearest distance of them to the truth's polyline; after instance_weights %.2f, initialize %.2f\n",
           name, 1e3 * after.shapes, 1e3 * weighted.shapes, 1e3 * before.shapes);
    printf("figure guides_%s_loss_mm2 %.2f mm2 Eq. 7 a vertex; after instance_weights %.2f, initialize %.2f, truth %.2f\n",
           name, 1e6 * after.loss, 1e6 * weighted.loss, 1e6 * before.loss, 1e6 * after.truth_loss);
    printf("figure guides_%s_ripple %.4f 1 deviation of segment lengths over their mean, worst guide; initialize: %.4f\n",
           name, after.ripple, before.ripple);
    printf("figure guides_%s_turn_degrees %.2f degree sharpest joint of all guides; initialize: %.2f\n", name,
           after.turn, before.turn);
    printf("figure guides_%s_seconds %.3f s of processor time, stage guides, %u guides\n", name, seconds, fit->n_guides);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

static void large(const struct groom_context *context)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_CURLY, 14000, 100, 1, context);
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = options.operator_guides = 500;
    struct groom_fit *fit = guides_fit(sample, &options, "guides", context);
    double begin = known_seconds();
    guides_fit_on(fit, "operators", context);
    printf("figure guides_14k_seconds %.3f s of processor time, stage guides: 14 000 strands x 100, 500 guides, 500 operator guides\n",
           known_seconds() - begin);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

int main(int argc, char **argv)
{
    struct groom_pool *pool;
    if (groom_pool_create(0, &pool) != GROOM_OK)
        return 1;
    struct groom_context context = {.pool = pool};
    for (int style = 0; style < GROOM_SAMPLE_STYLE_COUNT; style++)
        if (argc < 2 || strcmp(argv[1], groom_sample_style_name((groom_sample_style)style)) == 0)
            row((groom_sample_style)style, &context);
    if (argc < 2)
        large(&context);
    groom_pool_destroy(pool);
    return 0;
}
