/* Strands that no head grows: conversion must answer with sound super-helices whatever finite vertices it
 * is given. */
#include <math.h>
#include <stdlib.h>

#include "groom/curvature.h"
#include "groom/random.h"
#include "tests/support/test.h"

static float wild(uint32_t strand, uint32_t k, uint32_t c)
{
    struct groom_random_key key = {31, 3};
    uint32_t draw = 4 * k + c;
    switch (strand % 8) {
    case 0: return 0.01f * (float)groom_random_normal(key, strand, draw);                         /* a cloud */
    case 1: return groom_random_below(key, strand, draw, 2) ? 0.01f : 0.0f;                        /* corners of a cube */
    case 2: return 1e18f * (float)groom_random_normal(key, strand, draw);                         /* out of the solar system */
    case 3: return 1e-20f * (float)groom_random_normal(key, strand, draw);                        /* below an atom */
    case 4: return c == 0 ? 0.01f * (float)(k % 2) : 0.0f;                                          /* there and back */
    case 5: return 5.0f + 1e-6f * (float)groom_random_normal(key, strand, draw);                  /* float32 grains */
    case 6: return k == 7 ? 1e6f : 0.001f * (float)(k * (c + 1));                                   /* one outlier */
    default: return powf(10.0f, (float)groom_random_normal(key, strand, draw) - 3.0f);            /* all scales at once */
    }
}

static struct groom_strands *wild_strands(uint32_t n)
{
    struct groom_strands *strands;
    uint32_t total = 0;
    for (uint32_t i = 0; i < n; i++)
        total += 1 + i * 7 % 40;
    ck_ok(groom_strands_create(n, total, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++) {
        strands->first[i + 1] = strands->first[i] + 1 + i * 7 % 40;
        for (uint32_t k = strands->first[i]; k < strands->first[i + 1]; k++)
            for (uint32_t c = 0; c < 3; c++)
                strands->points[k][c] = wild(i, k - strands->first[i], c);
    }
    return strands;
}

START_TEST(wild_strands_become_sound_superhelices)
{
    struct groom_strands *strands = wild_strands(400);
    float(*back)[3] = calloc(strands->n_vertices, sizeof *back);
    for (uint32_t n_elements = 0; n_elements <= 40; n_elements += 20) {
        struct groom_conversion_options options = groom_conversion_options_default();
        struct groom_conversion *c;
        struct groom_diag diag = {0};
        options.n_elements = n_elements;
        ck_ok(groom_strands_convert(strands, &options, NULL, &c, NULL));
        groom_status st = groom_superhelices_check(c->helices, &diag);
        ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
        for (uint32_t i = 0; i < c->n_strands; i++)
            ck_assert_msg(isfinite(c->reports[i].error_max_m) && isfinite(c->reports[i].length_change), "strand %u", i);
        ck_ok(groom_superhelices_sample_at(c->helices, c->first, c->at, back, NULL, NULL));
        for (uint32_t k = 0; k < strands->n_vertices; k++)
            for (int i = 0; i < 3; i++)
                ck_assert(isfinite(back[k][i]));
        groom_conversion_destroy(c);
    }
    free(back);
    groom_strands_destroy(strands);
}
END_TEST

/* --- hostile, but with a right answer ------------------------------------------------------- */

static double largest_share(const struct groom_strands *strands, const struct groom_conversion *c, uint32_t i)
{
    uint32_t n = strands->first[i + 1] - strands->first[i];
    double length = groom_polyline_length((const float(*)[3])strands->points + strands->first[i], n);
    return length > 0.0 ? (double)c->reports[i].error_max_m * (n - 1) / length : 0.0;
}

/* Coils and random walks of every size; every third vertex is there twice or three times where `twice`. */
static struct groom_strands *sized(uint32_t n, uint32_t m, int twice)
{
    static const double size[] = {1e-9, 1e-6, 1e-3, 1.0, 1e3};
    struct groom_random_key key = {77, 1};
    struct groom_strands *strands;
    ck_ok(groom_strands_create(n, (uint64_t)n * m, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++) {
        double scale = size[i % 5], p[3] = {0.0, 0.0, 0.0};
        strands->first[i + 1] = strands->first[i] + m;
        for (uint32_t k = 0; k < m; k++) {
            int repeated = twice && k % 3 == 1 + i % 2;
            double angle = 0.5 * k;
            if (!repeated && i % 2)
                p[0] = 0.2 * cos(angle), p[1] = 0.04 * k, p[2] = 0.2 * sin(angle);
            else if (!repeated)
                for (uint32_t c = 0; c < 3; c++)
                    p[c] += 0.03 * (c == 1) + 0.01 * groom_random_normal(key, i, 3 * k + c);
            for (int c = 0; c < 3; c++)
                strands->points[strands->first[i] + k][c] = (float)(scale * p[c]);
        }
    }
    return strands;
}

static void assert_met(struct groom_strands *strands, double share, double length_change)
{
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_conversion *c;
    ck_ok(groom_strands_convert(strands, &options, NULL, &c, NULL));
    ck_ok(groom_superhelices_check(c->helices, NULL));
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        ck_assert_msg(largest_share(strands, c, i) <= share, "strand %u: %g of a segment", i, largest_share(strands, c, i));
        ck_assert_msg(fabs((double)c->reports[i].length_change) <= length_change, "strand %u: length by %g", i,
                      (double)c->reports[i].length_change);
    }
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
}

START_TEST(strands_of_any_size_are_met) { assert_met(sized(60, 41, 0), 0.02, 0.005); } END_TEST
START_TEST(repeated_vertices_do_no_harm) { assert_met(sized(60, 41, 1), 0.03, 0.005); } END_TEST

START_TEST(two_vertices_are_one_straight_line)
{
    struct groom_strands *strands;
    ck_ok(groom_strands_create(5, 10, NULL, &strands, NULL));
    for (uint32_t i = 0; i < 5; i++) {
        float length = powf(10.0f, 3.0f * (float)i - 9.0f);
        strands->first[i + 1] = 2 * i + 2;
        for (int c = 0; c < 3; c++) {
            strands->points[2 * i][c] = 0.25f * length * (float)c;
            strands->points[2 * i + 1][c] = length * (float)(1 + c);
        }
    }
    assert_met(strands, 1e-6, 1e-6);
}
END_TEST

/* A comb's knot: the strand folds back on itself, time after time, and goes on. */
START_TEST(strands_that_fold_back_are_met)
{
    enum { N = 60, M = 30 };
    struct groom_random_key key = {78, 1};
    struct groom_strands *strands;
    ck_ok(groom_strands_create(N, N * M, NULL, &strands, NULL));
    for (uint32_t i = 0; i < N; i++) {
        double y = 0.0, side = 0.0;
        strands->first[i + 1] = M * (i + 1);
        for (uint32_t k = 0; k < M; k++) {
            int knot = k > 10 && k < 20;
            y += knot ? 0.002 * (k % 2 ? 1.0 : -0.9) * (double)groom_random_uniform(key, i, k) : 0.008;
            side += knot && i % 2 ? 1e-4 * groom_random_normal(key, i, M + k) : 0.0;
            float *p = strands->points[strands->first[i] + k];
            p[0] = (float)side, p[1] = (float)y, p[2] = 0.0f;
        }
    }
    assert_met(strands, 0.05, 0.005);
}
END_TEST

TEST_SUITE("convert_wild", wild_strands_become_sound_superhelices, strands_of_any_size_are_met,
           repeated_vertices_do_no_harm, two_vertices_are_one_straight_line, strands_that_fold_back_are_met)
