/* Where two fits to the same hair part, one of them to hair that was uploaded in centimetres, or turned: after each pass, the share of
 * strands whose choices differ, how far guides and random numbers have come apart, and the parameter that has moved most.
 *
 *     bench_parting [n_strands [style|all [unit|axis|rotation [last stage]]]] */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "groom/mesh.h"
#include "groom/strands.h"
#include "tests/support/invariance.h"
#include "tests/support/known.h"

static double share_of_differences(const uint32_t *a, const uint32_t *b, size_t n)
{
    size_t n_differ = 0;
    for (size_t i = 0; a && b && i < n; i++)
        n_differ += a[i] != b[i];
    return n ? 100.0 * (double)n_differ / (double)n : 0;
}

/* Root mean square of the difference, of points of which the first are turned. */
static double apart(const float (*a)[3], const float (*b)[3], size_t n, const double r[3][3])
{
    double square = 0;
    for (size_t v = 0; v < n; v++)
        for (int c = 0; c < 3; c++) {
            double d = b[v][c];
            for (int k = 0; k < 3; k++)
                d -= r[c][k] * (double)a[v][k];
            square += d * d;
        }
    return sqrt(square / (double)n);
}

static double numbers_apart(const struct groom *a, const struct groom *b, double *share)
{
    double square = 0, n = 0, n_far = 0;
    for (uint32_t o = 0; o < a->n_operators; o++) {
        uint32_t n_randoms = groom_operator_random_arrays(a->operators[o].type);
        uint32_t count = groom_operator_random_per_guide(a->operators[o].type) ? a->n_operator_guides : a->n_strands;
        for (uint32_t r = 0; r < n_randoms; r++)
            for (uint32_t i = 0; i < count; i++, n++) {
                double d = (double)a->operators[o].random[r][i] - b->operators[o].random[r][i];
                square += d * d;
                n_far += fabs(d) > 0.01;
            }
    }
    *share = n > 0 ? 100 * n_far / n : 0;
    return n > 0 ? sqrt(square / n) : 0;
}

static void compare(const struct groom_fit *a, const struct groom_fit *b, const char *stage, uint32_t phase, const double r[3][3])
{
    printf("%-16s %2u clusters %.3f %% centroids %.1e", stage, phase, share_of_differences(a->cluster_of, b->cluster_of, a->n),
           a->centroids ? apart((const float (*)[3])a->centroids, (const float (*)[3])b->centroids, (size_t)a->n_guides * a->m, r) : 0);
    if (a->groom && b->groom) {
        const struct groom *x = a->groom, *y = b->groom;
        struct known_parameter parameter[KNOWN_PARAMETERS], *worst = parameter;
        uint32_t n = known_parameters(y, x, parameter);
        double share, numbers = numbers_apart(x, y, &share);
        for (uint32_t k = 1; k < n; k++)
            worst = fabs(parameter[k].error) > fabs(worst->error) ? &parameter[k] : worst;
        printf("  guides %.1e m, operator guides %.2f %%, of strands %.3f %%, instancing %.3f %%, numbers %.1e (%.2f %%)",
               apart((const float (*)[3])x->guides, (const float (*)[3])y->guides, (size_t)x->n_guides * x->n_vertices, r),
               share_of_differences(x->operator_guide, y->operator_guide, x->n_operator_guides),
               share_of_differences(x->operator_guide_of, y->operator_guide_of, x->n_strands),
               share_of_differences(x->instancing_guide, y->instancing_guide, (size_t)x->n_strands * x->n_instancing), numbers, share);
        if (n)
            printf("  %s.%s %+.4f %%", worst->of, worst->name, worst->error);
    }
    printf("\n");
    fflush(stdout);
}

static struct groom_fit *begun(const struct groom_sample *sample, const struct groom_context *context)
{
    struct groom_fit_options options = known_options(sample, 0);
    struct groom_diag diag = {0};
    struct groom_fit *fit;
    known_must(groom_fit_create(sample->capture, sample->head, &options, context, &fit, &diag), &diag);
    return fit;
}

static void judge(groom_sample_style style, const struct known_run *run)
{
    const struct groom_context *context = run->context;
    struct groom_sample *one = guides_sample(style, run->n_strands, 100, 5, context), *other = guides_sample(style, run->n_strands, 100, 5, context);
    const double (*r)[3] = invariance_as_it_is;
    struct groom_diag diag = {0};
    if (strcmp(run->more[0], "axis") == 0)
        invariance_turn(other, r = invariance_upright);
    else if (strcmp(run->more[0], "rotation") == 0)
        invariance_turn(other, r = invariance_slanted);
    else
        invariance_upload(other, (struct groom_frame){0.01, GROOM_UP_Y});
    struct groom_fit *a = begun(one, context), *b = begun(other, context);
    printf("%s: target %.1e of its size apart\n", groom_sample_style_name(style),
           apart((const float (*)[3])a->target, (const float (*)[3])b->target, (size_t)a->n * a->m, r));
    while (!groom_fit_done(a) && !groom_fit_done(b)) {
        const char *stage = groom_fit_stage_name(a->stage);
        uint32_t at = a->stage, phase = a->phase;
        while (!groom_fit_done(a) && a->stage == at && a->phase == phase)
            known_must(groom_fit_step(a, context, &diag), &diag);
        while (!groom_fit_done(b) && b->stage == at && b->phase == phase)
            known_must(groom_fit_step(b, context, &diag), &diag);
        compare(a, b, stage, phase, r);
        if (run->more[1][0] && strcmp(stage, run->more[1]) == 0)
            break;
    }
    groom_fit_destroy(a);
    groom_fit_destroy(b);
    groom_sample_destroy(one);
    groom_sample_destroy(other);
}

int main(int argc, char **argv) { return known_styles(argc, argv, judge); }
