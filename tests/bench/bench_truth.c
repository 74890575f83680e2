/* What whole fits recover of known truths, style by style: parameters, bundles, guides and strands.
 * Operators are known; the counts of guides are the truth's, or with `auto` the fit's own.
 *
 *     bench_truth [n_strands [style|all [auto|counts [seed]]]] */
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
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void require(groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "bench_truth: %s: %s\n", groom_status_name(status), diag->detail);
    exit(1);
}

/* --- fits ----------------------------------------------------------------------------------- */

static struct groom_fit *fit_of(const struct groom_sample *sample, int automatic, const struct groom_context *context)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    if (!automatic) {
        options.guides = sample->truth->n_guides;
        options.operator_guides = sample->truth->n_operator_guides;
    }
    options.seed = 77;
    options.operators_auto = 0;
    options.n_operators = sample->truth->n_operators;
    for (uint32_t o = 0; o < options.n_operators; o++)
        options.operators[o] = sample->truth->operators[o].type;
    return guides_fit(sample, &options, "instance_weights", context);
}

/* The truth with other random numbers. */
static struct groom *redrawn(const struct groom *truth, const struct groom_context *context)
{
    struct groom *groom;
    struct groom_diag diag = {0};
    require(groom_clone(truth, context, &groom, &diag), &diag);
    for (uint32_t o = 0; o < groom->n_operators; o++)
        groom_draw_random(groom, &groom->operators[o], 4711);
    return groom;
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

/* --- figures ---------------------------------------------------------------------------------- */

static double all[4096];
static uint32_t n_all, n_far;

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void print_parameters(const struct groom *groom, const struct groom *truth, int count)
{
    uint32_t n_parameters;
    for (uint32_t o = 0; o < truth->n_operators; o++) {
        const struct groom_operator_parameter *p = groom_operator_parameters(truth->operators[o].type, &n_parameters);
        for (uint32_t k = 0; k < n_parameters; k++) {
            double right = truth->operators[o].parameter[k];
            double error = 100 * ((double)groom->operators[o].parameter[k] - right) / right;
            printf(" %.2s.%.9s %+.1f", groom_operator_name(truth->operators[o].type), p[k].name, error);
            if (count && n_all < 4096) {
                n_far += fabs(error) > 20;
                all[n_all++] = fabs(error);
            }
        }
    }
}

static void judge(groom_sample_style style, uint32_t n, int automatic, uint64_t seed, const struct groom_context *context)
{
    struct groom_sample *sample = guides_sample(style, n, 100, seed, context);
    double begin = now();
    struct groom_fit *fit = fit_of(sample, automatic, context);
    struct guides_quality initial, solved, final;
    guides_measure(fit, sample, &initial);
    double bundles = purity(fit->groom, sample->truth);
    guides_fit_on(fit, "operators", context);
    guides_measure(fit, sample, &solved);
    guides_fit_on(fit, "randoms", context);
    printf("%-8s operators:", groom_sample_style_name(style));
    print_parameters(fit->groom, sample->truth, 0);
    guides_fit_on(fit, "", context);
    guides_measure(fit, sample, &final);
    struct groom *other = redrawn(sample->truth, context);
    struct loss_strands worst = errors_of(fit, other, context), ours = errors_of(fit, fit->groom, context);
    printf("\n%-8s end:      ", groom_sample_style_name(style));
    print_parameters(fit->groom, sample->truth, 1);
    printf("\n%-8s guides %.2f > %.2f > %.2f mm (%.2f)  bundles %.2f > %.2f  direction %.2f vertex %.2f of %.1f mm  %.0f s; shapes %.2f > %.2f > %.2f\n",
           groom_sample_style_name(style), 1e3 * initial.strands, 1e3 * solved.strands, 1e3 * final.strands,
           final.strands / initial.strands, bundles, purity(fit->groom, sample->truth), ours.direction / worst.direction,
           ours.vertex / worst.vertex, 1e3 * worst.vertex, now() - begin, 1e3*initial.shapes, 1e3*solved.shapes, 1e3*final.shapes);
    fflush(stdout);
    groom_destroy(other);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

int main(int argc, char **argv)
{
    uint32_t n = argc > 1 ? (uint32_t)atoi(argv[1]) : 3000;
    int automatic = argc > 3 && strcmp(argv[3], "auto") == 0;
    uint64_t seed = argc > 4 ? (uint64_t)atoi(argv[4]) : 5;
    struct groom_pool *pool;
    struct groom_diag diag = {0};
    require(groom_pool_create(0, &pool), &diag);
    struct groom_context context = {.pool = pool};
    for (int style = 0; style < GROOM_SAMPLE_STYLE_COUNT; style++)
        if (argc < 3 || strcmp(argv[2], "all") == 0 || strstr(argv[2], groom_sample_style_name((groom_sample_style)style)))
            judge((groom_sample_style)style, n, automatic, seed, &context);
    qsort(all, n_all, sizeof *all, compare_doubles);
    printf("figure truth_median_error %.1f %% of all parameters of these styles after the fit\n", all[n_all / 2]);
    printf("figure truth_largest_error %.1f %% %u of %u are above 20\n", all[n_all - 1], n_far, n_all);
    groom_pool_destroy(pool);
    return 0;
}
