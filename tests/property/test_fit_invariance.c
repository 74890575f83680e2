/* what a fit finds of the same hair in another unit, on its side, with another seed: parameters and guides, up to where
 * single strands' numbers are looked for (bench_invariance prints how far whole fits move, and re-fits) */
#include <math.h>
#include <string.h>

#include "groom/mesh.h"
#include "groom/strands.h"
#include "tests/support/known.h"
#include "tests/support/test.h"

enum { N = 400, M = 40 };

typedef double rotation[3][3];
static const rotation as_it_is = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const rotation on_its_back = {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
static const rotation slanted = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};

static void turn(float (*x)[3], size_t n, const rotation r)
{
    for (size_t v = 0; v < n; v++) {
        double p[3] = {(double)x[v][0], (double)x[v][1], (double)x[v][2]};
        for (int c = 0; c < 3; c++)
            x[v][c] = (float)(r[c][0] * p[0] + r[c][1] * p[1] + r[c][2] * p[2]);
    }
}

/* Rounded as a file in centimetres is. */
static void round_in_centimetres(float (*x)[3], size_t n)
{
    for (size_t v = 0; v < n; v++)
        for (int c = 0; c < 3; c++)
            x[v][c] = (float)((double)(float)(100.0 * (double)x[v][c]) * 0.01);
}

static struct groom_fit *fit_of(groom_sample_style style, int centimetres, const rotation r, uint64_t seed)
{
    struct groom_sample *sample = guides_sample(style, N, M, 3, NULL);
    struct groom_fit_options options = known_options(sample, 0);
    options.vertices = M;
    options.seed = seed;
    if (centimetres)
        round_in_centimetres(sample->capture->points, sample->capture->n_vertices);
    turn(sample->capture->points, sample->capture->n_vertices, r);
    turn(sample->head->points, sample->head->n_vertices, r);
    struct groom_fit *fit = guides_fit(sample, &options, "randoms", NULL);
    groom_bvh_destroy(fit->bvh); /* borrows the sample's head; the stage before is the last that asks it */
    fit->bvh = NULL;
    groom_sample_destroy(sample);
    return fit;
}

static void agree(groom_sample_style style, struct groom_fit *other, const rotation r, double most_percent)
{
    struct groom_fit *fit = fit_of(style, 0, as_it_is, 77);
    struct known_parameter parameter[KNOWN_PARAMETERS];
    uint32_t n = known_parameters(other->groom, fit->groom, parameter);
    turn(fit->groom->guides, (size_t)fit->groom->n_guides * M, r);
    for (size_t v = 0; v < (size_t)fit->groom->n_guides * M; v++)
        for (int c = 0; c < 3; c++)
            ck_assert_float_eq_tol(fit->groom->guides[v][c], other->groom->guides[v][c], 1e-5f);
    ck_assert_mem_eq(fit->groom->operator_guide_of, other->groom->operator_guide_of, N * sizeof(uint32_t));
    for (uint32_t k = 0; k < n; k++)
        ck_assert_msg(fabs(parameter[k].error) <= most_percent, "%s.%s moves by %g %%", parameter[k].of, parameter[k].name,
                      parameter[k].error);
    groom_fit_destroy(fit);
    groom_fit_destroy(other);
}

START_TEST(rounding_in_another_unit_changes_nothing)
{
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, 1, as_it_is, 77), as_it_is, 0.5);
    agree(GROOM_SAMPLE_BENT, fit_of(GROOM_SAMPLE_BENT, 1, as_it_is, 77), as_it_is, 0.5);
}
END_TEST

START_TEST(another_axis_up_changes_nothing)
{
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, 0, on_its_back, 77), on_its_back, 0.5);
}
END_TEST

START_TEST(turned_hair_has_the_same_parameters)
{
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, 0, slanted, 77), slanted, 3);
    agree(GROOM_SAMPLE_BENT, fit_of(GROOM_SAMPLE_BENT, 0, slanted, 77), slanted, 3);
}
END_TEST

START_TEST(the_seed_moves_no_parameter)
{
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, 0, as_it_is, 78), as_it_is, 0);
}
END_TEST

TEST_SUITE("fit_invariance", rounding_in_another_unit_changes_nothing, another_axis_up_changes_nothing,
           turned_hair_has_the_same_parameters, the_seed_moves_no_parameter)
