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

#define MAX_STAGES 8

struct times { double stage[MAX_STAGES], longest; };

/* Seconds of each stage (making the target counts to the first) and of the longest step. */
static struct times time_stages(const struct groom_sample *sample, const struct groom_fit_options *options,
                                const struct groom_context *context)
{
    struct times times = {0};
    struct groom_fit *fit;
    struct groom_diag diag = {0};
    double begin = now();
    check(groom_fit_create(sample->capture, sample->head, options, context, &fit, &diag), &diag);
    times.stage[0] = times.longest = now() - begin;
    while (!groom_fit_done(fit)) {
        struct groom_fit_progress progress;
        groom_fit_progress(fit, &progress);
        begin = now();
        check(groom_fit_step(fit, context, &diag), &diag);
        double seconds = now() - begin;
        times.stage[progress.index % MAX_STAGES] += seconds;
        times.longest = seconds > times.longest ? seconds : times.longest;
    }
    groom_fit_destroy(fit);
    return times;
}

static void print_stages(const struct times *times, const char *size, const char *words)
{
    for (uint32_t s = 0; groom_fit_stage_name(s) && s < MAX_STAGES; s++)
        printf("figure %s_%s_seconds %.3f s %s\n", groom_fit_stage_name(s), size, times->stage[s], words);
    printf("figure longest_step_%s_seconds %.3f s what a crash can lose of it\n", size, times->longest);
}

int main(void)
{
    struct groom_pool *pool;
    struct groom_context context = {0};
    struct groom_fit_options options;
    if (groom_pool_create(0, &pool) != GROOM_OK)
        return 1;
    context.pool = pool;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = 1000;
    options.operator_guides = 250;

    double begin = now();
    struct groom_sample *sample = capture_of(30000, &context);
    printf("figure sample_30k_seconds %.3f s generator: 30 000 strands x 100\n", now() - begin);
    struct times times = time_stages(sample, &options, &context);
    print_stages(&times, "30k", "30 000 strands x 100, 1 000 guides, 250 operator guides");
    groom_sample_destroy(sample);

    sample = capture_of(100000, &context);
    options.guides = 500;
    options.operator_guides = 125;
    times = time_stages(sample, &options, &context);
    print_stages(&times, "100k", "100 000 strands x 100, 500 guides, 125 operator guides");
    groom_sample_destroy(sample);
    groom_pool_destroy(pool);
    return 0;
}
