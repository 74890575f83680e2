/* what a fit finds of the same hair uploaded in another unit or with another axis up, turned, with another seed:
 * parameters and guides up to where single strands' numbers are looked for, and parameters of whole fits where an upload
 * tells its frame (bench_invariance prints how far these move in every way, for every style) */
#include <math.h>
#include <string.h>

#include "groom/mesh.h"
#include "groom/strands.h"
#include "tests/support/invariance.h"
#include "tests/support/known.h"
#include "tests/support/test.h"

enum { N = 400, M = 40 };

#define METRES (struct groom_frame){1, GROOM_UP_Y}
#define CENTIMETRES (struct groom_frame){0.01, GROOM_UP_Y}
#define INCHES_Z_UP (struct groom_frame){0.0254, GROOM_UP_Z}
#define METRES_Z_UP (struct groom_frame){1, GROOM_UP_Z}

static struct groom_fit *fit_of(groom_sample_style style, struct groom_frame frame, const double r[3][3], uint64_t seed)
{
    struct groom_sample *sample = guides_sample(style, N, M, 3, NULL);
    struct groom_fit_options options = known_options(sample, 0);
    options.vertices = M;
    options.seed = seed;
    invariance_upload(sample, frame);
    invariance_turn(sample, r);
    struct groom_fit *fit = guides_fit(sample, &options, "randoms", NULL);
    groom_bvh_destroy(fit->bvh); /* borrows the sample's head; the stage before is the last that asks it */
    fit->bvh = NULL;
    groom_sample_destroy(sample);
    return fit;
}

static void agree(groom_sample_style style, struct groom_fit *other, const double r[3][3], double most_percent)
{
    struct groom_fit *fit = fit_of(style, METRES, invariance_as_it_is, 77);
    struct known_parameter parameter[KNOWN_PARAMETERS];
    uint32_t n = known_parameters(other->groom, fit->groom, parameter);
    invariance_turn_points(fit->groom->guides, (size_t)fit->groom->n_guides * M, r);
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
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, CENTIMETRES, invariance_as_it_is, 77), invariance_as_it_is, 0.5);
    agree(GROOM_SAMPLE_BENT, fit_of(GROOM_SAMPLE_BENT, CENTIMETRES, invariance_as_it_is, 77), invariance_as_it_is, 0.5);
}
END_TEST

START_TEST(another_axis_up_changes_nothing)
{
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, METRES, invariance_upright, 77), invariance_upright, 0.5);
}
END_TEST

START_TEST(turned_hair_has_the_same_parameters)
{
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, METRES, invariance_slanted, 77), invariance_slanted, 3);
    agree(GROOM_SAMPLE_BENT, fit_of(GROOM_SAMPLE_BENT, METRES, invariance_slanted, 77), invariance_slanted, 3);
}
END_TEST

START_TEST(the_seed_moves_no_parameter)
{
    agree(GROOM_SAMPLE_STRAIGHT, fit_of(GROOM_SAMPLE_STRAIGHT, METRES, invariance_as_it_is, 78), invariance_as_it_is, 0);
}
END_TEST

/* --- whole fits -------------------------------------------------------------------------------- */

static struct groom *fitted_with(groom_sample_style style, struct groom_frame frame, uint64_t seed)
{
    struct groom_sample *sample = guides_sample(style, N, M, 3, NULL);
    struct groom_fit_options options = known_options(sample, 0);
    struct groom *groom;
    options.vertices = M;
    options.seed = seed;
    invariance_upload(sample, frame);
    struct groom_fit *fit = guides_fit(sample, &options, "", NULL);
    ck_ok(groom_fit_result(fit, NULL, &groom, NULL));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
    return groom;
}

static struct groom *fitted(groom_sample_style style, struct groom_frame frame) { return fitted_with(style, frame, 77); }

static void same_parameters(const struct groom *groom, struct groom *other, double most_percent)
{
    struct known_parameter parameter[KNOWN_PARAMETERS];
    uint32_t n = known_parameters(other, groom, parameter);
    for (uint32_t k = 0; k < n; k++)
        ck_assert_msg(fabs(parameter[k].error) <= most_percent, "%s.%s moves by %g %%", parameter[k].of, parameter[k].name,
                      parameter[k].error);
    groom_destroy(other);
}

START_TEST(an_upload_that_tells_its_axis_moves_no_parameter)
{
    struct groom *groom = fitted(GROOM_SAMPLE_SHORT, METRES);
    same_parameters(groom, fitted(GROOM_SAMPLE_SHORT, METRES_Z_UP), 0);
    groom_destroy(groom);
}
END_TEST

/* Of bent hair, whose parameters so few strands tell; other styles want the bench's 3 000. */
START_TEST(an_upload_that_tells_its_unit_fits_to_the_same_parameters)
{
    struct groom *groom = fitted(GROOM_SAMPLE_BENT, METRES);
    same_parameters(groom, fitted(GROOM_SAMPLE_BENT, CENTIMETRES), 0.5);
    same_parameters(groom, fitted(GROOM_SAMPLE_BENT, INCHES_Z_UP), 0.5);
    groom_destroy(groom);
}
END_TEST

/* A seed decides what is drawn, not what is found. */
START_TEST(another_seed_fits_to_the_same_parameters)
{
    struct groom *groom = fitted(GROOM_SAMPLE_WAVY, METRES), *other = fitted_with(GROOM_SAMPLE_WAVY, METRES, 78);
    ck_assert_uint_eq(other->operators[0].seed, 78);
    ck_assert_mem_eq(groom->operators[0].random[0], other->operators[0].random[0], N * sizeof(float));
    same_parameters(groom, other, 0);
    groom_destroy(groom);
}
END_TEST

TEST_SUITE("fit_invariance", rounding_in_another_unit_changes_nothing, another_axis_up_changes_nothing,
           turned_hair_has_the_same_parameters, the_seed_moves_no_parameter, an_upload_that_tells_its_axis_moves_no_parameter,
           an_upload_that_tells_its_unit_fits_to_the_same_parameters, another_seed_fits_to_the_same_parameters)
