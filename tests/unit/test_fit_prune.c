/* Operators that hair does not need, where nobody has named them. */
#include <stdlib.h>
#include <string.h>

#include "fit/prune.h"
#include "tests/support/fits.h"
#include "tests/support/guides.h"
#include "tests/support/known.h"
#include "tests/support/test.h"

enum { N = 900, M = 60 };

static struct groom_fit *fit_of(const struct groom_sample *sample, int automatic, const char *stage)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.vertices = M;
    options.operators_auto = automatic;
    return guides_fit(sample, &options, stage, NULL);
}

static const struct groom_operator *operator_of(const struct groom *groom, groom_operator_type type)
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (groom->operators[o].type == type)
            return &groom->operators[o];
    return NULL;
}

/* Those that the truth was made with have an effect, the others none, which the report says. */
static void finds_what_it_was_made_with(groom_sample_style style)
{
    static const groom_operator_type types[] = {GROOM_OPERATOR_BEND, GROOM_OPERATOR_CURL, GROOM_OPERATOR_CLUMP};
    struct groom_sample *sample = guides_sample(style, N, M, 4, NULL);
    struct groom_fit *fit = fit_of(sample, 1, "randoms");
    for (size_t k = 0; k < sizeof types / sizeof *types; k++) {
        const struct groom_operator *found = operator_of(fit->groom, types[k]);
        int made = operator_of(sample->truth, types[k]) != NULL;
        ck_assert_ptr_nonnull(found);
        ck_assert_int_eq(found->enabled, 1);
        ck_assert_msg((found->parameter[0] != 0) == made, "%s is %g", groom_operator_name(types[k]), (double)found->parameter[0]);
    }
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}

START_TEST(straight_hair_neither_bends_nor_curls) { finds_what_it_was_made_with(GROOM_SAMPLE_STRAIGHT); } END_TEST
START_TEST(spiky_hair_neither_bends_nor_curls) { finds_what_it_was_made_with(GROOM_SAMPLE_SPIKY); } END_TEST
START_TEST(curls_curl_and_do_not_bend) { finds_what_it_was_made_with(GROOM_SAMPLE_CURLY); } END_TEST
START_TEST(bent_hair_bends_and_does_not_curl) { finds_what_it_was_made_with(GROOM_SAMPLE_BENT); } END_TEST

START_TEST(a_note_says_what_went_and_sliders_are_as_they_begin)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, N, M, 4, NULL);
    struct groom_fit *fit = fit_of(sample, 1, "randoms");
    const struct groom_operator *bend = operator_of(fit->groom, GROOM_OPERATOR_BEND);
    uint32_t n;
    ck_assert(fits_is_noted(fit, "without bend"));
    ck_assert(!fits_is_noted(fit, "without clump"));
    ck_assert_float_eq(bend->parameter[1], groom_operator_parameters(GROOM_OPERATOR_BEND, &n)[1].initial);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* Who names all five has all five. */
START_TEST(named_operators_stay)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_STRAIGHT, N, M, 4, NULL);
    struct groom_fit *fit = fit_of(sample, 0, "randoms");
    ck_assert_uint_eq(fit->groom->n_operators, 5);
    ck_assert_float_ne(operator_of(fit->groom, GROOM_OPERATOR_BEND)->parameter[0], 0);
    ck_assert(!fits_is_noted(fit, "without bend"));
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

TEST_SUITE("fit_prune", straight_hair_neither_bends_nor_curls, spiky_hair_neither_bends_nor_curls, curls_curl_and_do_not_bend,
           bent_hair_bends_and_does_not_curl, a_note_says_what_went_and_sliders_are_as_they_begin, named_operators_stay)
