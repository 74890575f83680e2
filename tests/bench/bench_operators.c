/* What stage `operators` finds of known parameters, style by style: with the truth's own guides, and with
 * those of the stages before it. 3 000 strands x 100.
 *
 *     bench_operators [n_strands [style|all]] */
#include <stdio.h>
#include <string.h>

#include "tests/support/known.h"

/* The truth's guides, instancing and assignment, with the estimates and random numbers of the fit. */
static void know_guides(struct groom_fit *fit, const struct groom *truth, const struct groom_context *context)
{
    struct groom *groom = known_redrawn(truth, fit->options.seed, context);
    for (uint32_t o = 0; o < groom->n_operators; o++)
        memcpy(groom->operators[o].parameter, fit->groom->operators[o].parameter, sizeof groom->operators[o].parameter);
    known_replace(fit, groom);
}

static void print(const char *style, const char *guides, const struct known_parameter *before, const struct known_parameter *after,
                  uint32_t n, double seconds)
{
    printf("%-9s %-11s %5.1f s ", style, guides, seconds);
    for (uint32_t k = 0; k < n; k++)
        printf(" %s.%s %.0f>%.1f", after[k].of, after[k].name, before[k].error, after[k].error);
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

static struct known_errors of_known, of_fitted;

static void judge_with(groom_sample_style style, int known, const struct known_run *run)
{
    const struct groom_context *context = run->context;
    struct groom_sample *sample = guides_sample(style, run->n_strands, 100, 5, context);
    struct groom_fit_options options = known_options(sample, 0);
    struct groom_fit *fit = guides_fit(sample, &options, "operators", context);
    struct known_parameter before[KNOWN_PARAMETERS], after[KNOWN_PARAMETERS];
    if (known)
        know_guides(fit, sample->truth, context);
    known_parameters(fit->groom, sample->truth, before);
    double start = known_seconds();
    guides_fit_on(fit, "randoms", context);
    double seconds = known_seconds() - start;
    uint32_t n = known_parameters(fit->groom, sample->truth, after);
    print(groom_sample_style_name(style), known ? "known" : "fitted", before, after, n, seconds);
    losses(fit);
    known_add(known ? &of_known : &of_fitted, after, n);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

static void judge(groom_sample_style style, const struct known_run *run)
{
    judge_with(style, 1, run);
    judge_with(style, 0, run);
}

int main(int argc, char **argv)
{
    int status = known_styles(argc, argv, judge);
    known_print(&of_known, "operators_known");
    known_print(&of_fitted, "operators_fitted");
    return status;
}
