/* Where operator guides stand, told by who follows them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/sites.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

#define VERTICES 12

/* The fit of a sample as its target alone. */
static struct groom_fit *fit_of(const struct groom_sample *sample)
{
    struct groom_fit_options options;
    struct groom_fit *fit;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    ck_ok(groom_fit_create(sample->capture, sample->head, &options, NULL, &fit, NULL));
    return fit;
}

static double apart(const double a[3], const float b[3])
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static const float *root_of(const struct groom *truth, uint32_t o)
{
    return truth->guides[(size_t)truth->operator_guide[o] * truth->n_vertices];
}

static void middle_of(const struct groom *truth, uint32_t o, double middle[3])
{
    double n = 0;
    memset(middle, 0, 3 * sizeof *middle);
    for (uint32_t i = 0; i < truth->n_strands; i++)
        if (truth->operator_guide_of[i] == o) {
            for (int c = 0; c < 3; c++)
                middle[c] += (double)truth->roots[i][c];
            n++;
        }
    for (int c = 0; c < 3 && n > 0; c++)
        middle[c] /= n;
}

static void tells(groom_sample_style style, uint32_t n_strands, double share)
{
    struct groom_sample *sample = guides_sample(style, n_strands, VERTICES, 1, NULL);
    struct groom_fit *fit = fit_of(sample);
    const struct groom *truth = sample->truth;
    uint32_t n = truth->n_operator_guides;
    struct site *site = calloc(n, sizeof *site);
    double off = 0, middles = 0;
    ck_assert_uint_eq(fit->n, truth->n_strands);
    ck_ok(sites_find(fit, truth->operator_guide_of, n, site, NULL, NULL));
    for (uint32_t o = 0; o < n; o++) {
        double middle[3];
        middle_of(truth, o, middle);
        off += site[o].n > 0 ? apart(site[o].at, root_of(truth, o)) : 0;
        middles += site[o].n > 0 ? apart(middle, root_of(truth, o)) : 0;
    }
    ck_assert_msg(off < share * middles, "%g mm, middles %g mm", 1e3 * off / n, 1e3 * middles / n);
    free(site);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

START_TEST(sites_are_nearer_than_middles) { tells(GROOM_SAMPLE_SPIKY, 1500, 0.5); } END_TEST
START_TEST(partings_bend_no_borders) { tells(GROOM_SAMPLE_CURLY, 1500, 0.8); } END_TEST

/* One site, sites that nothing follows, one strand each, all strands of one, none next to its own: places all the same. */
START_TEST(odd_followings_have_places)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_SHORT, 60, VERTICES, 1, NULL);
    struct groom_fit *fit = fit_of(sample);
    static const uint32_t sites[] = {1, 2, 3, 60, 7};
    for (size_t k = 0; k < sizeof sites / sizeof *sites; k++)
        for (int kind = 0; kind < 3; kind++) {
            uint32_t n = sites[k], *follows = calloc(fit->n, sizeof *follows), counted = 0;
            struct site *site = calloc(n, sizeof *site);
            for (uint32_t i = 0; i < fit->n; i++)
                follows[i] = kind == 0 ? i % n : kind == 1 ? n - 1 : (i * 7919u) % n;
            ck_ok(sites_find(fit, follows, n, site, NULL, NULL));
            for (uint32_t o = 0; o < n; o++) {
                counted += (uint32_t)site[o].n;
                for (int c = 0; c < 3; c++)
                    ck_assert(isfinite(site[o].at[c]) && fabs(site[o].at[c]) < 10);
            }
            ck_assert_uint_eq(counted, fit->n);
            free(site), free(follows);
        }
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* Strands whose roots are all one: no directions to tell. */
START_TEST(one_place_is_the_place)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_SHORT, 20, VERTICES, 1, NULL);
    struct groom_fit *fit = fit_of(sample);
    uint32_t follows[20] = {0, 1, 2, 0, 1, 2};
    struct site site[3];
    for (uint32_t i = 1; i < fit->n; i++) {
        memcpy(fit->roots[i], fit->roots[0], sizeof *fit->roots);
        memcpy(fit->root_uv[i], fit->root_uv[0], sizeof *fit->root_uv);
    }
    ck_ok(sites_find(fit, follows, 3, site, NULL, NULL));
    for (int o = 0; o < 3; o++)
        ck_assert_double_lt(apart(site[o].at, fit->roots[0]), 1e-3);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* Few strands a site, some nearly on a line: roots that are off by rounding move no place by more than a part of a millimetre. */
START_TEST(rounding_moves_no_place)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_COILY, 1500, VERTICES, 1, NULL);
    struct groom_fit *fit = fit_of(sample);
    const struct groom *truth = sample->truth;
    uint32_t n = truth->n_operator_guides;
    struct site *site = calloc(n, sizeof *site), *other = calloc(n, sizeof *other);
    ck_ok(sites_find(fit, truth->operator_guide_of, n, site, NULL, NULL));
    for (uint32_t i = 0; i < fit->n; i++)
        for (int c = 0; c < 3; c++)
            fit->roots[i][c] = nextafterf(fit->roots[i][c], (i + (uint32_t)c) % 2 ? 10.0f : -10.0f);
    for (uint32_t i = 0; i < fit->n; i++)
        for (int c = 0; c < 2; c++)
            fit->root_uv[i][c] = nextafterf(fit->root_uv[i][c], (i / 2 + (uint32_t)c) % 2 ? 10.0f : -10.0f);
    ck_ok(sites_find(fit, truth->operator_guide_of, n, other, NULL, NULL));
    for (uint32_t o = 0; o < n; o++) {
        const float at[3] = {(float)other[o].at[0], (float)other[o].at[1], (float)other[o].at[2]};
        ck_assert_double_lt(apart(site[o].at, at), 1e-5);
    }
    free(site), free(other);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_sites", rounding_moves_no_place, sites_are_nearer_than_middles, partings_bend_no_borders, odd_followings_have_places,
           one_place_is_the_place)
