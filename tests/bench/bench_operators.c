/* What stage `operators` finds of known parameters, style by style: with the truth's own guides, and with
 * those of the stages before it. 3 000 strands x 100.
 *
 *     bench_operators [n_strands [style]] */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fit/state.h"
#include "groom/mesh.h"
#include "groom/sample.h"
#include "groom/strands.h"

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
    fprintf(stderr, "bench_operators: %s: %s\n", groom_status_name(status), diag->detail);
    exit(1);
}

static struct groom_sample *sample_of(groom_sample_style style, uint32_t n, uint64_t seed,
                                      const struct groom_context *context)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    struct groom_diag diag = {0};
    groom_sample_options_init(style, &options);
    options.n_strands = n;
    options.n_vertices = 100;
    options.seed = seed;
    options.n_guides = options.n_guides < n / 4 ? options.n_guides : n / 4;
    options.n_operator_guides = options.n_operator_guides < options.n_guides ? options.n_operator_guides : options.n_guides;
    require(groom_sample_create(&options, context, &sample, &diag), &diag);
    return sample;
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

static void step_until(struct groom_fit *fit, uint32_t stage, const struct groom_context *context)
{
    struct groom_diag diag = {0};
    while (!groom_fit_done(fit) && fit->stage < stage)
        require(groom_fit_step(fit, context, &diag), &diag);
}

/* The truth's guides, instancing and assignment, with the estimates and random numbers of the fit. */
static void know_guides(struct groom_fit *fit, const struct groom *truth, const struct groom_context *context)
{
    struct groom *groom;
    struct groom_diag diag = {0};
    require(groom_clone(truth, context, &groom, &diag), &diag);
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        groom_draw_random(groom, &groom->operators[o], fit->options.seed);
        memcpy(groom->operators[o].parameter, fit->groom->operators[o].parameter, sizeof groom->operators[o].parameter);
    }
    groom_destroy(fit->groom);
    fit->groom = groom;
}

struct errors { double before[16], after[16]; uint32_t n; };

static void gather(const struct groom *groom, const struct groom *truth, double *error)
{
    uint32_t n = 0, n_parameters;
    for (uint32_t o = 0; o < truth->n_operators; o++) {
        groom_operator_parameters(truth->operators[o].type, &n_parameters);
        for (uint32_t k = 0; k < n_parameters; k++, n++) {
            double right = truth->operators[o].parameter[k];
            error[n] = 100 * ((double)groom->operators[o].parameter[k] - right) / right;
        }
    }
}

static void print(const char *style, const char *guides, const struct groom *truth, const struct errors *errors,
                  double seconds)
{
    uint32_t n = 0, n_parameters;
    printf("%-9s %-11s %5.1f s ", style, guides, seconds);
    for (uint32_t o = 0; o < truth->n_operators; o++) {
        const struct groom_operator_parameter *p = groom_operator_parameters(truth->operators[o].type, &n_parameters);
        for (uint32_t k = 0; k < n_parameters; k++, n++)
            printf(" %s.%s %.0f>%.1f", groom_operator_name(truth->operators[o].type), p[k].name, errors->before[n], errors->after[n]);
    }
    printf("\n");
}

static void losses(const struct groom_fit *fit)
{
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    printf("%21s", "");
    for (uint32_t i = 0; i < report->n_losses; i++)
        if (strcmp(report->losses[i].stage, "operators") == 0)
            printf(" %s %.3g>%.3g", report->losses[i].name, report->losses[i].before, report->losses[i].after);
    printf("\n");
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double all[2][256];
static uint32_t n_all[2];

static void judge(groom_sample_style style, uint32_t n, int known, const struct groom_context *context)
{
    struct groom_sample *sample = sample_of(style, n, 5, context);
    struct groom_fit *fit = fit_of(sample, context);
    struct errors errors = {0};
    step_until(fit, FIT_STAGE_operators, context);
    if (known)
        know_guides(fit, sample->truth, context);
    gather(fit->groom, sample->truth, errors.before);
    double start = now();
    step_until(fit, FIT_STAGE_operators + 1, context);
    double seconds = now() - start;
    gather(fit->groom, sample->truth, errors.after);
    print(groom_sample_style_name(style), known ? "known" : "fitted", sample->truth, &errors, seconds);
    losses(fit);
    uint32_t n_parameters, at = 0;
    for (uint32_t o = 0; o < sample->truth->n_operators; o++) {
        groom_operator_parameters(sample->truth->operators[o].type, &n_parameters);
        for (uint32_t k = 0; k < n_parameters; k++)
            all[known][n_all[known]++] = fabs(errors.after[at++]);
    }
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
    require(groom_pool_create(2, &pool), &diag);
    struct groom_context context = {.pool = pool};
    for (int style = 0; style < GROOM_SAMPLE_STYLE_COUNT; style++)
        for (int known = 1; known >= 0; known--)
            if (only == GROOM_SAMPLE_STYLE_COUNT || only == (groom_sample_style)style)
                judge((groom_sample_style)style, n, known, &context);
    for (int known = 1; known >= 0; known--) {
        qsort(all[known], n_all[known], sizeof(double), compare_doubles);
        const char *name = known ? "known" : "fitted";
        printf("figure operators_%s_median_error %.1f %% of all parameters, all styles\n", name, all[known][n_all[known] / 2]);
        printf("figure operators_%s_largest_error %.1f %% of all parameters, all styles\n", name, all[known][n_all[known] - 1]);
    }
    groom_pool_destroy(pool);
    return 0;
}
