/* Whole fits at quality `standard`, at the sizes of Chang et al. 2025, Table 1: time of each stage, losses at
 * the end, peak memory. Each size runs in a process of its own.
 *
 *     bench_fit [14k | 30k | 166k] */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "groom/fit.h"
#include "groom/sample.h"
#include "groom/strands.h"

#define MAX_STAGES 8

struct size {
    const char *name;
    groom_sample_style style;
    uint32_t n_strands, n_guides, n_operator_guides;
    double limit; /* seconds on two cores */
};

static const struct size sizes[] = {
    {"14k", GROOM_SAMPLE_CURLY, 14000, 500, 500, 12},
    {"30k", GROOM_SAMPLE_CURLY, 30000, 1000, 250, 60},
    {"166k", GROOM_SAMPLE_WAVY, 166000, 500, 125, 192},
};
#define N_SIZES (sizeof sizes / sizeof sizes[0])

static double seconds_of(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void check(groom_status st, const struct groom_diag *diag)
{
    if (st == GROOM_OK)
        return;
    fprintf(stderr, "bench_fit: %s: %s\n", groom_status_name(st), diag->detail);
    exit(1);
}

/* --- memory -------------------------------------------------------------------------- */

/* Forget the peak that making the capture has left. */
static void forget_peak(void)
{
    FILE *file = fopen("/proc/self/clear_refs", "w");
    if (file) {
        fputs("5\n", file);
        fclose(file);
    }
}

static double peak_bytes(void)
{
    char line[256];
    double kib = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file))
        if (strncmp(line, "VmHWM:", 6) == 0)
            kib = strtod(line + 6, NULL);
    if (file)
        fclose(file);
    return 1024 * kib;
}

/* --- one size --------------------------------------------------------------------------- */

struct times { double stage[MAX_STAGES], stage_cpu[MAX_STAGES], whole, cpu, longest; };

static struct groom_fit *run(const struct groom_sample *sample, const struct groom_fit_options *options,
                             const struct groom_context *context, struct times *times)
{
    struct groom_fit *fit;
    struct groom_diag diag = {0};
    double start = seconds_of(CLOCK_MONOTONIC), cpu = seconds_of(CLOCK_PROCESS_CPUTIME_ID), begin = start;
    check(groom_fit_create(sample->capture, sample->head, options, context, &fit, &diag), &diag);
    times->stage[0] = seconds_of(CLOCK_MONOTONIC) - begin; /* making the target counts to the first */
    times->stage_cpu[0] = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - cpu;
    while (!groom_fit_done(fit)) {
        struct groom_fit_progress progress;
        groom_fit_progress(fit, &progress);
        double cpu_begin = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
        begin = seconds_of(CLOCK_MONOTONIC);
        check(groom_fit_step(fit, context, &diag), &diag);
        double seconds = seconds_of(CLOCK_MONOTONIC) - begin;
        times->stage[progress.index % MAX_STAGES] += seconds;
        times->stage_cpu[progress.index % MAX_STAGES] += seconds_of(CLOCK_PROCESS_CPUTIME_ID) - cpu_begin;
        times->longest = seconds > times->longest ? seconds : times->longest;
    }
    times->whole = seconds_of(CLOCK_MONOTONIC) - start;
    times->cpu = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - cpu;
    return fit;
}

static void print(const struct size *size, const struct groom_fit *fit, const struct times *times, double ratio)
{
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    printf("figure fit_%s_seconds %.2f s %u strands x 100, %u guides, %u operator guides; at most %.0f on two cores; %.2f s of processor time\n",
           size->name, times->whole, size->n_strands, size->n_guides, size->n_operator_guides, size->limit, times->cpu);
    for (uint32_t s = 0; groom_fit_stage_name(s) && s < MAX_STAGES; s++)
        printf("figure fit_%s_%s_seconds %.3f s of it; %.3f s of processor time\n", size->name, groom_fit_stage_name(s),
               times->stage[s], times->stage_cpu[s]);
    printf("figure fit_%s_longest_step_seconds %.3f s what a crash can lose of it\n", size->name, times->longest);
    printf("figure fit_%s_memory_ratio %.2f 1 peak memory over the strands as float32; at most 12\n", size->name, ratio);
    for (uint32_t i = 0; i < report->n_losses; i++)
        printf("figure fit_%s_loss_%s_%s %.6g 1 before the stage: %.6g\n", size->name, report->losses[i].stage,
               report->losses[i].name, report->losses[i].after, report->losses[i].before);
}

static void bench(const struct size *size)
{
    struct groom_sample_options sample_options;
    struct groom_fit_options options;
    struct groom_sample *sample;
    struct groom_pool *pool;
    struct groom_diag diag = {0};
    struct times times = {0};
    check(groom_pool_create(0, &pool), &diag);
    struct groom_context context = {.pool = pool};
    groom_sample_options_capture(size->style, &sample_options);
    sample_options.n_strands = size->n_strands;
    check(groom_sample_create(&sample_options, &context, &sample, &diag), &diag);
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = size->n_guides;
    options.operator_guides = size->n_operator_guides;
    forget_peak();
    struct groom_fit *fit = run(sample, &options, &context, &times);
    print(size, fit, &times, peak_bytes() / (12.0 * sample->capture->n_vertices));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    groom_pool_destroy(pool);
}

/* --- all ------------------------------------------------------------------------------------ */

static int bench_alone(const char *program, const char *name)
{
    int status = 1;
    fflush(stdout);
    pid_t child = fork();
    if (child == 0) {
        execl(program, program, name, (char *)NULL);
        _exit(127);
    }
    return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

int main(int argc, char **argv)
{
    int all_well = 1;
    for (size_t i = 0; i < N_SIZES; i++)
        if (argc > 1 && strcmp(argv[1], sizes[i].name) == 0)
            bench(&sizes[i]);
        else if (argc == 1)
            all_well &= bench_alone(argv[0], sizes[i].name);
    return all_well ? 0 : 1;
}
