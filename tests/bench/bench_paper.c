/* What stage `randoms` reaches and takes beside the paper's own method with its full step counts
 * (`stages.randoms.method = "paper"`), from the same state of the same fit.
 *
 *     bench_paper [n_strands [style]] */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tests/support/guides.h"

static const char *const names[] = {"L_rand", "spectra", "direction", "length", "vertex"};

struct end { double seconds, loss[5], before[5]; };

static struct end run(const struct groom_sample *sample, groom_fit_method method, const struct groom_context *context)
{
    struct groom_fit_options options;
    struct timespec from, to;
    struct end end = {0};
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    options.stages.randoms.method = method;
    struct groom_fit *fit = guides_fit(sample, &options, "randoms", context);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
    guides_fit_on(fit, "", context);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    end.seconds = (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    for (uint32_t i = 0; i < report->n_losses; i++)
        for (int k = 0; k < 5; k++)
            if (strcmp(report->losses[i].stage, "randoms") == 0 && strcmp(report->losses[i].name, names[k]) == 0) {
                end.loss[k] = report->losses[i].after;
                end.before[k] = report->losses[i].before;
            }
    groom_fit_destroy(fit);
    return end;
}

int main(int argc, char **argv)
{
    uint32_t n = argc > 1 ? (uint32_t)atoi(argv[1]) : 1000;
    groom_sample_style style = GROOM_SAMPLE_CURLY;
    struct groom_pool *pool;
    if ((argc > 2 && groom_sample_style_parse(argv[2], &style, NULL) != GROOM_OK) || groom_pool_create(0, &pool) != GROOM_OK)
        return 1;
    struct groom_context context = {.pool = pool};
    struct groom_sample *sample = guides_sample(style, n, 100, 5, &context);
    struct end direct = run(sample, GROOM_FIT_DIRECT, &context), paper = run(sample, GROOM_FIT_PAPER, &context);
    for (int k = 0; k < 5; k++)
        printf("figure paper_randoms_%s %.4g 1 at the end; by the paper's 3 000 steps %.4g, before %.4g\n", names[k],
               direct.loss[k], paper.loss[k], direct.before[k]);
    printf("figure paper_randoms_time_ratio %.1f 1 processor time of the paper's 3 000 steps (%.1f s) over ours (%.2f s), %u strands x 100\n",
           paper.seconds / direct.seconds, paper.seconds, direct.seconds, n);
    groom_sample_destroy(sample);
    groom_pool_destroy(pool);
    return 0;
}
