/* groom_evaluate_gradient against finite differences of the double-precision reference */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model/evaluate.h"
#include "tests/support/differences.h"
#include "tests/support/grooms.h"
#include "tests/support/test.h"

static const struct groom_shape tiny = {.n_strands = 21, .n_vertices = 13, .n_guides = 6, .n_operator_guides = 3, .n_instancing = 3};

#define END GROOM_OPERATOR_COUNT

static void expect_close(const struct groom *groom, const char *what)
{
    struct gradient_error e = test_gradient_error(groom, NULL, groom->n_strands);
    ck_assert_msg(e.guides < 1e-5 && e.weights < 5e-5 && e.parameters < 5e-5 && e.randoms < 5e-5,
                  "%s: guides %.2g, weights %.2g, parameters %.2g, random numbers %.2g", what, e.guides, e.weights,
                  e.parameters, e.randoms);
}

START_TEST(instancing_alone)
{
    struct groom *groom = test_groom(tiny, 5);
    expect_close(groom, "no operator");
    groom_destroy(groom);
}
END_TEST

START_TEST(each_operator)
{
    for (int type = 0; type < GROOM_OPERATOR_COUNT; type++) {
        struct groom *groom = test_groom(tiny, 5);
        test_append_operator(groom, (groom_operator_type)type, 11);
        expect_close(groom, groom_operator_name((groom_operator_type)type));
        groom_destroy(groom);
    }
}
END_TEST

static const groom_operator_type chains[][8] = {
    {GROOM_OPERATOR_SCALE, GROOM_OPERATOR_BEND, GROOM_OPERATOR_CURL, GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_FRIZZ, END},
    {GROOM_OPERATOR_FRIZZ, GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_CURL, GROOM_OPERATOR_BEND, GROOM_OPERATOR_SCALE, END},
    {GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_SCALE, GROOM_OPERATOR_FRIZZ, GROOM_OPERATOR_BEND, GROOM_OPERATOR_CURL, END},
    {GROOM_OPERATOR_CURL, GROOM_OPERATOR_CURL, GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_CLUMP, GROOM_OPERATOR_BEND, GROOM_OPERATOR_BEND, END},
    {GROOM_OPERATOR_BEND, GROOM_OPERATOR_CURL, GROOM_OPERATOR_BEND, END},
};

START_TEST(whole_chains_in_several_orders)
{
    for (size_t i = 0; i < sizeof chains / sizeof chains[0]; i++) {
        struct groom *groom = test_groom(tiny, i + 2);
        char what[32];
        for (int a = 0; chains[i][a] != END; a++)
            test_append_operator(groom, chains[i][a], (uint64_t)a + 1);
        snprintf(what, sizeof what, "chain %zu", i);
        expect_close(groom, what);
        groom_destroy(groom);
    }
}
END_TEST

START_TEST(chains_that_lean_on_axes_of_their_own)
{
    struct groom *groom = test_groom(tiny, 5);
    memcpy(groom->axes, test_slanted_axes, sizeof groom->axes);
    test_append_all_operators(groom, 1);
    expect_close(groom, "slanted axes");
    groom_destroy(groom);
}
END_TEST

START_TEST(disabled_operators_have_no_gradient)
{
    struct groom *groom = test_groom(tiny, 5);
    test_append_all_operators(groom, 1);
    groom->operators[1].enabled = groom->operators[3].enabled = 0;
    expect_close(groom, "bend and clump off");
    groom_destroy(groom);
}
END_TEST

START_TEST(a_curl_that_starts_at_the_root)
{
    struct groom *groom = test_groom(tiny, 5);
    test_append_operator(groom, GROOM_OPERATOR_CURL, 3);
    groom->operators[0].parameter[3] = 0.0f;
    struct gradient_error e = test_gradient_error(groom, NULL, groom->n_strands);
    ck_assert_double_lt(fmax(fmax(e.guides, e.weights), fmax(e.parameters, e.randoms)), 5e-5);
    groom_destroy(groom);
}
END_TEST

START_TEST(a_curl_whose_frequency_is_clamped_does_not_turn_with_it)
{
    struct groom *groom = test_groom(tiny, 5);
    test_append_operator(groom, GROOM_OPERATOR_CURL, 3);
    struct groom_operator *op = &groom->operators[0];
    op->parameter[1] = 1.0f;
    op->parameter[2] = 100.0f;
    op->random[0][0] = -0.9f; /* clamped */
    op->random[0][1] = -0.5f; /* clamped */
    op->random[0][2] = 0.7f;
    expect_close(groom, "clamped frequency");
    struct groom_gradient *gradient;
    ck_ok(groom_gradient_create(groom, NULL, &gradient, NULL));
    ck_ok(groom_evaluate_gradient(groom, NULL, groom->n_strands, test_linear_adjoint(groom), gradient, NULL, NULL));
    ck_assert(gradient->operators[0].random[0][0] == 0.0f);
    ck_assert(gradient->operators[0].random[0][1] == 0.0f);
    ck_assert(gradient->operators[0].random[0][2] != 0.0f);
    groom_gradient_destroy(gradient);
    groom_destroy(groom);
}
END_TEST

START_TEST(guides_beyond_one_operator_guide_and_shared_ones)
{
    struct groom *groom = test_groom(tiny, 5);
    test_append_all_operators(groom, 1);
    groom->operator_guide[2] = groom->operator_guide[0]; /* one guide stands for two */
    expect_close(groom, "shared operator guide");
    groom_destroy(groom);
}
END_TEST

START_TEST(k_of_one_and_few_vertices)
{
    struct groom_shape shape = {.n_strands = 9, .n_vertices = 3, .n_guides = 4, .n_operator_guides = 1, .n_instancing = 1};
    struct groom *groom = test_groom(shape, 5);
    test_append_all_operators(groom, 1);
    expect_close(groom, "k = 1, m = 3");
    groom_destroy(groom);
}
END_TEST

START_TEST(a_visit_of_some_strands_in_any_order)
{
    struct groom *groom = test_groom(tiny, 5);
    test_append_all_operators(groom, 1);
    const uint32_t strand[] = {20, 3, 4, 0, 11, 12, 13, 7, 19, 1};
    struct gradient_error e = test_gradient_error(groom, strand, 10);
    ck_assert_double_lt(fmax(fmax(e.guides, e.weights), fmax(e.parameters, e.randoms)), 5e-5);
    groom_destroy(groom);
}
END_TEST

/* Every kind of guide that has no direction somewhere: derivatives do not exist there, but no number
 * may fail. */
START_TEST(degenerate_guides_give_finite_gradients)
{
    for (int kind = 0; kind < 3; kind++) {
        struct groom *groom = test_groom(tiny, 5);
        uint32_t m = tiny.n_vertices;
        for (uint32_t g = 0; g < tiny.n_guides; g++)
            for (uint32_t j = 1; j < m; j++) {
                float *p = groom->guides[g * m + j];
                if (kind == 0 || (kind == 1 && j % 2))
                    memcpy(p, groom->guides[g * m + j - 1], sizeof groom->guides[0]);
                if (kind == 2) { /* straight along z */
                    memcpy(p, groom->guides[g * m + j - 1], sizeof groom->guides[0]);
                    p[2] += 0.01f;
                }
            }
        test_append_all_operators(groom, 1);
        struct groom_gradient *gradient;
        ck_ok(groom_gradient_create(groom, NULL, &gradient, NULL));
        ck_ok(groom_evaluate_gradient(groom, NULL, tiny.n_strands, test_linear_adjoint(groom), gradient, NULL, NULL));
        for (uint32_t i = 0; i < tiny.n_guides * m; i++)
            for (int c = 0; c < 3; c++)
                ck_assert(isfinite(gradient->guides[i][c]));
        for (uint32_t i = 0; i < tiny.n_strands * 3; i++)
            ck_assert(isfinite(gradient->instancing_weight[i]));
        for (uint32_t i = 0; i < groom->n_operators; i++)
            for (int p = 0; p < GROOM_OPERATOR_MAX_PARAMETERS; p++)
                ck_assert(isfinite(gradient->operators[i].parameter[p]));
        groom_gradient_destroy(gradient);
        groom_destroy(groom);
    }
}
END_TEST

/* Straight guides along z are smooth in everything but the frame: compare what exists. */
START_TEST(straight_guides_have_the_reference_gradient_where_it_exists)
{
    const float along[3][3] = {{0, 0.01f, 0}, {0.01f, 0, 0}, {0.006f, 0.008f, 0}};
    for (int kind = 0; kind < 3; kind++) {
        struct groom *groom = test_groom(tiny, 5);
        for (uint32_t i = 0; i < tiny.n_guides * tiny.n_vertices; i++)
            for (int c = 0; c < 3 && i % tiny.n_vertices; c++)
                groom->guides[i][c] = groom->guides[i - 1][c] + along[kind][c];
        test_append_all_operators(groom, 1);
        expect_close(groom, "straight guides");
        groom_destroy(groom);
    }
}
END_TEST

static size_t gradient_bytes(const struct groom *groom) { return (size_t)groom->n_guides * groom->n_vertices * 3 * sizeof(float); }

static void expect_same(const struct groom *groom, const struct groom_gradient *a, const struct groom_gradient *b)
{
    ck_assert_mem_eq(a->guides, b->guides, gradient_bytes(groom));
    ck_assert_mem_eq(a->instancing_weight, b->instancing_weight, (size_t)groom->n_strands * groom->n_instancing * sizeof(float));
    for (uint32_t i = 0; i < groom->n_operators; i++) {
        size_t n = groom_operator_random_per_guide(a->operators[i].type) ? groom->n_operator_guides : groom->n_strands;
        ck_assert_mem_eq(a->operators[i].parameter, b->operators[i].parameter, sizeof a->operators[i].parameter);
        for (uint32_t r = 0; r < groom_operator_random_arrays(a->operators[i].type); r++)
            ck_assert_mem_eq(a->operators[i].random[r], b->operators[i].random[r], n * sizeof(float));
    }
}

START_TEST(any_pool_and_any_instruction_set_give_the_same_bits)
{
    struct groom_shape shape = {.n_strands = 2500, .n_vertices = 20, .n_guides = 40, .n_operator_guides = 9, .n_instancing = 3};
    struct groom *groom = test_groom(shape, 5);
    struct groom_gradient *expected, *gradient;
    test_append_all_operators(groom, 1);
    ck_ok(groom_gradient_create(groom, NULL, &expected, NULL));
    ck_ok(groom_gradient_create(groom, NULL, &gradient, NULL));
    ck_ok(groom_evaluate_gradient(groom, NULL, 2500, test_linear_adjoint(groom), expected, NULL, NULL));
    for (int variant = KERNEL_BASELINE; variant <= (int)kernel_best_variant(); variant++)
        for (uint32_t threads = 1; threads <= 3; threads += 2) {
            struct groom_pool *pool;
            ck_ok(groom_pool_create(threads, &pool));
            struct groom_context context = {.pool = pool};
            ck_ok(gradient_with((enum kernel_variant)variant, groom, NULL, 2500, test_linear_adjoint(groom), gradient,
                                &context, NULL));
            expect_same(groom, gradient, expected);
            groom_pool_destroy(pool);
        }
    groom_gradient_destroy(expected);
    groom_gradient_destroy(gradient);
    groom_destroy(groom);
}
END_TEST

START_TEST(unwanted_parts_are_left_out_and_the_rest_is_the_same)
{
    struct groom *groom = test_groom(tiny, 5);
    struct groom_gradient *expected, *gradient;
    test_append_all_operators(groom, 1);
    ck_ok(groom_gradient_create(groom, NULL, &expected, NULL));
    ck_ok(groom_gradient_create(groom, NULL, &gradient, NULL));
    ck_ok(groom_evaluate_gradient(groom, NULL, 21, test_linear_adjoint(groom), expected, NULL, NULL));
    float(*guides)[3] = gradient->guides, *weight = gradient->instancing_weight, *random = gradient->operators[4].random[0];
    gradient->guides = NULL;
    gradient->operators[4].random[0] = NULL;
    ck_ok(groom_evaluate_gradient(groom, NULL, 21, test_linear_adjoint(groom), gradient, NULL, NULL));
    ck_assert_mem_eq(weight, expected->instancing_weight, 21 * 3 * sizeof(float));
    gradient->guides = guides;
    gradient->instancing_weight = NULL;
    ck_ok(groom_evaluate_gradient(groom, NULL, 21, test_linear_adjoint(groom), gradient, NULL, NULL));
    ck_assert_mem_eq(guides, expected->guides, gradient_bytes(groom));
    gradient->instancing_weight = weight;
    gradient->operators[4].random[0] = random;
    groom_gradient_destroy(expected);
    groom_gradient_destroy(gradient);
    groom_destroy(groom);
}
END_TEST

START_TEST(what_does_not_fit_is_refused)
{
    struct groom *groom = test_groom(tiny, 5);
    struct groom_gradient *gradient;
    const uint32_t beyond[] = {0, 21};
    test_append_operator(groom, GROOM_OPERATOR_BEND, 1);
    ck_ok(groom_gradient_create(groom, NULL, &gradient, NULL));
    struct groom_adjoint adjoint = test_linear_adjoint(groom);
    ck_status(groom_evaluate_gradient(groom, NULL, 20, adjoint, gradient, NULL, NULL), GROOM_EINVAL);
    ck_status(groom_evaluate_gradient(groom, beyond, 2, adjoint, gradient, NULL, NULL), GROOM_EINVAL);
    ck_ok(groom_evaluate_gradient(groom, beyond, 1, adjoint, gradient, NULL, NULL));
    test_append_operator(groom, GROOM_OPERATOR_SCALE, 1);
    ck_status(groom_evaluate_gradient(groom, NULL, 21, adjoint, gradient, NULL, NULL), GROOM_EINVAL);
    groom_gradient_destroy(gradient);
    groom_destroy(groom);
}
END_TEST

START_TEST(the_gradient_survives_every_failed_allocation)
{
    struct groom *groom = test_groom(tiny, 5);
    test_append_all_operators(groom, 3);
    groom_status status = GROOM_ENOMEM;
    for (size_t nth = 0; status != GROOM_OK; nth++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_gradient *gradient = NULL;
        test_failing_allocator_init(&state, nth, &allocator);
        struct groom_context context = {.allocator = &allocator};
        status = groom_gradient_create(groom, &context, &gradient, NULL);
        if (status == GROOM_OK)
            status = groom_evaluate_gradient(groom, NULL, 21, test_linear_adjoint(groom), gradient, &context, NULL);
        groom_gradient_destroy(gradient);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert(status == GROOM_OK || status == GROOM_ENOMEM);
        ck_assert_uint_lt(nth, 100);
    }
    groom_destroy(groom);
}
END_TEST

TEST_SUITE("model_gradient", instancing_alone, each_operator, whole_chains_in_several_orders,
           chains_that_lean_on_axes_of_their_own,
           disabled_operators_have_no_gradient, a_curl_that_starts_at_the_root,
           a_curl_whose_frequency_is_clamped_does_not_turn_with_it, guides_beyond_one_operator_guide_and_shared_ones,
           k_of_one_and_few_vertices, a_visit_of_some_strands_in_any_order, degenerate_guides_give_finite_gradients,
           straight_guides_have_the_reference_gradient_where_it_exists,
           any_pool_and_any_instruction_set_give_the_same_bits, unwanted_parts_are_left_out_and_the_rest_is_the_same,
           what_does_not_fit_is_refused, the_gradient_survives_every_failed_allocation)
