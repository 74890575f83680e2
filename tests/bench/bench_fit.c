/* Time of the stages of a fit, on captures of the project's own generator. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "groom/fit.h"
#include "groom/sample.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void check(groom_status st, const struct groom_diag *diag)
{
    if (st == GROOM_OK)
        return;
    fprintf(stderr, "bench_fit: %s: %s\n", groom_status_name(st), diag->detail);
    exit(1);
}

static struct groom_sample *capture_of(uint32_t n_strands, const struct groom_context *context)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    struct groom_diag diag = {0};
    groom_sample_options_capture(GROOM_SAMPLE_WAVY, &options);
    options.n_strands = n_strands;
    check(groom_sample_create(&options, context, &sample, &diag), &diag);
    return sample;
}

/* Runs stage 0 and returns its seconds; the time of its longest step in *longest. */
static double initialize(const struct groom_sample *sample, const struct groom_fit_options *options,
                         const struct groom_context *context, double *longest)
{
    struct groom_fit *fit;
    struct groom_fit_progress progress = {0};
    struct groom_diag diag = {0};
    double begin = now();
    check(groom_fit_create(sample->capture, sample->head, options, context, &fit, &diag), &diag);
    *longest = now() - begin;
    while (!groom_fit_done(fit) && progress.index == 0) {
        double step = now();
        check(groom_fit_step(fit, context, &diag), &diag);
        step = now() - step;
        *longest = step > *longest ? step : *longest;
        groom_fit_progress(fit, &progress);
    }
    double seconds = now() - begin;
    groom_fit_destroy(fit);
    return seconds;
}

int main(void)
{
    struct groom_pool *pool;
    struct groom_context context = {0};
    struct groom_fit_options options;
    double longest;
    if (groom_pool_create(0, &pool) != GROOM_OK)
        return 1;
    context.pool = pool;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = 1000;
    options.operator_guides = 250;

    double begin = now();
    struct groom_sample *sample = capture_of(30000, &context);
    printf("figure sample_30k_seconds %.3f s generator: 30 000 strands x 100\n", now() - begin);
    printf("figure initialize_30k_seconds %.3f s stage initialize: 30 000 strands x 100, 1 000 guides, 250 operator guides\n",
           initialize(sample, &options, &context, &longest));
    printf("figure initialize_30k_longest_step_seconds %.3f s longest step of it, between two checkpoints\n", longest);
    groom_sample_destroy(sample);

    sample = capture_of(100000, &context);
    options.guides = 500;
    options.operator_guides = 125;
    printf("figure initialize_100k_seconds %.3f s stage initialize: 100 000 strands x 100, 500 guides, 125 operator guides\n",
           initialize(sample, &options, &context, &longest));
    groom_sample_destroy(sample);
    groom_pool_destroy(pool);
    return 0;
}
