/* a groom's memory, chain, validation and instancing */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/grooms.h"
#include "tests/support/test.h"

static const struct groom_shape small = {.n_strands = 200, .n_vertices = 12, .n_guides = 20, .n_operator_guides = 5, .n_instancing = 3};

START_TEST(create_refuses_shapes_that_mean_nothing)
{
    const struct groom_shape bad[] = {
        {0, 12, 20, 5, 3}, {9, 2, 20, 5, 3}, {9, 12, 0, 5, 3}, {9, 12, 20, 0, 3},
        {9, 12, 20, 5, 0}, {9, 12, 20, 21, 3}, {9, 12, 20, 5, 21},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct groom *groom = NULL;
        struct groom_diag diag = {0};
        ck_status(groom_create(bad[i], NULL, &groom, &diag), GROOM_EINVAL);
        ck_assert_ptr_null(groom);
        ck_assert(strlen(diag.detail) > 0);
    }
}
END_TEST

START_TEST(every_operator_has_a_name_parameters_and_help)
{
    for (int type = 0; type < GROOM_OPERATOR_COUNT; type++) {
        groom_operator_type parsed = GROOM_OPERATOR_COUNT;
        uint32_t n, n_random;
        ck_ok(groom_operator_parse(groom_operator_name((groom_operator_type)type), &parsed, NULL));
        ck_assert_int_eq(parsed, type);
        const struct groom_operator_parameter *p = groom_operator_parameters((groom_operator_type)type, &n);
        ck_assert(n >= 1 && n <= GROOM_OPERATOR_MAX_PARAMETERS);
        for (uint32_t i = 0; i < n; i++) {
            ck_assert(strlen(p[i].name) > 0 && strlen(p[i].help) > 10);
            ck_assert(p[i].minimum <= p[i].initial && p[i].initial <= p[i].slider_maximum);
            ck_assert(p[i].slider_maximum <= p[i].maximum);
        }
        groom_operator_randoms((groom_operator_type)type, &n_random);
        ck_assert_uint_eq(n_random, groom_operator_random_arrays((groom_operator_type)type));
    }
    groom_operator_type type;
    struct groom_diag diag;
    ck_status(groom_operator_parse("braid", &type, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "scale bend curl clump frizz"));
}
END_TEST

START_TEST(operators_are_inserted_moved_and_removed)
{
    struct groom *groom = test_groom(small, 1);
    struct groom_diag diag;
    test_append_all_operators(groom, 3); /* scale bend curl clump frizz */
    ck_ok(groom_insert_operator(groom, 1, GROOM_OPERATOR_FRIZZ, 4, &diag));
    ck_ok(groom_move_operator(groom, 5, 0, &diag)); /* frizz scale frizz bend curl clump */
    ck_ok(groom_move_operator(groom, 1, 3, &diag)); /* frizz frizz bend scale curl clump */
    ck_ok(groom_remove_operator(groom, 4, &diag));  /* frizz frizz bend scale clump */
    const groom_operator_type expected[] = {GROOM_OPERATOR_FRIZZ, GROOM_OPERATOR_FRIZZ, GROOM_OPERATOR_BEND,
                                            GROOM_OPERATOR_SCALE, GROOM_OPERATOR_CLUMP};
    const uint32_t ids[] = {5, 6, 2, 1, 4};
    ck_assert_uint_eq(groom->n_operators, 5);
    for (int i = 0; i < 5; i++) {
        ck_assert_int_eq(groom->operators[i].type, expected[i]);
        ck_assert_uint_eq(groom->operators[i].id, ids[i]);
    }
    ck_status(groom_insert_operator(groom, 6, GROOM_OPERATOR_BEND, 1, &diag), GROOM_EINVAL);
    ck_status(groom_remove_operator(groom, 5, &diag), GROOM_EINVAL);
    ck_status(groom_move_operator(groom, 0, 5, &diag), GROOM_EINVAL);
    while (groom->n_operators)
        ck_ok(groom_remove_operator(groom, 0, &diag));
    ck_ok(groom_validate(groom, &diag));
    groom_destroy(groom);
}
END_TEST

START_TEST(random_numbers_survive_changes_elsewhere_in_the_chain)
{
    struct groom *groom = test_groom(small, 1);
    test_append_all_operators(groom, 3);
    float before[200];
    uint32_t id = groom->operators[1].id;
    memcpy(before, groom->operators[1].random[0], sizeof before);
    ck_ok(groom_insert_operator(groom, 0, GROOM_OPERATOR_BEND, 3, NULL));
    ck_ok(groom_move_operator(groom, 2, 5, NULL));
    ck_ok(groom_remove_operator(groom, 1, NULL));
    struct groom_operator *op = &groom->operators[4];
    ck_assert_uint_eq(op->id, id);
    ck_assert_mem_eq(op->random[0], before, sizeof before);
    groom_draw_random(groom, op, op->seed);
    ck_assert_mem_eq(op->random[0], before, sizeof before);
    groom_draw_random(groom, op, op->seed + 1);
    ck_assert_mem_ne(op->random[0], before, sizeof before);
    ck_assert_mem_ne(groom->operators[0].random[0], before, sizeof before); /* same seed, another id */
    groom_destroy(groom);
}
END_TEST

START_TEST(clone_is_deep_and_equal)
{
    struct groom *groom = test_groom(small, 1), *copy;
    test_append_all_operators(groom, 3);
    strcpy(groom->name, "original");
    groom->scalp = GROOM_SCALP_ROOTS;
    memcpy(groom->axes, test_slanted_axes, sizeof groom->axes);
    ck_ok(groom_clone(groom, NULL, &copy, NULL));
    ck_assert_str_eq(copy->name, "original");
    ck_assert_int_eq(copy->scalp, GROOM_SCALP_ROOTS);
    ck_assert_mem_eq(copy->axes, test_slanted_axes, sizeof copy->axes);
    ck_assert_mem_eq(copy->guides, groom->guides, (size_t)20 * 12 * sizeof *copy->guides);
    ck_assert_mem_eq(copy->instancing_weight, groom->instancing_weight, (size_t)200 * 3 * sizeof(float));
    ck_assert_uint_eq(copy->n_operators, 5);
    ck_assert_mem_eq(copy->operators[2].random[1], groom->operators[2].random[1], 5 * sizeof(float));
    ck_assert_mem_eq(copy->operators[2].parameter, groom->operators[2].parameter, sizeof copy->operators[2].parameter);
    copy->guides[3][1] += 1.0f;
    copy->operators[0].random[0][7] = 2.0f;
    ck_assert(copy->guides[3][1] != groom->guides[3][1]);
    ck_assert(groom->operators[0].random[0][7] != 2.0f);
    groom_destroy(copy);
    groom_destroy(groom);
}
END_TEST

/* Spoil one thing, expect its pointer, and mend it. */
#define EXPECT_REFUSED(lvalue, bad, where)                                                         \
    do {                                                                                           \
        __typeof__(lvalue) good_ = (lvalue);                                                       \
        (lvalue) = (bad);                                                                          \
        ck_status(groom_validate(groom, &diag), GROOM_EINVAL);                                     \
        ck_assert_str_eq(diag.pointer, where);                                                     \
        (lvalue) = good_;                                                                          \
        ck_ok(groom_validate(groom, &diag));                                                       \
    } while (0)

START_TEST(validate_names_the_culprit)
{
    struct groom *groom = test_groom(small, 1);
    struct groom_diag diag;
    test_append_all_operators(groom, 3);
    ck_ok(groom_validate(groom, &diag));
    EXPECT_REFUSED(groom->roots[7][1], NAN, "/strands/roots");
    EXPECT_REFUSED(groom->root_uv[7][1], INFINITY, "/strands/root_uv");
    EXPECT_REFUSED(groom->guides[7][1], -INFINITY, "/guides/points");
    EXPECT_REFUSED(groom->guides[7][1], 1e30f, "/guides/points");
    EXPECT_REFUSED(groom->guide_uv[19][0], NAN, "/guides/root_uv");
    EXPECT_REFUSED(groom->instancing_guide[599], 20, "/instancing/guide");
    EXPECT_REFUSED(groom->instancing_weight[599], groom->instancing_weight[599] + 0.01f, "/instancing/weight");
    EXPECT_REFUSED(groom->instancing_weight[0], NAN, "/instancing/weight");
    EXPECT_REFUSED(groom->operator_guide[4], 20, "/operator_guides/guide");
    EXPECT_REFUSED(groom->operator_guide_of[199], 5, "/operator_guides/of_strand");
    memcpy(groom->axes, test_slanted_axes, sizeof groom->axes);
    ck_ok(groom_validate(groom, &diag));
    EXPECT_REFUSED(groom->axes[0][0], 0.37f, "/axes");
    EXPECT_REFUSED(groom->axes[2][1], NAN, "/axes");
    for (int c = 0; c < 3; c++)
        EXPECT_REFUSED(groom->axes[2][c], -groom->axes[2][c], "/axes"); /* the third makes it left-handed */
    EXPECT_REFUSED(groom->operators[1].parameter[1], 1.5f, "/operators/1/start");
    EXPECT_REFUSED(groom->operators[2].parameter[0], NAN, "/operators/2/radius");
    EXPECT_REFUSED(groom->operators[2].random[1][4], -0.1f, "/operators/2/random/u2");
    EXPECT_REFUSED(groom->operators[4].random[0][199], NAN, "/operators/4/random/u");
    EXPECT_REFUSED(groom->operators[4].type, (groom_operator_type)99, "/operators/4/type");
    groom_destroy(groom);
}
END_TEST

static int nearer(const float (*uv)[2], const float q[2], uint32_t a, uint32_t b)
{
    double ax = (double)uv[a][0] - q[0], ay = (double)uv[a][1] - q[1];
    double bx = (double)uv[b][0] - q[0], by = (double)uv[b][1] - q[1];
    double da = ax * ax + ay * ay, db = bx * bx + by * by;
    return da < db || (da == db && a < b);
}

static void check_nearest(struct groom *groom)
{
    uint32_t k = groom->n_instancing;
    for (uint32_t i = 0; i < groom->n_strands; i++) {
        const uint32_t *chosen = &groom->instancing_guide[i * k];
        double sum = 0.0;
        for (uint32_t a = 0; a < k; a++) {
            sum += groom->instancing_weight[i * k + a];
            uint32_t rank = 0;
            for (uint32_t g = 0; g < groom->n_guides; g++)
                rank += (uint32_t)nearer((const float(*)[2])groom->guide_uv, groom->root_uv[i], g, chosen[a]);
            ck_assert_uint_eq(rank, a);
        }
        ck_assert_double_eq_tol(sum, 1.0, 1e-6);
    }
}

START_TEST(instancing_finds_the_nearest_guides_exactly)
{
    struct groom_shape shape = {.n_strands = 400, .n_vertices = 3, .n_guides = 137, .n_operator_guides = 1, .n_instancing = 5};
    struct groom *groom = test_groom(shape, 9);
    check_nearest(groom);
    for (uint32_t g = 0; g < shape.n_guides; g++) { /* a lattice with many ties and coincident guides */
        groom->guide_uv[g][0] = (float)(g % 8) / 8;
        groom->guide_uv[g][1] = (float)(g / 8 % 8) / 8;
    }
    for (uint32_t i = 0; i < shape.n_strands; i++) { /* some outside the guides' box */
        groom->root_uv[i][0] = (float)(i % 20) / 16 - 0.25f;
        groom->root_uv[i][1] = (float)(i / 20) / 16 - 0.25f;
    }
    ck_ok(groom_instance_by_distance(groom, 0.1f, NULL, NULL));
    check_nearest(groom);
    for (uint32_t g = 0; g < shape.n_guides; g++) /* all on one line */
        groom->guide_uv[g][1] = 0.5f;
    ck_ok(groom_instance_by_distance(groom, 0.0f, NULL, NULL));
    check_nearest(groom);
    groom_destroy(groom);
}
END_TEST

START_TEST(instancing_weights_follow_the_gaussian)
{
    struct groom_shape shape = {.n_strands = 1, .n_vertices = 3, .n_guides = 3, .n_operator_guides = 1, .n_instancing = 3};
    struct groom *groom = test_groom(shape, 9);
    const float uv[3][2] = {{0.1f, 0.0f}, {0.0f, 0.3f}, {-0.2f, 0.0f}};
    memcpy(groom->guide_uv, uv, sizeof uv);
    memset(groom->root_uv, 0, sizeof *groom->root_uv);
    ck_ok(groom_instance_by_distance(groom, 0.2f, NULL, NULL));
    double w[3] = {exp(-0.01 / 0.04), exp(-0.04 / 0.04), exp(-0.09 / 0.04)}, sum = w[0] + w[1] + w[2];
    const uint32_t order[3] = {0, 2, 1};
    for (int a = 0; a < 3; a++) {
        ck_assert_uint_eq(groom->instancing_guide[a], order[a]);
        ck_assert_float_eq_tol(groom->instancing_weight[a], w[a] / sum, 1e-6);
    }
    groom->root_uv[0][0] = 50.0f; /* so far that every Gaussian underflows */
    ck_ok(groom_instance_by_distance(groom, 0.01f, NULL, NULL));
    ck_assert_float_eq_tol(groom->instancing_weight[0], 1.0f, 1e-6);
    groom_destroy(groom);
}
END_TEST

START_TEST(instancing_is_the_same_for_any_pool)
{
    struct groom_shape shape = {.n_strands = 5000, .n_vertices = 3, .n_guides = 70, .n_operator_guides = 1, .n_instancing = 4};
    struct groom *groom = test_groom(shape, 2), *other;
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    ck_ok(groom_clone(groom, NULL, &other, NULL));
    ck_ok(groom_instance_by_distance(other, 0.0f, &(struct groom_context){.pool = pool}, NULL));
    ck_assert_mem_eq(other->instancing_guide, groom->instancing_guide, (size_t)5000 * 4 * sizeof(uint32_t));
    ck_assert_mem_eq(other->instancing_weight, groom->instancing_weight, (size_t)5000 * 4 * sizeof(float));
    groom_destroy(other);
    groom_destroy(groom);
    groom_pool_destroy(pool);
}
END_TEST

static groom_status build_all(const struct groom_context *context)
{
    struct groom *groom = NULL, *copy = NULL;
    groom_status status = groom_create(small, context, &groom, NULL);
    for (int i = 0; i < GROOM_OPERATOR_COUNT && status == GROOM_OK; i++)
        status = groom_insert_operator(groom, 0, (groom_operator_type)i, 1, NULL);
    if (status == GROOM_OK)
        status = groom_remove_operator(groom, 2, NULL);
    if (status == GROOM_OK)
        status = groom_instance_by_distance(groom, 0.0f, context, NULL);
    if (status == GROOM_OK)
        status = groom_clone(groom, context, &copy, NULL);
    groom_destroy(copy);
    groom_destroy(groom);
    return status;
}

START_TEST(every_failed_allocation_is_reported_and_leaks_nothing)
{
    groom_status status = GROOM_ENOMEM;
    for (size_t nth = 0; status != GROOM_OK; nth++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, nth, &allocator);
        status = build_all(&(struct groom_context){.allocator = &allocator});
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert(status == GROOM_OK || status == GROOM_ENOMEM);
        ck_assert_uint_lt(nth, 200);
    }
}
END_TEST

TEST_SUITE("model_groom", create_refuses_shapes_that_mean_nothing, every_operator_has_a_name_parameters_and_help,
           operators_are_inserted_moved_and_removed, random_numbers_survive_changes_elsewhere_in_the_chain,
           clone_is_deep_and_equal, validate_names_the_culprit, instancing_finds_the_nearest_guides_exactly,
           instancing_weights_follow_the_gaussian, instancing_is_the_same_for_any_pool,
           every_failed_allocation_is_reported_and_leaks_nothing)
