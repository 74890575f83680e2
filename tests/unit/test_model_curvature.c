/* curvature parameters of guides: Eq. 10 forth, back and differentiated */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/random.h"
#include "tests/support/grooms.h"
#include "tests/support/test.h"

enum { M = 60 };

static struct groom_curvature_guides *parameters_of(const float (*points)[3], uint32_t n_guides)
{
    struct groom_curvature_guides *guides;
    ck_ok(groom_curvature_guides_create(n_guides, M, NULL, &guides, NULL));
    groom_curvature_guides_from_points(points, guides, NULL);
    return guides;
}

/* The worst distance of a coordinate after points -> parameters -> points, metres. */
static double round_trip(const float (*points)[3], uint32_t n_guides)
{
    struct groom_curvature_guides *guides = parameters_of(points, n_guides);
    float(*back)[3] = malloc((size_t)n_guides * M * sizeof *back);
    double worst = 0.0;
    groom_curvature_guides_to_points(guides, back, NULL);
    for (size_t i = 0; i < (size_t)n_guides * M; i++)
        for (int c = 0; c < 3; c++) {
            double error = fabs((double)back[i][c] - points[i][c]);
            worst = error > worst || isnan(error) ? error : worst;
        }
    free(back);
    groom_curvature_guides_destroy(guides);
    return worst;
}

START_TEST(points_come_back)
{
    struct groom_shape shape = {.n_strands = 1, .n_vertices = M, .n_guides = 50, .n_operator_guides = 1, .n_instancing = 1};
    struct groom *groom = test_groom(shape, 5);
    ck_assert_double_lt(round_trip((const float(*)[3])groom->guides, 50), 5e-7);
    groom_destroy(groom);
}
END_TEST

/* A strand along each axis, both ways, and one that winds seven times around each. */
START_TEST(axes_and_helices_come_back)
{
    for (int axis = 0; axis < 3; axis++)
        for (int kind = 0; kind < 3; kind++) {
            float points[M][3];
            for (int j = 0; j < M; j++) {
                double turn = kind == 2 ? 7 * 2 * M_PI * j / (M - 1) : 0, radius = kind == 2 ? 0.01 : 0;
                points[j][axis] = (float)(kind == 1 ? -0.004 * j : 0.004 * j);
                points[j][(axis + 1) % 3] = (float)(radius * cos(turn));
                points[j][(axis + 2) % 3] = (float)(radius * sin(turn));
            }
            ck_assert_double_lt(round_trip((const float(*)[3])points, 1), 3e-7);
        }
}
END_TEST

START_TEST(a_straight_guide_has_no_curvature)
{
    float points[M][3];
    for (int j = 0; j < M; j++)
        points[j][0] = 0.25f * (float)j, points[j][1] = 0.5f * (float)j, points[j][2] = -0.125f * (float)j;
    struct groom_curvature_guides *guides = parameters_of((const float(*)[3])points, 1);
    for (int j = 0; j < M - 2; j++)
        ck_assert(fabsf(guides->curvature[j][0]) < 1e-6f && fabsf(guides->curvature[j][1]) < 1e-6f);
    groom_curvature_guides_destroy(guides);
}
END_TEST

START_TEST(the_azimuth_is_unwrapped_on_a_circle)
{
    float points[M][3];
    const double radius = 0.05;
    for (int j = 0; j < M; j++) { /* three times around */
        points[j][0] = (float)(radius * cos(3 * 2 * M_PI * j / (M - 1)));
        points[j][1] = (float)(radius * sin(3 * 2 * M_PI * j / (M - 1)));
        points[j][2] = 0.0f;
    }
    struct groom_curvature_guides *guides = parameters_of((const float(*)[3])points, 1);
    double turned = 0.0;
    for (int j = 0; j < M - 2; j++)
        turned += 0.5 * ((double)guides->length[j] + guides->length[j + 1]) * guides->curvature[j][1];
    ck_assert_double_eq_tol(fabs(turned), 3 * 2 * M_PI * (M - 2) / (M - 1), 0.02);
    groom_curvature_guides_destroy(guides);
}
END_TEST

START_TEST(segments_of_no_length_take_their_neighbours_direction)
{
    float points[M][3] = {{0}};
    for (int j = 1; j < M; j++) { /* the first three, and two in the middle, stand still */
        memcpy(points[j], points[j - 1], sizeof points[j]);
        if (j > 3 && j != 20 && j != 21)
            points[j][j < 30 ? 0 : 1] += 0.01f;
    }
    struct groom_curvature_guides *guides = parameters_of((const float(*)[3])points, 1);
    float back[M][3];
    groom_curvature_guides_to_points(guides, back, NULL);
    for (int j = 0; j < M; j++)
        for (int c = 0; c < 3; c++)
            ck_assert_float_eq_tol(back[j][c], points[j][c], 6e-6f);
    memset(points, 0, sizeof points);
    groom_curvature_guides_from_points((const float(*)[3])points, guides, NULL);
    for (int j = 0; j < M - 2; j++)
        ck_assert(isfinite(guides->curvature[j][0]) && guides->curvature[j][1] == 0.0f);
    groom_curvature_guides_destroy(guides);
}
END_TEST

/* Eq. 10 in double precision, and a linear functional of its points. */
static double functional(const float *root, const float *pole, const double *angle, const double *length,
                         double (*curvature)[2], float (*coefficient)[3])
{
    double phi[2] = {angle[0], angle[1]}, x[3] = {root[0], root[1], root[2]}, sum = 0.0;
    for (int j = 0; j < M - 1; j++) {
        for (int i = 0; i < 2 && j > 0; i++)
            phi[i] += 0.5 * (length[j - 1] + length[j]) * curvature[j - 1][i];
        double local[3] = {sin(phi[0]) * cos(phi[1]), sin(phi[0]) * sin(phi[1]), cos(phi[0])};
        for (int c = 0; c < 3; c++) {
            x[c] += length[j] * (pole[c] * local[0] + pole[3 + c] * local[1] + pole[6 + c] * local[2]);
            sum += coefficient[j + 1][c] * x[c];
        }
    }
    return sum;
}

START_TEST(the_gradient_is_that_of_equation_10)
{
    struct groom_shape shape = {.n_strands = 1, .n_vertices = M, .n_guides = 7, .n_operator_guides = 1, .n_instancing = 1};
    struct groom *groom = test_groom(shape, 5);
    struct groom_curvature_guides *guides = parameters_of((const float(*)[3])groom->guides, 7), *gradient;
    ck_ok(groom_curvature_guides_create(7, M, NULL, &gradient, NULL));
    float coefficient[7 * M][3];
    for (uint32_t i = 0; i < 7 * M; i++)
        for (uint32_t c = 0; c < 3; c++)
            coefficient[i][c] = groom_random_uniform((struct groom_random_key){3, 1}, i, c) - 0.5f;
    groom_curvature_guides_gradient(guides, (const float(*)[3])coefficient, gradient, NULL);

    for (int g = 0; g < 7; g++) {
        double x[2 + M - 1 + 2 * (M - 2)]; /* angle, length, curvature */
        const int n = (int)(sizeof x / sizeof x[0]);
        for (int i = 0; i < n; i++)
            x[i] = i < 2 ? guides->angle[g][i] : i < M + 1 ? guides->length[g * (M - 1) + i - 2]
                                                           : (&guides->curvature[g * (M - 2)][0])[i - M - 1];
        for (int i = 0; i < n; i++) {
            double at = x[i], step = i < 2 ? 1e-6 : i < M + 1 ? 1e-7 : 1e-4, side[2];
            for (int s = 0; s < 2; s++) {
                x[i] = s ? at + step : at - step;
                side[s] = functional(guides->root[g], guides->pole[g], x, x + 2, (double(*)[2])(x + M + 1), coefficient + g * M);
            }
            x[i] = at;
            double truth = (side[1] - side[0]) / (2 * step);
            float got = i < 2 ? gradient->angle[g][i] : i < M + 1 ? gradient->length[g * (M - 1) + i - 2]
                                                                 : (&gradient->curvature[g * (M - 2)][0])[i - M - 1];
            ck_assert_msg(fabs(got - truth) < 2e-6 * (1.0 + fabs(truth)), "guide %d, parameter %d: %g, not %g", g, i, (double)got, truth);
        }
    }
    groom_curvature_guides_destroy(gradient);
    groom_curvature_guides_destroy(guides);
    groom_destroy(groom);
}
END_TEST

START_TEST(any_pool_gives_the_same_bits)
{
    struct groom_shape shape = {.n_strands = 1, .n_vertices = M, .n_guides = 90, .n_operator_guides = 1, .n_instancing = 1};
    struct groom *groom = test_groom(shape, 5);
    struct groom_curvature_guides *one = parameters_of((const float(*)[3])groom->guides, 90), *three;
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_curvature_guides_create(90, M, NULL, &three, NULL));
    groom_curvature_guides_from_points((const float(*)[3])groom->guides, three, &context);
    ck_assert_mem_eq(one->curvature, three->curvature, (size_t)90 * (M - 2) * sizeof *one->curvature);
    ck_assert_mem_eq(one->length, three->length, (size_t)90 * (M - 1) * sizeof *one->length);
    groom_curvature_guides_destroy(one);
    groom_curvature_guides_destroy(three);
    groom_pool_destroy(pool);
    groom_destroy(groom);
}
END_TEST

START_TEST(create_refuses_and_reports)
{
    struct groom_curvature_guides *guides = NULL;
    ck_status(groom_curvature_guides_create(0, 5, NULL, &guides, NULL), GROOM_EINVAL);
    ck_status(groom_curvature_guides_create(5, 2, NULL, &guides, NULL), GROOM_EINVAL);
    for (size_t nth = 0; nth < 6; nth++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, nth, &allocator);
        ck_status(groom_curvature_guides_create(4, 5, &(struct groom_context){.allocator = &allocator}, &guides, NULL), GROOM_ENOMEM);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
    }
    ck_assert_ptr_null(guides);
}
END_TEST

TEST_SUITE("model_curvature", points_come_back, axes_and_helices_come_back, a_straight_guide_has_no_curvature,
           the_azimuth_is_unwrapped_on_a_circle, segments_of_no_length_take_their_neighbours_direction,
           the_gradient_is_that_of_equation_10, any_pool_gives_the_same_bits, create_refuses_and_reports)
