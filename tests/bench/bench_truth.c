/* What whole fits recover of known truths, style by style: parameters, bundles, guides and strands.
 * Operators are known; the counts of guides are the truth's, or with `auto` the fit's own.
 *
 *     bench_truth [n_strands [style|all [auto|counts [seed]]]] */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/known.h"

/* The share of strands in the bundle of the truth that most strands of their operator guide are in. */
static double purity(const struct groom *groom, const struct groom *truth)
{
    uint32_t n = groom->n_strands, k = truth->n_operator_guides, pure = 0;
    uint32_t *count = calloc((size_t)groom->n_operator_guides * k, sizeof *count);
    for (uint32_t i = 0; i < n; i++)
        count[(size_t)groom->operator_guide_of[i] * k + truth->operator_guide_of[i]]++;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        uint32_t most = 0;
        for (uint32_t t = 0; t < k; t++)
            most = count[(size_t)o * k + t] > most ? count[(size_t)o * k + t] : most;
        pure += most;
    }
    free(count);
    return (double)pure / n;
}

static void print_parameters(const char *style, const char *when, const struct known_parameter *parameter, uint32_t n)
{
    printf("%-8s %-10s", style, when);
    for (uint32_t k = 0; k < n; k++)
        printf(" %.2s.%.9s %+.1f", parameter[k].of, parameter[k].name, parameter[k].error);
    printf("\n");
}

static struct known_errors all;

static void judge(groom_sample_style style, const struct known_run *run)
{
    const struct groom_context *context = run->context;
    const char *name = groom_sample_style_name(style);
    uint64_t seed = run->more[1][0] ? (uint64_t)atoi(run->more[1]) : 5;
    struct groom_sample *sample = guides_sample(style, run->n_strands, 100, seed, context);
    struct groom_fit_options options = known_options(sample, strcmp(run->more[0], "auto") == 0);
    struct known_parameter parameter[KNOWN_PARAMETERS];
    struct guides_quality initial, solved, final;
    double begin = known_seconds();
    struct groom_fit *fit = guides_fit(sample, &options, "instance_weights", context);
    guides_measure(fit, sample, &initial);
    double bundles = purity(fit->groom, sample->truth);
    guides_fit_on(fit, "operators", context);
    guides_measure(fit, sample, &solved);
    guides_fit_on(fit, "randoms", context);
    print_parameters(name, "operators:", parameter, known_parameters(fit->groom, sample->truth, parameter));
    guides_fit_on(fit, "", context);
    guides_measure(fit, sample, &final);
    uint32_t n = known_parameters(fit->groom, sample->truth, parameter);
    print_parameters(name, "end:", parameter, n);
    known_add(&all, parameter, n);
    struct groom *other = known_redrawn(sample->truth, 4711, context);
    struct loss_strands worst = known_strand_errors(fit, other, context), ours = known_strand_errors(fit, fit->groom, context);
    printf("%-8s guides %.2f > %.2f > %.2f mm (%.2f)  bundles %.2f > %.2f  direction %.2f vertex %.2f of %.1f mm  %.0f s; shapes %.2f > %.2f > %.2f\n",
           name, 1e3 * initial.strands, 1e3 * solved.strands, 1e3 * final.strands, final.strands / initial.strands, bundles,
           purity(fit->groom, sample->truth), ours.direction / worst.direction, ours.vertex / worst.vertex, 1e3 * worst.vertex,
           known_seconds() - begin, 1e3 * initial.shapes, 1e3 * solved.shapes, 1e3 * final.shapes);
    fflush(stdout);
    groom_destroy(other);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

int main(int argc, char **argv)
{
    int status = known_styles(argc, argv, judge);
    known_print(&all, "truth");
    return status;
}
