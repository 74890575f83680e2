/* How far the parameters of whole fits move where they should not: the same strands in centimetres (rounding
 * alone), with another axis up, turned, with another seed of the fit, and a fitted groom's own strands fitted again.
 *
 *     bench_invariance [n_strands [style|all [auto]]] */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "groom/mesh.h"
#include "groom/strands.h"
#include "tests/support/known.h"

static struct groom *fitted(const struct groom_sample *sample, uint64_t seed, int automatic, const struct groom_context *context)
{
    struct groom_fit_options options = known_options(sample, automatic);
    struct groom_diag diag = {0};
    struct groom *groom;
    options.seed = seed;
    struct groom_fit *fit = guides_fit(sample, &options, "", context);
    known_must(groom_fit_result(fit, context, &groom, &diag), &diag);
    groom_fit_destroy(fit);
    return groom;
}

/* --- the same hair another way --------------------------------------------------------------- */

static void in_centimetres(float (*x)[3], size_t n)
{
    for (size_t v = 0; v < n; v++)
        for (int c = 0; c < 3; c++)
            x[v][c] = (float)((double)(float)(100.0 * (double)x[v][c]) * 0.01);
}

static void turn(float (*x)[3], size_t n, const double r[3][3])
{
    for (size_t v = 0; v < n; v++) {
        double p[3] = {(double)x[v][0], (double)x[v][1], (double)x[v][2]};
        for (int c = 0; c < 3; c++)
            x[v][c] = (float)(r[c][0] * p[0] + r[c][1] * p[1] + r[c][2] * p[2]);
    }
}

static void turn_sample(struct groom_sample *sample, const double r[3][3])
{
    turn(sample->capture->points, sample->capture->n_vertices, r);
    turn(sample->head->points, sample->head->n_vertices, r);
}

/* --- figures ------------------------------------------------------------------------------------ */

static void compare(const char *style, const char *what, double most, const struct groom *a, const struct groom *b)
{
    struct known_parameter parameter[KNOWN_PARAMETERS], *worst = parameter;
    uint32_t n = known_parameters(b, a, parameter);
    for (uint32_t k = 1; k < n; k++)
        worst = fabs(parameter[k].error) > fabs(worst->error) ? &parameter[k] : worst;
    printf("figure invariance_%s_%s %.2f %% %s.%s moves most; at most %g\n", style, what, fabs(worst->error), worst->of, worst->name, most);
    fflush(stdout);
}

static void judge(groom_sample_style style, const struct known_run *run)
{
    const struct groom_context *context = run->context;
    uint32_t n = run->n_strands;
    int automatic = strcmp(run->more[0], "auto") == 0;
    static const double upright[3][3] = {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
    static const double slanted[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
    const char *name = groom_sample_style_name(style);
    struct groom_diag diag = {0};
    struct groom_sample *sample = guides_sample(style, n, 100, 5, context);
    struct groom *first = fitted(sample, 77, automatic, context), *other;
    for (int way = 0; way < 5; way++) {
        static const char *const ways[] = {"unit", "axis", "rotation", "seed", "refit"};
        static const double most[] = {0.5, 0.5, 3, 5, 3};
        struct groom_sample *same = guides_sample(style, n, 100, 5, context);
        if (way == 0)
            in_centimetres(same->capture->points, same->capture->n_vertices);
        if (way == 1 || way == 2)
            turn_sample(same, way == 1 ? upright : slanted);
        if (way == 4)
            known_must(groom_evaluate(first, 0, n, same->capture->points, context, &diag), &diag);
        other = fitted(same, way == 3 ? 78 : 77, automatic, context);
        compare(name, ways[way], most[way], first, other);
        groom_destroy(other);
        groom_sample_destroy(same);
    }
    groom_destroy(first);
    groom_sample_destroy(sample);
}

int main(int argc, char **argv) { return known_styles(argc, argv, judge); }
