/* How near stage `randoms` brings strands to those of a known truth, style by style: with the truth's own
 * guides and operators, and after whole fits. Errors are means over strands, beside those of the truth with
 * other random numbers.
 *
 *     bench_randoms [n_strands [style|all]] */
#include <stdio.h>

#include "tests/support/known.h"

static void judge_with(groom_sample_style style, int known, const struct known_run *run)
{
    const struct groom_context *context = run->context;
    const char *name = groom_sample_style_name(style), *guides = known ? "known" : "fitted";
    struct groom_sample *sample = guides_sample(style, run->n_strands, 100, 5, context);
    struct groom_fit_options options = known_options(sample, 0);
    struct groom_fit *fit = guides_fit(sample, &options, known ? "instance_weights" : "randoms", context);
    struct groom *drawn = known_redrawn(sample->truth, fit->options.seed, context);
    struct loss_strands other = known_strand_errors(fit, drawn, context);
    if (known) {
        known_replace(fit, drawn);
        fit->stage = FIT_STAGE_randoms;
    } else {
        groom_destroy(drawn);
    }
    struct loss_strands before = known_strand_errors(fit, fit->groom, context);
    double start = known_seconds();
    guides_fit_on(fit, "", context);
    double seconds = known_seconds() - start;
    struct loss_strands after = known_strand_errors(fit, fit->groom, context);
    printf("figure randoms_%s_%s_direction %.3f 1 of the error of the truth with other random numbers (%.4f); before: %.3f\n", guides, name,
           after.direction / other.direction, other.direction, before.direction / other.direction);
    printf("figure randoms_%s_%s_vertex %.3f 1 of the error of the truth with other random numbers (%.2f mm); before: %.3f\n", guides, name,
           after.vertex / other.vertex, 1e3 * other.vertex, before.vertex / other.vertex);
    printf("figure randoms_%s_%s_seconds %.2f s of processor time, stage randoms; Eq. 19 %.4g, before %.4g, truth with other numbers %.4g; spectra %.4g %.4g\n",
           guides, name, seconds, after.total, before.total, other.total, after.spectra, before.spectra);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

static void judge(groom_sample_style style, const struct known_run *run)
{
    judge_with(style, 1, run);
    judge_with(style, 0, run);
}

int main(int argc, char **argv) { return known_styles(argc, argv, judge); }
