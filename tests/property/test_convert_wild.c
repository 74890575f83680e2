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

TEST_SUITE("convert_wild", wild_strands_become_sound_superhelices)
