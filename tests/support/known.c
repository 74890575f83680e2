#include "tests/support/known.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "groom/strands.h"

/* --- the program --------------------------------------------------------------------------- */

void known_must(groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "%s: %s\n", groom_status_name(status), diag->detail);
    exit(1);
}

double known_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int known_styles(int argc, char **argv, void (*judge)(groom_sample_style style, const struct known_run *run))
{
    groom_sample_style only = GROOM_SAMPLE_STYLE_COUNT;
    struct groom_context context = {0};
    struct groom_diag diag = {0};
    struct known_run run = {argc > 1 ? (uint32_t)atoi(argv[1]) : 3000, {"", "", ""}, &context};
    for (int k = 0; k < 3 && k + 3 < argc; k++)
        run.more[k] = argv[k + 3];
    if (argc > 2 && strcmp(argv[2], "all") != 0)
        known_must(groom_sample_style_parse(argv[2], &only, &diag), &diag);
    known_must(groom_pool_create(0, &context.pool), &diag);
    for (int style = 0; style < GROOM_SAMPLE_STYLE_COUNT; style++)
        if (only == GROOM_SAMPLE_STYLE_COUNT || only == (groom_sample_style)style)
            judge((groom_sample_style)style, &run);
    groom_pool_destroy(context.pool);
    return 0;
}

/* --- fits --------------------------------------------------------------------------------------- */

struct groom_fit_options known_options(const struct groom_sample *sample, int automatic)
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
    return options;
}

struct groom *known_redrawn(const struct groom *truth, uint64_t seed, const struct groom_context *context)
{
    struct groom *groom;
    struct groom_diag diag = {0};
    known_must(groom_clone(truth, context, &groom, &diag), &diag);
    for (uint32_t o = 0; o < groom->n_operators; o++)
        groom_draw_random(groom, &groom->operators[o], seed);
    return groom;
}

void known_replace(struct groom_fit *fit, struct groom *groom)
{
    groom_destroy(fit->groom);
    fit->groom = groom;
}

/* --- errors ----------------------------------------------------------------------------------------- */

uint32_t known_parameters(const struct groom *groom, const struct groom *truth, struct known_parameter parameter[KNOWN_PARAMETERS])
{
    uint32_t n = 0, n_own;
    for (uint32_t o = 0; o < truth->n_operators; o++) {
        const struct groom_operator_parameter *own = groom_operator_parameters(truth->operators[o].type, &n_own);
        for (uint32_t k = 0; k < n_own && n < KNOWN_PARAMETERS; k++, n++) {
            double right = truth->operators[o].parameter[k], found = groom->operators[o].parameter[k];
            parameter[n].of = groom_operator_name(truth->operators[o].type);
            parameter[n].name = own[k].name;
            parameter[n].error = found == right ? 0 : 100 * (found - right) / fmax(fabs(right), 1e-12);
        }
    }
    return n;
}

void known_add(struct known_errors *errors, const struct known_parameter *parameter, uint32_t n)
{
    for (uint32_t k = 0; k < n && errors->n < sizeof errors->size / sizeof errors->size[0]; k++)
        errors->size[errors->n++] = fabs(parameter[k].error);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void known_print(struct known_errors *errors, const char *name)
{
    uint32_t n_far = 0;
    if (errors->n == 0)
        return;
    qsort(errors->size, errors->n, sizeof *errors->size, compare_doubles);
    for (uint32_t k = 0; k < errors->n; k++)
        n_far += errors->size[k] > 20;
    printf("figure %s_median_error %.1f %% of all parameters of these styles\n", name, errors->size[errors->n / 2]);
    printf("figure %s_largest_error %.1f %% %u of %u are above 20\n", name, errors->size[errors->n - 1], n_far, errors->n);
}

struct loss_strands known_strand_errors(const struct groom_fit *fit, const struct groom *groom, const struct groom_context *context)
{
    struct groom_diag diag = {0};
    struct groom_strands *strands;
    struct loss_strands loss;
    size_t n_points = (size_t)fit->n * fit->m;
    float (*a)[3] = malloc(n_points * sizeof *a), (*b)[3] = malloc(n_points * sizeof *b);
    known_must(groom_strands_create(fit->n, n_points, context, &strands, &diag), &diag);
    for (uint32_t i = 0; i <= fit->n; i++)
        strands->first[i] = i * fit->m;
    known_must(groom_evaluate(groom, 0, fit->n, strands->points, context, &diag), &diag);
    known_must(groom_strands_resample(strands, fit->m, a, context, &diag), &diag);
    for (size_t v = 0; v < n_points; v++)
        for (int c = 0; c < 3; c++)
            b[v][c] = fit->target[v][c] * fit->scale + fit->centre[c];
    known_must(loss_strands((const float (*)[3])a, (const float (*)[3])b, fit->n, fit->m, 0.1, 2, 0.01, context, &loss, &diag), &diag);
    groom_strands_destroy(strands);
    free(a);
    free(b);
    return loss;
}
