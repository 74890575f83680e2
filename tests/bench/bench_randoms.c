/* How near stage `randoms` brings strands to those of a known truth, style by style: with the truth's own
 * guides and operators, and after whole fits. Errors are means over strands, beside those of the truth with
 * other random numbers.
 *
 *     bench_randoms [n_strands [style]] */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fit/loss_strands.h"
#include "fit/state.h"
#include "groom/mesh.h"
#include "groom/strands.h"
#include "tests/support/guides.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void require(groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "bench_randoms: %s: %s\n", groom_status_name(status), diag->detail);
    exit(1);
}

static struct groom_fit *fit_of(const struct groom_sample *sample, const struct groom_context *context)
{
    struct groom_fit_options options;
    struct groom_fit *fit;
    struct groom_diag diag = {0};
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    options.seed = 77;
    options.operators_auto = 0;
    options.n_operators = sample->truth->n_operators;
    for (uint32_t o = 0; o < options.n_operators; o++)
        options.operators[o] = sample->truth->operators[o].type;
    require(groom_fit_create(sample->capture, sample->head, &options, context, &fit, &diag), &diag);
    return fit;
}

/* The truth with other random numbers. */
static void know_truth(struct groom_fit *fit, const struct groom *truth, const struct groom_context *context)
{
    struct groom *groom;
    struct groom_diag diag = {0};
    require(groom_clone(truth, context, &groom, &diag), &diag);
    for (uint32_t o = 0; o < groom->n_operators; o++)
        groom_draw_random(groom, &groom->operators[o], fit->options.seed);
    groom_destroy(fit->groom);
    fit->groom = groom;
}

/* Of all strands, as the fit has resampled the capture. */
static struct loss_strands errors_of(const struct groom_fit *fit, const struct groom *groom, const struct groom_context *context)
{
    struct groom_diag diag = {0};
    struct groom_strands *strands;
    struct loss_strands loss;
    size_t n_points = (size_t)fit->n * fit->m;
    float (*a)[3] = malloc(n_points * sizeof *a), (*b)[3] = malloc(n_points * sizeof *b);
    require(groom_strands_create(fit->n, n_points, context, &strands, &diag), &diag);
    for (uint32_t i = 0; i <= fit->n; i++)
        strands->first[i] = i * fit->m;
    require(groom_evaluate(groom, 0, fit->n, strands->points, context, &diag), &diag);
    require(groom_strands_resample(strands, fit->m, a, context, &diag), &diag);
    for (size_t v = 0; v < n_points; v++)
        for (int c = 0; c < 3; c++)
            b[v][c] = fit->target[v][c] * fit->scale + fit->centre[c];
    require(loss_strands((const float (*)[3])a, (const float (*)[3])b, fit->n, fit->m, 0.1, 2, 0.01, context, &loss, &diag), &diag);
    groom_strands_destroy(strands);
    free(a);
    free(b);
    return loss;
}

static void judge(groom_sample_style style, uint32_t n, int known, const struct groom_context *context)
{
    const char *name = groom_sample_style_name(style), *guides = known ? "known" : "fitted";
    struct groom_sample *sample = guides_sample(style, n, 100, 5, context);
    struct groom_fit *fit = fit_of(sample, context);
    guides_fit_on(fit, known ? "instance_weights" : "randoms", context);
    struct groom *fitted = fit->groom;
    fit->groom = NULL;
    know_truth(fit, sample->truth, context);
    struct loss_strands other = errors_of(fit, fit->groom, context);
    if (known) {
        groom_destroy(fitted);
        fit->stage = FIT_STAGE_randoms;
    } else {
        groom_destroy(fit->groom);
        fit->groom = fitted;
    }
    struct loss_strands before = errors_of(fit, fit->groom, context);
    double start = now();
    guides_fit_on(fit, "", context);
    double seconds = now() - start;
    struct loss_strands after = errors_of(fit, fit->groom, context);
    printf("figure randoms_%s_%s_direction %.3f 1 of the error of the truth with other random numbers (%.4f); before: %.3f\n", guides, name,
           after.direction / other.direction, other.direction, before.direction / other.direction);
    printf("figure randoms_%s_%s_vertex %.3f 1 of the error of the truth with other random numbers (%.2f mm); before: %.3f\n", guides, name,
           after.vertex / other.vertex, 1e3 * other.vertex, before.vertex / other.vertex);
    printf("figure randoms_%s_%s_seconds %.2f s stage randoms; Eq. 19 %.4g, before %.4g, truth with other numbers %.4g; spectra %.4g %.4g\n", guides, name, seconds,
           after.total, before.total, other.total, after.spectra, before.spectra);
    groom_fit_destroy(fit);
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
        for (int known = 1; known >= 0; known--)
            if (only == GROOM_SAMPLE_STYLE_COUNT || only == (groom_sample_style)style)
                judge((groom_sample_style)style, n, known, &context);
    groom_pool_destroy(pool);
    return 0;
}
