/* Where the stages end and what they take, beside the paper's own methods with the paper's step counts
 * (`stages.*.method = "paper"`), from the same strands: two whole fits, stage by stage.
 *
 *     bench_paper [n_strands [style [share_of_steps]]]
 *
 * Losses are those of the reports, as each stage ends (fit.h says which equations they are). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/known.h"

struct run { double seconds[FIT_N_STAGES]; struct groom_fit_report report; };

static void scale_steps(uint32_t *iterations, double share) { *iterations = (uint32_t)(share * *iterations + 0.5); }

static struct groom_fit_options options_of(const struct groom_sample *sample, groom_fit_method method, double share)
{
    struct groom_fit_options options = known_options(sample, 0);
    options.stages.instance_weights.method = options.stages.guides.method = method;
    options.stages.operators.method = options.stages.randoms.method = method;
    scale_steps(&options.stages.instance_weights.iterations, share);
    scale_steps(&options.stages.guides.iterations, share);
    scale_steps(&options.stages.operators.iterations, share);
    scale_steps(&options.stages.operators.alternate, share);
    options.stages.operators.alternate += options.stages.operators.alternate == 0;
    scale_steps(&options.stages.randoms.iterations, share);
    return options;
}

static struct run fit_by(const struct groom_sample *sample, groom_fit_method method, double share,
                         const struct groom_context *context)
{
    struct groom_fit_options options = options_of(sample, method, share);
    struct run run = {0};
    struct groom_fit *fit = guides_fit(sample, &options, "initialize", context);
    for (uint32_t stage = 0; stage < FIT_N_STAGES; stage++) {
        double start = known_seconds();
        guides_fit_on(fit, stage + 1 < FIT_N_STAGES ? groom_fit_stage_name(stage + 1) : "", context);
        run.seconds[stage] = known_seconds() - start;
        fprintf(stderr, "bench_paper: %s, %s: %.2f s\n", method == GROOM_FIT_PAPER ? "paper" : "ours",
                groom_fit_stage_name(stage), run.seconds[stage]);
    }
    run.report = *groom_fit_get_report(fit);
    groom_fit_destroy(fit);
    return run;
}

static const struct groom_fit_loss *loss_of(const struct groom_fit_report *report, const struct groom_fit_loss *like)
{
    for (uint32_t i = 0; i < report->n_losses; i++)
        if (strcmp(report->losses[i].stage, like->stage) == 0 && strcmp(report->losses[i].name, like->name) == 0)
            return &report->losses[i];
    return NULL;
}

static void print(const struct run *ours, const struct run *paper)
{
    double all[2] = {0};
    for (uint32_t stage = 0; stage < FIT_N_STAGES; stage++) {
        const char *name = groom_fit_stage_name(stage);
        all[0] += ours->seconds[stage];
        all[1] += paper->seconds[stage];
        printf("figure paper_%s_seconds %.3f s of processor time; by the paper's method %.1f\n", name, ours->seconds[stage],
               paper->seconds[stage]);
        for (uint32_t i = 0; i < ours->report.n_losses; i++) {
            const struct groom_fit_loss *loss = &ours->report.losses[i], *other = loss_of(&paper->report, loss);
            if (strcmp(loss->stage, name) == 0 && other)
                printf("figure paper_%s_%s %.4g 1 at the end, %.4g before; by the paper's method %.4g, %.4g before\n", name,
                       loss->name, loss->after, loss->before, other->after, other->before);
        }
    }
    printf("figure paper_time_ratio %.1f 1 processor time of the paper's methods (%.1f s) over ours (%.2f s)\n",
           all[1] / all[0], all[1], all[0]);
}

int main(int argc, char **argv)
{
    uint32_t n = argc > 1 ? (uint32_t)atoi(argv[1]) : 300;
    double share = argc > 3 ? atof(argv[3]) : 1;
    groom_sample_style style = GROOM_SAMPLE_CURLY;
    struct groom_pool *pool;
    if ((argc > 2 && groom_sample_style_parse(argv[2], &style, NULL) != GROOM_OK) || groom_pool_create(0, &pool) != GROOM_OK)
        return 1;
    struct groom_context context = {.pool = pool};
    struct groom_sample *sample = guides_sample(style, n, 100, 5, &context);
    printf("%u strands x 100, %s, %u guides, %u operator guides, %g of the paper's step counts\n", n,
           groom_sample_style_name(style), sample->truth->n_guides, sample->truth->n_operator_guides, share);
    struct run ours = fit_by(sample, GROOM_FIT_DIRECT, 1, &context), paper = fit_by(sample, GROOM_FIT_PAPER, share, &context);
    print(&ours, &paper);
    groom_sample_destroy(sample);
    groom_pool_destroy(pool);
    return 0;
}
