/* groom_evaluate against the double-precision reference, and against itself */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model/evaluate.h"
#include "model/plan.h"
#include "tests/support/grooms.h"
#include "tests/support/reference.h"
#include "tests/support/test.h"

static const struct groom_shape middling = {.n_strands = 333, .n_vertices = 50, .n_guides = 30, .n_operator_guides = 8, .n_instancing = 3};

static float (*evaluate(const struct groom *groom))[3]
{
    float(*out)[3] = malloc((size_t)groom->n_strands * groom->n_vertices * sizeof *out);
    ck_assert_ptr_nonnull(out);
    ck_ok(groom_evaluate(groom, 0, groom->n_strands, out, NULL, NULL));
    return out;
}

/* The largest distance of a coordinate from the reference, in metres. */
static double worst_error(const struct groom *groom)
{
    float(*out)[3] = evaluate(groom);
    struct reference *reference = reference_create(groom);
    double worst = 0.0, (*truth)[3] = malloc(groom->n_vertices * sizeof *truth);
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        reference_strand(reference, i, truth);
        for (uint32_t j = 0; j < groom->n_vertices; j++)
            for (int c = 0; c < 3; c++) {
                double error = fabs(out[(size_t)i * groom->n_vertices + j][c] - truth[j][c]);
                worst = error > worst || isnan(error) ? error : worst;
            }
    }
    free(truth);
    reference_destroy(reference);
    free(out);
    return worst;
}

/* Half a unit in the last place at 2 m is 1.2e-7 m: every answer is rounded that far. */
START_TEST(each_operator_follows_its_formula)
{
    for (int type = 0; type < GROOM_OPERATOR_COUNT; type++) {
        struct groom *groom = test_groom(middling, 5);
        test_append_operator(groom, (groom_operator_type)type, 11);
        double worst = worst_error(groom);
        ck_assert_msg(worst < 6e-7, "%s is off by %g m", groom_operator_name((groom_operator_type)type), worst);
        groom_destroy(groom);
    }
}
END_TEST

/* Strands that run out of the noise that is looked up, and such as lie beyond it. */
START_TEST(frizz_follows_its_formula_beyond_the_table)
{
    struct groom *groom = test_groom(middling, 5);
    test_append_operator(groom, GROOM_OPERATOR_FRIZZ, 11);
    for (float frequency = 300.0f; frequency < 6000.0f; frequency *= 4.0f) {
        groom->operators[0].parameter[0] = frequency;
        ck_assert_double_lt(worst_error(groom), 6e-7);
    }
    groom_destroy(groom);
}
END_TEST

START_TEST(instancing_follows_equation_3)
{
    for (uint32_t k = 1; k <= 7; k += 3)
        for (uint32_t m = 3; m < 12; m++) {
            struct groom_shape shape = {.n_strands = 21, .n_vertices = m, .n_guides = 30, .n_operator_guides = 2, .n_instancing = k};
            struct groom *groom = test_groom(shape, 5);
            ck_assert_double_lt(worst_error(groom), 2e-7);
            groom_destroy(groom);
        }
}
END_TEST

START_TEST(chains_of_any_order_and_length_follow_the_formulas)
{
    const groom_operator_type chains[][8] = {
        {GROOM_OPERATOR_SCALE, GROOM_OPERATOR_BEND, GROOM_OPERATOR_CURL, GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_FRIZZ, GROOM_OPERATOR_COUNT},
        {GROOM_OPERATOR_FRIZZ, GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_CURL, GROOM_OPERATOR_BEND, GROOM_OPERATOR_SCALE, GROOM_OPERATOR_COUNT},
        {GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_CURL, GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_CURL, GROOM_OPERATOR_BEND, GROOM_OPERATOR_BEND, GROOM_OPERATOR_COUNT},
    };
    for (int i = 0; i < 3; i++) {
        struct groom *groom = test_groom(middling, 5);
        for (int a = 0; chains[i][a] != GROOM_OPERATOR_COUNT; a++)
            test_append_operator(groom, chains[i][a], (uint64_t)a + 1);
        double worst = worst_error(groom);
        ck_assert_msg(worst < 1.5e-6, "chain %d is off by %g m", i, worst);
        groom_destroy(groom);
    }
}
END_TEST

/* Askew, and by quarter turns, which are exact. */
START_TEST(operators_lean_on_the_grooms_axes)
{
    for (int which = 0; which < 2; which++)
        for (int type = 0; type <= GROOM_OPERATOR_COUNT; type++) {
            struct groom *groom = test_groom(middling, 5);
            memcpy(groom->axes, which ? test_quarter_axes : test_slanted_axes, sizeof groom->axes);
            if (type < GROOM_OPERATOR_COUNT)
                test_append_operator(groom, (groom_operator_type)type, 11);
            else
                test_append_all_operators(groom, 11);
            double worst = worst_error(groom);
            ck_assert_msg(worst < 1.5e-6, "operator %d is off by %g m", type, worst);
            groom_destroy(groom);
        }
}
END_TEST

/* Noise beyond the table goes another way. */
START_TEST(fast_frizz_leans_on_the_grooms_axes)
{
    struct groom *groom = test_groom(middling, 5);
    memcpy(groom->axes, test_slanted_axes, sizeof groom->axes);
    test_append_operator(groom, GROOM_OPERATOR_FRIZZ, 11);
    groom->operators[0].parameter[0] = 4800.0f;
    ck_assert_double_lt(worst_error(groom), 6e-7);
    groom_destroy(groom);
}
END_TEST

/* Those that space has, written out, are none. */
START_TEST(axes_of_space_change_no_bit)
{
    struct groom *groom = test_groom(middling, 5);
    test_append_all_operators(groom, 11);
    float(*before)[3] = evaluate(groom);
    for (int c = 0; c < 3; c++)
        groom->axes[c][c] = 1;
    float(*after)[3] = evaluate(groom);
    for (size_t v = 0; v < (size_t)333 * 50; v++)
        for (int c = 0; c < 3; c++)
            ck_assert(before[v][c] == after[v][c]); /* -0 is 0 */
    free(before);
    free(after);
    groom_destroy(groom);
}
END_TEST

START_TEST(a_disabled_operator_does_nothing)
{
    struct groom *groom = test_groom(middling, 5);
    test_append_operator(groom, GROOM_OPERATOR_FRIZZ, 1);
    float(*before)[3] = evaluate(groom);
    test_append_operator(groom, GROOM_OPERATOR_CURL, 1);
    groom->operators[1].enabled = 0;
    float(*after)[3] = evaluate(groom);
    ck_assert_mem_eq(before, after, (size_t)333 * 50 * sizeof *before);
    free(before);
    free(after);
    groom_destroy(groom);
}
END_TEST

/* Guides along +-z, level, upright, with repeated vertices, all in one place. */
static void degrade_guides(struct groom *groom)
{
    uint32_t m = groom->n_vertices;
    const float direction[5][3] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
    for (uint32_t g = 0; g < groom->n_guides; g++)
        for (uint32_t j = 0; j < m; j++)
            for (int c = 0; c < 3; c++) {
                uint32_t step = g % 2 ? j / 3 * 3 : j; /* odd guides: three vertices in one place */
                groom->guides[g * m + j][c] = groom->guides[g * m][c] + 0.004f * (float)step * direction[g % 5][c];
            }
}

START_TEST(degenerate_guides_follow_the_formulas_and_stay_finite)
{
    for (int type = 0; type < GROOM_OPERATOR_COUNT; type++) {
        struct groom *groom = test_groom(middling, 5);
        degrade_guides(groom);
        test_append_operator(groom, (groom_operator_type)type, 11);
        double worst = worst_error(groom); /* NaN fails it too */
        ck_assert_msg(worst < 6e-7, "%s is off by %g m", groom_operator_name((groom_operator_type)type), worst);
        groom_destroy(groom);
    }
}
END_TEST

START_TEST(extreme_parameters_stay_finite)
{
    struct groom *groom = test_groom(middling, 5);
    for (size_t i = 0; i < (size_t)30 * 50; i++) /* some guides are kilometres long, too */
        for (int c = 0; c < 3; c++)
            groom->guides[i][c] *= i / 50 % 3 ? 1.0f : 5e4f;
    test_append_all_operators(groom, 3);
    for (uint32_t i = 0; i < groom->n_operators; i++) {
        uint32_t n;
        const struct groom_operator_parameter *p = groom_operator_parameters(groom->operators[i].type, &n);
        for (uint32_t a = 0; a < n; a++)
            groom->operators[i].parameter[a] = p[a].maximum;
    }
    ck_ok(groom_validate(groom, NULL));
    float(*out)[3] = evaluate(groom);
    for (size_t i = 0; i < (size_t)333 * 50; i++)
        ck_assert(isfinite(out[i][0]) && isfinite(out[i][1]) && isfinite(out[i][2]));
    free(out);
    groom_destroy(groom);
}
END_TEST

START_TEST(any_range_gives_the_same_bits)
{
    struct groom *groom = test_groom(middling, 5);
    test_append_all_operators(groom, 3);
    float(*whole)[3] = evaluate(groom), part[40 * 50][3];
    const uint32_t ranges[][2] = {{0, 1}, {1, 7}, {3, 8}, {5, 40}, {300, 33}, {332, 1}, {64, 16}, {333, 0}};
    for (int i = 0; i < 8; i++) {
        ck_ok(groom_evaluate(groom, ranges[i][0], ranges[i][1], part, NULL, NULL));
        ck_assert_mem_eq(part, whole[(size_t)ranges[i][0] * 50], (size_t)ranges[i][1] * 50 * sizeof *part);
    }
    struct groom_diag diag;
    ck_status(groom_evaluate(groom, 330, 4, part, NULL, &diag), GROOM_EINVAL);
    ck_status(groom_evaluate(groom, 4294967295u, 4294967295u, part, NULL, &diag), GROOM_EINVAL);
    free(whole);
    groom_destroy(groom);
}
END_TEST

/* Who looks for better guides of strands may come upon one that none of them had. */
START_TEST(a_plan_for_all_strands_knows_guides_that_none_has)
{
    struct groom *groom = test_groom(middling, 5);
    uint32_t m = groom->n_vertices, left = groom->n_guides - 1;
    struct plan plan;
    for (size_t a = 0; a < (size_t)groom->n_strands * groom->n_instancing; a++)
        groom->instancing_guide[a] %= left;
    ck_ok(plan_init(&plan, groom, NULL, 0, groom->n_strands, kernel_best_variant(), NULL));
    const float (*x)[3] = (const float (*)[3])groom->guides + (size_t)left * m;
    for (uint32_t j = 0; j < m; j++)
        for (uint32_t c = 0; c < 3; c++)
            ck_assert_float_eq(plan.relative[((size_t)left * m + j) * 3 + c], x[j][c] - x[0][c]);
    plan_finish(&plan);
    groom_destroy(groom);
}
END_TEST

START_TEST(any_pool_and_any_instruction_set_give_the_same_bits)
{
    struct groom *groom = test_groom(middling, 5);
    test_append_all_operators(groom, 3);
    float(*expected)[3] = evaluate(groom), (*out)[3] = malloc((size_t)333 * 50 * sizeof *out);
    for (int variant = KERNEL_BASELINE; variant <= (int)kernel_best_variant(); variant++)
        for (uint32_t threads = 1; threads <= 3; threads += 2) {
            struct groom_pool *pool;
            ck_ok(groom_pool_create(threads, &pool));
            struct groom_context context = {.pool = pool};
            ck_ok(evaluate_with((enum kernel_variant)variant, groom, 0, 333, out, &context, NULL));
            ck_assert_mem_eq(out, expected, (size_t)333 * 50 * sizeof *out);
            groom_pool_destroy(pool);
        }
    free(out);
    free(expected);
    groom_destroy(groom);
}
END_TEST

START_TEST(evaluation_survives_every_failed_allocation)
{
    struct groom *groom = test_groom(middling, 5);
    test_append_all_operators(groom, 3);
    float(*out)[3] = malloc((size_t)333 * 50 * sizeof *out);
    groom_status status = GROOM_ENOMEM;
    for (size_t nth = 0; status != GROOM_OK; nth++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, nth, &allocator);
        status = groom_evaluate(groom, 0, 333, out, &(struct groom_context){.allocator = &allocator}, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert(status == GROOM_OK || status == GROOM_ENOMEM);
        ck_assert_uint_lt(nth, 100);
    }
    free(out);
    groom_destroy(groom);
}
END_TEST

TEST_SUITE("model_evaluate", each_operator_follows_its_formula, frizz_follows_its_formula_beyond_the_table, instancing_follows_equation_3,
           chains_of_any_order_and_length_follow_the_formulas, operators_lean_on_the_grooms_axes, fast_frizz_leans_on_the_grooms_axes, axes_of_space_change_no_bit,
           a_disabled_operator_does_nothing,
           degenerate_guides_follow_the_formulas_and_stay_finite, extreme_parameters_stay_finite,
           any_range_gives_the_same_bits, a_plan_for_all_strands_knows_guides_that_none_has, any_pool_and_any_instruction_set_give_the_same_bits,
           evaluation_survives_every_failed_allocation)
