/* How far the parameters of whole fits move where they should not: the same strands and head uploaded in other units
 * and with another axis up, which the upload tells (rounding alone); turned, on their side and askew, which nobody
 * tells; with another seed of the fit; and a fitted groom's own strands fitted again.
 *
 *     bench_invariance [n_strands [style|all [auto]]] */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "groom/strands.h"
#include "tests/support/invariance.h"
#include "tests/support/known.h"

struct way {
    const char *name;
    double most; /* per cent that a parameter may move by */
    struct groom_frame frame;
    const double (*turn)[3];
    uint64_t seed;
    int again;
};

static const struct way ways[] = {
    {.name = "centimetres", .most = 0.5, .frame = {0.01, GROOM_UP_Y}},
    {.name = "inches", .most = 0.5, .frame = {0.0254, GROOM_UP_Y}},
    {.name = "axis", .most = 0.5, .frame = {1, GROOM_UP_Z}},
    {.name = "axis_millimetres", .most = 0.5, .frame = {0.001, GROOM_UP_Z}},
    {.name = "untold_axis", .most = 3, .turn = invariance_upright},
    {.name = "rotation", .most = 3, .turn = invariance_slanted},
    {.name = "seed", .most = 5, .seed = 1},
    {.name = "refit", .most = 3, .again = 1},
};

static struct groom *fitted(const struct groom_sample *sample, uint64_t seed, const struct known_run *run)
{
    struct groom_fit_options options = known_options(sample, strcmp(run->more[0], "auto") == 0);
    struct groom_diag diag = {0};
    struct groom *groom;
    options.seed += seed;
    struct groom_fit *fit = guides_fit(sample, &options, "", run->context);
    known_must(groom_fit_result(fit, run->context, &groom, &diag), &diag);
    groom_fit_destroy(fit);
    return groom;
}

/* The style's hair this way, fitted. first: the groom of it as it is, or NULL */
static struct groom *fitted_this_way(groom_sample_style style, const struct way *way, const struct groom *first,
                                     const struct known_run *run)
{
    struct groom_sample *sample = guides_sample(style, run->n_strands, 100, 5, run->context);
    struct groom_diag diag = {0};
    if (way->turn)
        invariance_turn(sample, way->turn);
    else
        invariance_upload(sample, way->frame);
    if (way->again)
        known_must(groom_evaluate(first, 0, run->n_strands, sample->capture->points, run->context, &diag), &diag);
    struct groom *groom = fitted(sample, way->seed, run);
    groom_sample_destroy(sample);
    return groom;
}

static void compare(const char *style, const struct way *way, const struct groom *a, const struct groom *b)
{
    struct known_parameter parameter[KNOWN_PARAMETERS], *worst = parameter;
    uint32_t n = known_parameters(b, a, parameter);
    for (uint32_t k = 1; k < n; k++)
        worst = fabs(parameter[k].error) > fabs(worst->error) ? &parameter[k] : worst;
    printf("figure invariance_%s_%s %.2f %% %s.%s moves most; at most %g\n", style, way->name, fabs(worst->error), worst->of,
           worst->name, way->most);
    fflush(stdout);
}

static void judge(groom_sample_style style, const struct known_run *run)
{
    const struct way as_it_is = {.name = ""};
    struct groom *first = fitted_this_way(style, &as_it_is, NULL, run);
    for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++) {
        struct groom *other = fitted_this_way(style, &ways[w], first, run);
        compare(groom_sample_style_name(style), &ways[w], first, other);
        groom_destroy(other);
    }
    groom_destroy(first);
}

int main(int argc, char **argv) { return known_styles(argc, argv, judge); }
