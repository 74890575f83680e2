/* captures as they come: strands of another place or size, heads of another unit or axis, hardly a strand at all */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/refine.h"
#include "groom/mesh.h"
#include "groom/strands.h"
#include "tests/support/fits.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

enum { N = 150, M = 16 };

static struct groom_fit_options draft(void)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.vertices = M;
    options.stages.operators.pairs = 100;
    options.stages.randoms.rounds = 1;
    options.stages.randoms.values = 16;
    return options;
}

static struct groom_sample *sample_of(void) { return guides_sample(GROOM_SAMPLE_WAVY, N, M, 3, NULL); }

/* The capture with these strands behind it, m vertices each. */
static struct groom_strands *with_more(const struct groom_strands *strands, const float (*more)[3], uint32_t n, uint32_t m)
{
    struct groom_strands *all;
    ck_ok(groom_strands_create(strands->n_strands + n, strands->n_vertices + n * m, NULL, &all, NULL));
    memcpy(all->points, strands->points, strands->n_vertices * sizeof *all->points);
    if (n > 0)
        memcpy(all->points + strands->n_vertices, more, (size_t)n * m * sizeof *more);
    memcpy(all->first, strands->first, (strands->n_strands + 1) * sizeof *all->first);
    for (uint32_t i = 1; i <= n; i++)
        all->first[strands->n_strands + i] = strands->n_vertices + i * m;
    return all;
}

static struct groom_fit *fitted(const struct groom_strands *strands, const struct groom_mesh *head)
{
    struct groom_fit_options options = draft();
    struct groom_fit *fit;
    ck_ok(groom_fit_create(strands, head, &options, NULL, &fit, NULL));
    while (!groom_fit_done(fit))
        ck_ok(groom_fit_step(fit, NULL, NULL));
    return fit;
}

static struct groom *groom_of(const struct groom_fit *fit)
{
    struct groom *groom;
    ck_ok(groom_fit_result(fit, NULL, &groom, NULL));
    ck_ok(groom_validate(groom, NULL));
    return groom;
}

/* Three strands 30 m off, and one of 10 m: the others become the groom that they were without them. */
START_TEST(strands_from_elsewhere_change_nothing_for_the_others)
{
    const float far[8][3] = {{30, 1, 0}, {30.1f, 1, 0}, {-30, 1, 0}, {-30.1f, 1, 0}, {0, 1, 31}, {0, 1.2f, 31}, {0, 1.7f, 0}, {0, 1.7f, 10}};
    struct groom_sample *sample = sample_of();
    struct groom_strands *all = with_more(sample->capture, far, 4, 2);
    struct groom_fit *without = fitted(sample->capture, sample->head), *with = fitted(all, sample->head);
    struct groom *a = groom_of(without), *b = groom_of(with);
    ck_assert_uint_eq(with->report.n_outliers, 4);
    ck_assert_uint_eq(without->report.n_outliers, 0);
    ck_assert(fits_is_noted(with, "too far from the others"));
    ck_assert_uint_eq(b->n_strands, a->n_strands + 4);
    ck_assert_mem_eq(a->guides, b->guides, (size_t)a->n_guides * M * sizeof *a->guides);
    ck_assert_mem_eq(a->instancing_weight, b->instancing_weight, (size_t)a->n_strands * a->n_instancing * sizeof(float));
    for (uint32_t o = 0; o < a->n_operators; o++)
        ck_assert_mem_eq(a->operators[o].parameter, b->operators[o].parameter, sizeof a->operators[o].parameter);
    groom_destroy(a);
    groom_destroy(b);
    groom_fit_destroy(without);
    groom_fit_destroy(with);
    groom_strands_destroy(all);
    groom_sample_destroy(sample);
}
END_TEST

/* Where a third is far away there are two heads, not outliers. */
START_TEST(many_that_are_far_are_no_outliers)
{
    struct groom_sample *sample = sample_of();
    float (*far)[3] = malloc(N / 2 * sizeof *far * 2);
    for (uint32_t i = 0; i < N / 2; i++)
        for (int k = 0; k < 2; k++)
            memcpy(far[2 * i + (uint32_t)k], (float[]){20 + 0.001f * (float)i, 1 + 0.1f * (float)k, 0}, sizeof far[0]);
    struct groom_strands *all = with_more(sample->capture, (const float (*)[3])far, N / 2, 2);
    struct groom_fit *fit = fitted(all, NULL);
    ck_assert_uint_eq(fit->report.n_outliers, 0);
    groom_destroy(groom_of(fit));
    groom_fit_destroy(fit);
    groom_strands_destroy(all);
    free(far);
    groom_sample_destroy(sample);
}
END_TEST

/* --- heads in another frame -------------------------------------------------------------------- */

static void refused(const struct groom_sample *sample, const char *words)
{
    struct groom_fit_options options = draft();
    struct groom_fit *fit;
    struct groom_diag diag = {0};
    ck_status(groom_fit_create(sample->capture, sample->head, &options, NULL, &fit, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/head");
    ck_assert_msg(strstr(diag.detail, words) != NULL, "%s", diag.detail);
}

START_TEST(a_head_in_another_unit_is_refused)
{
    static const struct { float scale; const char *words; } cases[] = {
        {100, "if it were 100 times smaller;"}, {0.1f, "if it were 10 times larger;"}, {39.37008f, "if it were 39.37 times smaller;"}};
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        struct groom_sample *sample = sample_of();
        for (uint32_t v = 0; v < sample->head->n_vertices; v++)
            for (int c = 0; c < 3; c++)
                sample->head->points[v][c] *= cases[k].scale;
        refused(sample, cases[k].words);
        groom_sample_destroy(sample);
    }
}
END_TEST

START_TEST(a_head_with_another_axis_up_is_refused)
{
    struct groom_sample *sample = sample_of();
    for (uint32_t v = 0; v < sample->head->n_vertices; v++) { /* z up, read as if y were */
        float *p = sample->head->points[v], y = p[1];
        p[1] = -p[2];
        p[2] = y;
        for (int c = 0; c < 3; c++)
            p[c] *= 100;
    }
    refused(sample, "if it were 100 times smaller and read with up=z;");
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(a_head_that_is_elsewhere_is_told)
{
    struct groom_sample *sample = sample_of();
    for (uint32_t v = 0; v < sample->head->n_vertices; v++)
        sample->head->points[v][0] += 2;
    struct groom_fit *fit = fitted(sample->capture, sample->head);
    ck_assert_uint_eq(fit->report.n_detached, N);
    ck_assert(fits_is_noted(fit, "is it the head of this hair"));
    groom_destroy(groom_of(fit));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- strands of few vertices ------------------------------------------------------------------------ */

/* A strand of n vertices that turns by `turn` at each, now one way, now the other where it zigzags; else a circle's. */
static struct groom_strands *turning(uint32_t n, double turn, int zigzag)
{
    struct groom_strands *strands;
    double angle = 0, x = 0, y = 0;
    ck_ok(groom_strands_create(1, n, NULL, &strands, NULL));
    strands->first[1] = n;
    for (uint32_t j = 0; j < n; j++) {
        memcpy(strands->points[j], (float[]){(float)x, (float)y, 0}, sizeof strands->points[j]);
        x += 0.02 * cos(angle);
        y += 0.02 * sin(angle);
        angle += zigzag && j % 2 ? -turn : turn;
    }
    return strands;
}

START_TEST(few_vertices_become_the_curve_that_they_lie_on)
{
    const double turn = 0.3, radius = 0.01 / sin(turn / 2);
    struct groom_strands *strands = turning(12, turn, 0), *refined;
    double worst = 0, middle[2] = {-radius * sin(-turn / 2), radius * cos(turn / 2)};
    ck_ok(refine_strands(strands, 100, NULL, &refined, NULL));
    ck_assert_uint_ge(refined->n_vertices, 200);
    for (uint32_t v = 0; v < refined->n_vertices; v++) {
        double x = refined->points[v][0] - middle[0], y = refined->points[v][1] - middle[1];
        int inner = v > refined->n_vertices / 11 && v < refined->n_vertices - refined->n_vertices / 11;
        worst = inner ? fmax(worst, fabs(sqrt(x * x + y * y) - radius)) : worst;
    }
    ck_assert_double_lt(worst, 0.02 * radius * (1 - cos(turn / 2))); /* of what chords are off */
    for (uint32_t j = 0; j < 12; j++)
        ck_assert_mem_eq(refined->points[j * ((refined->n_vertices - 1) / 11)], strands->points[j], sizeof strands->points[j]);
    groom_strands_destroy(refined);
    groom_strands_destroy(strands);
}
END_TEST

START_TEST(crimps_and_strands_of_many_vertices_stay_as_they_are)
{
    struct groom_strands *crimped = turning(21, 1.2, 1), *fine = turning(100, 0.3, 0), *refined;
    ck_ok(refine_strands(crimped, 100, NULL, &refined, NULL));
    ck_assert_double_eq_tol(groom_polyline_length((const float (*)[3])refined->points, refined->n_vertices), 0.4, 1e-5);
    groom_strands_destroy(refined);
    ck_ok(refine_strands(fine, 100, NULL, &refined, NULL));
    ck_assert_uint_eq(refined->n_vertices, 100);
    ck_assert_mem_eq(refined->points, fine->points, 100 * sizeof *fine->points);
    groom_strands_destroy(refined);
    groom_strands_destroy(crimped);
    groom_strands_destroy(fine);
}
END_TEST

/* --- odd strands ------------------------------------------------------------------------------------ */

/* A few strands need not be alike: each is its own guide. */
START_TEST(few_strands_keep_their_places)
{
    for (uint32_t n = 1; n <= 12; n += 5) {
        struct groom_sample *sample = sample_of();
        struct groom_strands *few = with_more(sample->capture, NULL, 0, 0);
        for (uint32_t i = 0; i < n; i++) { /* those that are far apart */
            uint32_t from = i * (N / n);
            memmove(few->points + i * M, few->points + few->first[from], M * sizeof *few->points);
        }
        few->n_strands = n;
        few->n_vertices = n * M;
        struct groom_fit *fit = fitted(few, sample->head);
        struct groom *groom = groom_of(fit);
        float x[12 * M][3];
        ck_assert_uint_eq(groom->n_guides, n);
        ck_ok(groom_evaluate(groom, 0, n, x, NULL, NULL));
        for (uint32_t i = 0; i < n; i++) {
            float *tip = x[i * M + M - 1], *wanted = few->points[i * M + M - 1], square = 0;
            for (int c = 0; c < 3; c++)
                square += (tip[c] - wanted[c]) * (tip[c] - wanted[c]);
            ck_assert_float_lt(sqrtf(square), 0.03f);
        }
        groom_destroy(groom);
        groom_fit_destroy(fit);
        groom_strands_destroy(few);
        groom_sample_destroy(sample);
    }
}
END_TEST

/* Copies, stubs beneath the others, strands that hover, one of very many vertices: all at once. */
START_TEST(odd_strands_are_survived)
{
    enum { LONG = 20000 };
    struct groom_sample *sample = sample_of();
    float (*many)[3] = malloc(LONG * sizeof *many);
    for (int j = 0; j < LONG; j++)
        memcpy(many[j], (float[]){0, 1.75f + 1e-5f * (float)j, 0}, sizeof many[0]);
    struct groom_strands *copies = with_more(sample->capture, (const float (*)[3])sample->capture->points, 40, M);
    struct groom_strands *all = with_more(copies, (const float (*)[3])many, 1, LONG);
    for (uint32_t i = 0; i < 30; i++)       /* stubs */
        for (uint32_t j = 0; j < M; j++)
            for (int c = 0; c < 3; c++) {
                const float *root = all->points[all->first[i]];
                float *x = all->points[all->first[i] + j];
                x[c] = root[c] + 0.01f * (x[c] - root[c]);
            }
    for (uint32_t v = all->first[40]; v < all->first[60]; v++) /* hovering 1 cm above the scalp */
        all->points[v][1] += 0.01f;
    for (int with_head = 0; with_head < 2; with_head++) {
        struct groom_fit *fit = fitted(all, with_head ? sample->head : NULL);
        struct groom *groom = groom_of(fit);
        ck_assert_uint_eq(groom->n_strands, N + 41);
        ck_assert(!with_head || fit->report.n_joined >= 15);
        groom_destroy(groom);
        groom_fit_destroy(fit);
    }
    groom_strands_destroy(copies);
    groom_strands_destroy(all);
    free(many);
    groom_sample_destroy(sample);
}
END_TEST

/* No head, and a file that brought scalp coordinates: there is no chart, and each guide has those of a strand. */
START_TEST(coordinates_of_the_file_serve_where_there_is_no_head)
{
    struct groom_sample *sample = sample_of();
    struct groom_strands *strands = sample->capture;
    if (!strands->root_uv)
        ck_assert_ptr_nonnull(strands->root_uv = malloc(N * sizeof *strands->root_uv));
    for (uint32_t i = 0; i < N; i++)
        for (int c = 0; c < 2; c++)
            strands->root_uv[i][c] = 0.5f + 2.0f * strands->points[strands->first[i]][2 * c];
    struct groom_fit *fit = fitted(strands, NULL);
    struct groom *groom = groom_of(fit);
    ck_assert_int_eq(fit->report.scalp, GROOM_SCALP_FILE);
    for (uint32_t g = 0; g < groom->n_guides; g++) {
        uint32_t i = 0;
        while (i < N && memcmp(groom->guide_uv[g], strands->root_uv[i], sizeof *groom->guide_uv) != 0)
            i++;
        ck_assert_msg(i < N, "guide %u stands at (%g, %g), where no strand does", g, groom->guide_uv[g][0], groom->guide_uv[g][1]);
    }
    groom_destroy(groom);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_wild", coordinates_of_the_file_serve_where_there_is_no_head, strands_from_elsewhere_change_nothing_for_the_others, many_that_are_far_are_no_outliers,
           a_head_in_another_unit_is_refused, a_head_with_another_axis_up_is_refused, a_head_that_is_elsewhere_is_told,
           few_vertices_become_the_curve_that_they_lie_on,
           crimps_and_strands_of_many_vertices_stay_as_they_are, few_strands_keep_their_places, odd_strands_are_survived)
