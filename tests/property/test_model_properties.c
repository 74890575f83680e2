/* what must hold of the procedural model for any groom */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/random.h"
#include "groom/strands.h"
#include "tests/support/grooms.h"
#include "tests/support/test.h"

enum { ROUNDS = 20 };

/* A groom of random shape with a random chain of up to six operators. */
static struct groom *any_groom(uint32_t round)
{
    struct groom_random_key key = {2026, round};
    uint32_t n_guides = 1 + groom_random_below(key, 0, 0, 40);
    struct groom_shape shape = {
        .n_strands = 1 + groom_random_below(key, 0, 1, 300),
        .n_vertices = 3 + groom_random_below(key, 0, 2, 60),
        .n_guides = n_guides,
        .n_operator_guides = 1 + groom_random_below(key, 0, 3, n_guides),
        .n_instancing = 1 + groom_random_below(key, 0, 4, n_guides < 5 ? n_guides : 5),
    };
    struct groom *groom = test_groom(shape, round);
    uint32_t n = groom_random_below(key, 0, 5, 7);
    for (uint32_t i = 0; i < n; i++)
        test_append_operator(groom, (groom_operator_type)groom_random_below(key, 1, i, GROOM_OPERATOR_COUNT), i);
    ck_ok(groom_validate(groom, NULL));
    return groom;
}

static float (*evaluate(const struct groom *groom))[3]
{
    float(*out)[3] = malloc((size_t)groom->n_strands * groom->n_vertices * sizeof *out);
    ck_ok(groom_evaluate(groom, 0, groom->n_strands, out, NULL, NULL));
    return out;
}

static size_t output_bytes(const struct groom *groom) { return (size_t)groom->n_strands * groom->n_vertices * 3 * sizeof(float); }

START_TEST(roots_never_move)
{
    for (uint32_t round = 0; round < ROUNDS; round++) {
        struct groom *groom = any_groom(round);
        float(*out)[3] = evaluate(groom);
        for (uint32_t i = 0; i < groom->n_strands; i++)
            ck_assert_mem_eq(out[(size_t)i * groom->n_vertices], groom->roots[i], sizeof groom->roots[i]);
        free(out);
        groom_destroy(groom);
    }
}
END_TEST

/* Operators with these parameters leave every bit as it is. */
START_TEST(operators_at_rest_are_the_identity)
{
    const struct { groom_operator_type type; uint32_t parameter; } rest[] = {
        {GROOM_OPERATOR_SCALE, 0}, {GROOM_OPERATOR_BEND, 0}, {GROOM_OPERATOR_CURL, 0}, {GROOM_OPERATOR_CLUMP, 0}, {GROOM_OPERATOR_FRIZZ, 1}};
    for (uint32_t round = 0; round < ROUNDS; round++)
        for (int i = 0; i < 5; i++) {
            struct groom *groom = any_groom(round);
            while (groom->n_operators)
                ck_ok(groom_remove_operator(groom, 0, NULL));
            float(*before)[3] = evaluate(groom);
            test_append_operator(groom, rest[i].type, 1);
            groom->operators[0].parameter[rest[i].parameter] = 0.0f;
            float(*after)[3] = evaluate(groom);
            /* a bend of 0 still adds the segments up: rounding differs */
            float tolerance = rest[i].type == GROOM_OPERATOR_BEND ? 3e-7f : 0.0f;
            for (size_t v = 0; v < output_bytes(groom) / sizeof *before; v++)
                for (int c = 0; c < 3; c++)
                    ck_assert(fabsf(after[v][c] - before[v][c]) <= tolerance);
            free(before);
            free(after);
            groom_destroy(groom);
        }
}
END_TEST

/* Eq. 3: where all guides have one shape, every strand is that shape at its own root. */
START_TEST(identical_guides_are_copied_to_every_root)
{
    for (uint32_t round = 0; round < ROUNDS; round++) {
        struct groom *groom = any_groom(round);
        uint32_t m = groom->n_vertices;
        while (groom->n_operators)
            ck_ok(groom_remove_operator(groom, 0, NULL));
        for (uint32_t g = 1; g < groom->n_guides; g++)
            for (uint32_t j = 1; j < m; j++)
                for (int c = 0; c < 3; c++)
                    groom->guides[g * m + j][c] = groom->guides[g * m][c] + (groom->guides[j][c] - groom->guides[0][c]);
        float(*out)[3] = evaluate(groom);
        for (uint32_t i = 0; i < groom->n_strands; i++)
            for (uint32_t j = 0; j < m; j++)
                for (int c = 0; c < 3; c++)
                    ck_assert_float_eq_tol(out[(size_t)i * m + j][c] - groom->roots[i][c],
                                           groom->guides[j][c] - groom->guides[0][c], 1e-6f);
        free(out);
        groom_destroy(groom);
    }
}
END_TEST

START_TEST(scale_multiplies_lengths_and_bend_keeps_them)
{
    for (uint32_t round = 0; round < ROUNDS; round++) {
        struct groom *groom = any_groom(round);
        uint32_t m = groom->n_vertices;
        while (groom->n_operators)
            ck_ok(groom_remove_operator(groom, 0, NULL));
        float(*before)[3] = evaluate(groom);
        test_append_operator(groom, GROOM_OPERATOR_BEND, 1);
        test_append_operator(groom, GROOM_OPERATOR_SCALE, 1);
        float(*after)[3] = evaluate(groom);
        for (uint32_t i = 0; i < groom->n_strands; i++) {
            double factor = 1.0 + (double)groom->operators[1].parameter[0] * groom->operators[1].random[0][i];
            double length = groom_polyline_length((const float(*)[3])before + (size_t)i * m, m);
            ck_assert_double_eq_tol(groom_polyline_length((const float(*)[3])after + (size_t)i * m, m), factor * length, 2e-5 * length);
        }
        free(before);
        free(after);
        groom_destroy(groom);
    }
}
END_TEST

/* A strand depends on its own row alone: taking others away changes no bit. */
START_TEST(strands_are_independent_of_each_other)
{
    for (uint32_t round = 0; round < ROUNDS; round++) {
        struct groom *groom = any_groom(round);
        float(*before)[3] = evaluate(groom);
        uint32_t n = groom->n_strands, m = groom->n_vertices, kept = n / 2, k = groom->n_instancing;
        for (uint32_t i = 0; i < n; i++) { /* all strands but one become copies of another */
            if (i == kept)
                continue;
            memcpy(groom->roots[i], groom->roots[kept], sizeof groom->roots[i]);
            memcpy(groom->instancing_guide + i * k, groom->instancing_guide + kept * k, k * sizeof(uint32_t));
        }
        float(*after)[3] = evaluate(groom);
        ck_assert_mem_eq(after + (size_t)kept * m, before + (size_t)kept * m, m * sizeof *before);
        free(before);
        free(after);
        groom_destroy(groom);
    }
}
END_TEST

START_TEST(a_clone_evaluates_to_the_same_bits)
{
    for (uint32_t round = 0; round < ROUNDS; round++) {
        struct groom *groom = any_groom(round), *copy;
        ck_ok(groom_clone(groom, NULL, &copy, NULL));
        float(*a)[3] = evaluate(groom), (*b)[3] = evaluate(copy);
        ck_assert_mem_eq(a, b, output_bytes(groom));
        free(a);
        free(b);
        groom_destroy(copy);
        groom_destroy(groom);
    }
}
END_TEST

TEST_SUITE("model_properties", roots_never_move, operators_at_rest_are_the_identity,
           identical_guides_are_copied_to_every_root, scale_multiplies_lengths_and_bend_keeps_them,
           strands_are_independent_of_each_other, a_clone_evaluates_to_the_same_bits)
