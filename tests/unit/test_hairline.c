/* the hairline: scalp regions, the membrane's derivatives, edits and what is refused */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/hairline.h"
#include "groom/mesh.h"
#include "groom/random.h"
#include "groom/spatial.h"
#include "retarget/membrane.h"
#include "tests/support/hairlines.h"
#include "tests/support/test.h"

enum { N = 6000 };

static struct groom_mesh *head;
static float (*roots)[3];
static struct groom_scalp_region *region;
static struct groom_scalp_region_report scalp;
static struct groom_hairline hairline;
static float moved[N][3];
static unsigned char bald[N];
static struct groom_relocation_report report;

static void set_up(void)
{
    struct groom_diag diag = {0};
    head = hairlines_sample(N, &roots);
    groom_status st = groom_scalp_region_create(head, (const float (*)[3])roots, N, NULL, NULL, NULL, &region, &scalp, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
}

static void tear_down(void)
{
    groom_scalp_region_destroy(region);
    groom_mesh_destroy(head);
    free(roots);
}

static void relocate(void)
{
    struct groom_diag diag = {0};
    groom_status st = groom_hairline_relocate(region, &hairline, NULL, moved, bald, NULL, &report, &diag);
    ck_assert_msg(st == GROOM_OK, "%s %s", diag.pointer, diag.detail);
}

static double distance(const float a[3], const float b[3])
{
    return sqrt(pow((double)a[0] - b[0], 2) + pow((double)a[1] - b[1], 2) + pow((double)a[2] - b[2], 2));
}

/* --- the membrane ---------------------------------------------------------------------- */

static double random_number(uint32_t i) { return groom_random_uniform((struct groom_random_key){11, 3}, i, 0) - 0.5; }

/* A triangle, bent and stretched, each corner moving in a plane of its own. */
static void random_triangle(uint32_t seed, struct membrane_triangle *rest, struct vec x[3], double jacobian[3][3][2])
{
    struct vec corner[3];
    for (uint32_t i = 0; i < 3; i++) {
        const double at[3][2] = {{0, 0}, {1, 0}, {0.3, 0.9}};
        corner[i] = (struct vec){at[i][0] + 0.2 * random_number(seed + 90 * i), at[i][1] + 0.2 * random_number(seed + 90 * i + 1), 0.1 * random_number(seed + 90 * i + 2)};
        x[i] = (struct vec){1.2 * corner[i].x + 0.4 * random_number(seed + 90 * i + 3), 0.7 * corner[i].y + 0.4 * random_number(seed + 90 * i + 4), 0.6 * random_number(seed + 90 * i + 5)};
        for (int r = 0; r < 3; r++)
            for (int k = 0; k < 2; k++)
                jacobian[i][r][k] = random_number(seed + 90 * i + 10 + 2 * (uint32_t)r + (uint32_t)k);
    }
    ck_assert(membrane_rest(rest, corner));
}

static void displaced(const struct vec x[3], double jacobian[3][3][2], int parameter, double h, struct vec out[3])
{
    memcpy(out, x, 3 * sizeof *out);
    int i = parameter / 2, k = parameter % 2;
    out[i] = vec_add(out[i], (struct vec){h * jacobian[i][0][k], h * jacobian[i][1][k], h * jacobian[i][2][k]});
}

START_TEST(gradient_and_hessian_are_the_energys_differences)
{
    const struct membrane_material material = {1.3, 5};
    const double h = 1e-5;
    for (uint32_t seed = 0; seed < 20; seed++) {
        struct membrane_triangle rest;
        struct vec x[3], ahead[3], behind[3];
        double jacobian[3][3][2], gradient[6], hessian[6][6], before[6], after[6];
        random_triangle(1000 * seed, &rest, x, jacobian);
        membrane_derivatives(&rest, material, x, (const double (*)[3][2])jacobian, gradient, hessian, 0);
        for (int p = 0; p < 6; p++) {
            displaced(x, jacobian, p, h, ahead);
            displaced(x, jacobian, p, -h, behind);
            double slope = (membrane_energy(&rest, material, ahead) - membrane_energy(&rest, material, behind)) / (2 * h);
            ck_assert_double_eq_tol(gradient[p], slope, 1e-6 * (1 + fabs(slope)));
            membrane_derivatives(&rest, material, ahead, (const double (*)[3][2])jacobian, after, NULL, 0);
            membrane_derivatives(&rest, material, behind, (const double (*)[3][2])jacobian, before, NULL, 0);
            for (int q = 0; q < 6; q++)
                ck_assert_double_eq_tol(hessian[p][q], (after[q] - before[q]) / (2 * h), 1e-5 * (1 + fabs(hessian[p][q])));
        }
    }
}
END_TEST

START_TEST(the_projected_hessian_never_falls_and_is_the_hessian_at_rest)
{
    const struct membrane_material material = {1, 8};
    for (uint32_t seed = 0; seed < 20; seed++) {
        struct membrane_triangle rest;
        struct vec x[3];
        double jacobian[3][3][2], gradient[6], hessian[6][6];
        random_triangle(777 * seed + 5, &rest, x, jacobian);
        membrane_derivatives(&rest, material, x, (const double (*)[3][2])jacobian, gradient, hessian, 1);
        for (uint32_t trial = 0; trial < 50; trial++) {
            double d[6], sum = 0;
            for (uint32_t i = 0; i < 6; i++)
                d[i] = random_number(9000 + 100 * trial + i);
            for (int i = 0; i < 6; i++)
                for (int j = 0; j < 6; j++)
                    sum += d[i] * hessian[i][j] * d[j];
            ck_assert_double_ge(sum, -1e-12);
        }
    }
    struct membrane_triangle rest;
    struct vec corner[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    double jacobian[3][3][2] = {{{0}}}, gradient[6], plain[6][6], projected[6][6];
    for (int i = 0; i < 3; i++)
        jacobian[i][0][0] = jacobian[i][1][1] = 1;
    ck_assert(membrane_rest(&rest, corner));
    membrane_derivatives(&rest, material, corner, (const double (*)[3][2])jacobian, gradient, plain, 0);
    membrane_derivatives(&rest, material, corner, (const double (*)[3][2])jacobian, gradient, projected, 1);
    for (int i = 0; i < 6; i++) {
        ck_assert_double_eq_tol(gradient[i], 0, 1e-12);
        for (int j = 0; j < 6; j++)
            ck_assert_double_eq_tol(plain[i][j], projected[i][j], 1e-12);
    }
}
END_TEST

START_TEST(a_collapsed_triangle_costs_infinitely_much)
{
    struct membrane_triangle rest;
    struct vec corner[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, flat[3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    ck_assert(membrane_rest(&rest, corner));
    ck_assert(isinf(membrane_energy(&rest, (struct membrane_material){1, 8}, flat)));
    ck_assert(!membrane_rest(&rest, flat));
}
END_TEST

/* --- regions ------------------------------------------------------------------------------ */

START_TEST(the_region_holds_all_roots_and_parts_at_the_ears)
{
    set_up();
    const uint32_t *triangles;
    float front[41][3];
    ck_assert_uint_eq(scalp.n_roots_outside, 0);
    ck_assert_uint_eq(groom_scalp_region_triangles(region, &triangles), scalp.n_triangles);
    ck_assert_double_gt(scalp.area, 0.04);
    ck_assert_double_lt(scalp.area, 0.06);
    for (int side = 0; side < 2; side++) { /* the sample's ears: in direction (+-1, -0.14, -0.08) of (0, 1.64, 0) */
        ck_assert_float_eq_tol(fabsf(scalp.ears[side][0]), 0.087f, 0.004f);
        ck_assert_float_eq_tol(scalp.ears[side][1], 1.627f, 0.01f);
    }
    ck_assert_float_gt(scalp.ears[0][0], 0);
    groom_scalp_region_front(region, 41, front);
    ck_assert_float_gt(front[0][0], 0.05f);
    ck_assert_float_lt(front[40][0], -0.05f);
    ck_assert_float_gt(front[20][2], 0.05f);
    ck_assert_float_gt(front[20][1], front[0][1] + 0.03f);
    tear_down();
}
END_TEST

START_TEST(sparse_roots_on_a_fine_mesh_make_one_region_without_holes)
{
    set_up();
    struct groom_scalp_region *sparse;
    struct groom_scalp_region_report dense = scalp, few;
    float (*some)[3] = malloc((N / 20 + 3) * sizeof *some);
    uint32_t n = 0;
    for (uint32_t i = 0; i < N; i += 20)
        memcpy(some[n++], roots[i], sizeof *some);
    for (int i = 0; i < 3; i++) { /* strays on the chin */
        some[n][0] = 0.002f * (float)i;
        some[n][1] = 1.53f;
        some[n++][2] = 0.09f;
    }
    ck_ok(groom_scalp_region_create(head, (const float (*)[3])some, n, NULL, NULL, NULL, &sparse, &few, NULL));
    ck_assert_uint_eq(few.n_roots_outside, 3);
    ck_assert_double_gt(few.area, 0.8 * dense.area);
    ck_assert_double_lt(few.area, 1.1 * dense.area);
    groom_scalp_region_destroy(sparse);
    free(some);
    tear_down();
}
END_TEST

START_TEST(regions_that_cannot_be_are_refused)
{
    set_up();
    struct groom_scalp_region *none = NULL;
    struct groom_diag diag = {0};
    struct groom_scalp_region_options options = {.closing_m = -1};
    float broken[2][3] = {{0, 1.75f, 0}, {NAN, 0, 0}};
    ck_status(groom_scalp_region_create(head, (const float (*)[3])roots, 0, NULL, NULL, NULL, &none, NULL, &diag), GROOM_EEMPTY);
    ck_status(groom_scalp_region_create(head, (const float (*)[3])broken, 2, NULL, NULL, NULL, &none, NULL, &diag), GROOM_EINVAL);
    ck_status(groom_scalp_region_create(head, (const float (*)[3])roots, N, NULL, &options, NULL, &none, NULL, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/closing_m");
    ck_assert_ptr_null(none);
    tear_down();
}
END_TEST

/* --- JSON ------------------------------------------------------------------------------------ */

#define POINTS "[[0.08,1.65,0],[0,1.72,0.09],[-0.08,1.65,0]]"

START_TEST(a_hairline_prints_as_what_reads_the_same)
{
    static const char *const texts[] = {
        "{\"points\":" POINTS "}",
        "{\"kind\":\"sideburns\",\"method\":\"harmonic\",\"curves\":[{\"points\":" POINTS "},{\"points\":" POINTS ",\"turns\":[{\"from\":0.3,\"to\":0.4}]}]}",
        "{\"kind\":\"crown\",\"curves\":[{\"points\":" POINTS "},{\"points\":" POINTS "}]}",
        "{\"kind\":\"balding\",\"points\":" POINTS ",\"turns\":[{\"from\":0.25,\"to\":0.2},{\"from\":0.75,\"to\":0.8}]}",
    };
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        static struct groom_hairline a, b;
        char *json;
        ck_ok(groom_hairline_parse(texts[i], strlen(texts[i]), &a, NULL));
        ck_ok(groom_hairline_print(&a, &json, NULL));
        ck_ok(groom_hairline_parse(json, strlen(json), &b, NULL));
        ck_assert_mem_eq(&a, &b, sizeof a);
        free(json);
    }
}
END_TEST

START_TEST(unsound_hairlines_are_refused_at_their_field)
{
    static const struct {
        const char *json, *pointer;
    } cases[] = {
        {"7", ""},
        {"{}", "/points"},
        {"{\"points\":[[0,0,0],[0,0,1]]}", "/points"},
        {"{\"points\":[[0,0,0],[0,0,1],[0,1]]}", "/points/2"},
        {"{\"points\":[[0,0,0],[0,0,1],[0,1,\"1\"]]}", "/points/2"},
        {"{\"kind\":\"back\",\"points\":" POINTS "}", "/kind"},
        {"{\"method\":3,\"points\":" POINTS "}", "/method"},
        {"{\"points\":" POINTS ",\"turns\":[{\"from\":0.5,\"to\":0.5},{\"from\":0.4,\"to\":0.6}]}", "/turns/1"},
        {"{\"points\":" POINTS ",\"turns\":[{\"from\":0.5}]}", "/turns/0/to"},
        {"{\"points\":" POINTS ",\"turns\":[{\"from\":0.5,\"to\":1.5}]}", "/turns/0/to"},
        {"{\"points\":" POINTS ",\"curves\":[]}", "/curves"},
        {"{\"curves\":[{\"points\":" POINTS "},{\"points\":" POINTS "}]}", "/curves"},
        {"{\"kind\":\"sideburns\",\"curves\":[{\"points\":" POINTS "},{\"point\":" POINTS "}]}", "/curves/1/point"},
        {"{\"points\":" POINTS ",\"colour\":1}", "/colour"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct groom_diag diag = {0};
        ck_status(groom_hairline_parse(cases[i].json, strlen(cases[i].json), &hairline, &diag), GROOM_EINVAL);
        ck_assert_str_eq(diag.pointer, cases[i].pointer);
        ck_assert_uint_ne(diag.detail[0], 0);
    }
}
END_TEST

/* --- edits ------------------------------------------------------------------------------------- */

START_TEST(todays_line_drawn_after_moves_roots_by_less_than_a_millimetre)
{
    set_up();
    hairlines_draw(region, HAIRLINES_SAME, 40, &hairline);
    relocate();
    ck_assert_double_lt(report.mean_move, 1e-4);
    ck_assert_double_lt(report.max_move, 2e-3);
    ck_assert_double_lt(report.density_l1, 0.005);
    tear_down();
}
END_TEST

/* Table III: at most 0.035 and 0.46, and less than the others. */
static void check_table(hairlines_shape shape)
{
    double l1[GROOM_RELOCATE_COUNT];
    hairlines_draw(region, shape, 24, &hairline);
    for (int method = GROOM_RELOCATE_COUNT - 1; method >= 0; method--) {
        hairline.method = (groom_relocate_method)method;
        relocate();
        l1[method] = report.density_l1;
    }
    ck_assert_double_le(report.density_l1, 0.035);
    ck_assert_double_le(report.density_linf, 0.46);
    ck_assert_double_lt(l1[GROOM_RELOCATE_MEMBRANE], 0.7 * l1[GROOM_RELOCATE_HARMONIC]);
    ck_assert_double_lt(l1[GROOM_RELOCATE_MEMBRANE], 0.7 * l1[GROOM_RELOCATE_THIN_PLATE]);
    ck_assert_uint_eq(report.n_flipped, 0);
    ck_assert_double_lt(report.boundary_error, 2e-3);
    ck_assert_double_gt(report.max_move, 4e-3);
}

START_TEST(the_membrane_changes_density_least_where_the_line_is_straightened) { set_up(); check_table(HAIRLINES_STRAIGHT); tear_down(); }
END_TEST
START_TEST(the_membrane_changes_density_least_where_a_peak_is_drawn) { set_up(); check_table(HAIRLINES_WIDOW); tear_down(); }
END_TEST

START_TEST(roots_stay_on_the_head_at_their_height)
{
    set_up();
    struct groom_bvh *bvh;
    struct groom_surface_point at;
    ck_ok(groom_bvh_create(head, NULL, &bvh, NULL));
    hairlines_draw(region, HAIRLINES_ROUND, 24, &hairline);
    relocate();
    for (uint32_t i = 0; i < N; i++) {
        ck_assert(groom_bvh_closest(bvh, roots[i], INFINITY, &at));
        float was = at.distance;
        ck_assert(groom_bvh_closest(bvh, moved[i], INFINITY, &at));
        ck_assert_float_eq_tol(at.distance, was, 2e-5f);
        if (roots[i][2] < -0.02f && roots[i][1] < 1.66f) /* the back is far from the edit */
            ck_assert_double_lt(distance(roots[i], moved[i]), 3e-3);
    }
    groom_bvh_destroy(bvh);
    tear_down();
}
END_TEST

START_TEST(the_same_edit_gives_the_same_bits_with_more_threads)
{
    set_up();
    static float again[N][3];
    struct groom_pool *pool;
    struct groom_scalp_region *other;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    hairlines_draw(region, HAIRLINES_WIDOW, 24, &hairline);
    relocate();
    ck_ok(groom_scalp_region_create(head, (const float (*)[3])roots, N, NULL, NULL, &context, &other, NULL, NULL));
    ck_ok(groom_hairline_relocate(other, &hairline, &context, again, NULL, NULL, NULL, NULL));
    ck_assert_mem_eq(moved, again, sizeof moved);
    groom_scalp_region_destroy(other);
    groom_pool_destroy(pool);
    tear_down();
}
END_TEST

START_TEST(a_curve_drawn_from_right_to_left_is_the_same_edit)
{
    set_up();
    static float again[N][3];
    hairlines_draw(region, HAIRLINES_ROUND, 24, &hairline);
    hairline.method = GROOM_RELOCATE_HARMONIC;
    relocate();
    struct groom_hairline_curve *curve = &hairline.curves[0];
    for (uint32_t i = 0, j = curve->n_points - 1; i < j; i++, j--) {
        float p[3];
        memcpy(p, curve->points[i], sizeof p);
        memcpy(curve->points[i], curve->points[j], sizeof p);
        memcpy(curve->points[j], p, sizeof p);
    }
    ck_ok(groom_hairline_relocate(region, &hairline, NULL, again, NULL, NULL, NULL, NULL));
    for (uint32_t i = 0; i < N; i++)
        ck_assert_double_lt(distance(moved[i], again[i]), 5e-4);
    tear_down();
}
END_TEST

START_TEST(turning_points_that_are_given_hold)
{
    set_up();
    struct groom_relocation_report free_of_them;
    hairlines_draw(region, HAIRLINES_SAME, 40, &hairline);
    hairline.method = GROOM_RELOCATE_HARMONIC;
    relocate();
    free_of_them = report;
    hairline.curves[0].n_turns = 1;
    hairline.curves[0].turns[0] = (struct groom_hairline_turn){0.5, 0.55};
    relocate();
    ck_assert_double_gt(report.max_move, free_of_them.max_move + 5e-3);
    tear_down();
}
END_TEST

/* A strip in front of the left ear, down from the scalp's edge. */
START_TEST(sideburns_move_their_side_alone)
{
    set_up();
    float front[41][3];
    groom_scalp_region_front(region, 41, front);
    memset(&hairline, 0, sizeof hairline);
    hairline.kind = GROOM_HAIRLINE_SIDEBURNS;
    hairline.n_curves = 1;
    struct groom_hairline_curve *curve = &hairline.curves[0];
    for (int i = 2; i <= 9; i++) {
        memcpy(curve->points[curve->n_points], front[i], sizeof front[i]);
        curve->points[curve->n_points++][1] -= (float)(0.012 * sin(M_PI * (i - 2) / 7));
    }
    relocate();
    double left = 0, right = 0;
    for (uint32_t i = 0; i < N; i++) {
        double d = distance(roots[i], moved[i]);
        left = roots[i][0] > 0 ? fmax(left, d) : left;
        right = roots[i][0] < -0.03f ? fmax(right, d) : right;
    }
    ck_assert_double_gt(left, 5e-3);
    ck_assert_double_lt(right, 1e-3);
    tear_down();
}
END_TEST

/* A ring on the head, the nearest points to one about `centre` across which `up` and x lead. */
static void draw_ring(const double centre[3], const double up[3], double radius)
{
    struct groom_bvh *bvh;
    hairline = (struct groom_hairline){.kind = GROOM_HAIRLINE_CROWN, .n_curves = 1, .curves[0].n_points = 16};
    ck_ok(groom_bvh_create(head, NULL, &bvh, NULL));
    for (uint32_t i = 0; i < 16; i++) {
        struct groom_surface_point near;
        float p[3];
        for (int c = 0; c < 3; c++)
            p[c] = (float)(centre[c] + radius * ((c == 0) * cos(i * M_PI / 8) + up[c] * sin(i * M_PI / 8)));
        ck_assert(groom_bvh_closest(bvh, p, INFINITY, &near));
        memcpy(hairline.curves[0].points[i], near.position, sizeof near.position);
    }
    groom_bvh_destroy(bvh);
}

/* Behind the top of the head. */
static void draw_crown(void)
{
    double top[3] = {0, -INFINITY, -0.02};
    for (uint32_t i = 0; i < head->n_vertices; i++)
        top[1] = fmax(top[1], head->points[i][1]);
    draw_ring(top, (const double[3]){0, 0, 1}, 0.035);
}

START_TEST(a_bald_crown_gives_up_what_lies_within_and_moves_nothing)
{
    set_up();
    draw_crown();
    relocate();
    const float(*ring)[3] = (const float(*)[3])hairline.curves[0].points;
    double centre[3] = {0};
    uint32_t n_bald = 0;
    for (uint32_t i = 0; i < 16; i++)
        for (int c = 0; c < 3; c++)
            centre[c] += ring[i][c] / 16;
    for (uint32_t i = 0; i < N; i++) {
        double beside = hypot(roots[i][0] - centre[0], roots[i][2] - centre[2]);
        ck_assert_double_lt(distance(roots[i], moved[i]), 1e-5);
        n_bald += bald[i];
        if (roots[i][1] > centre[1] - 0.03 && fabs(beside - 0.035) > 0.012)
            ck_assert_int_eq(bald[i], beside < 0.035);
    }
    ck_assert_uint_eq(n_bald, report.n_bald);
    ck_assert_uint_gt(n_bald, N / 100);
    ck_assert_uint_lt(n_bald, N / 4);
    tear_down();
}
END_TEST

START_TEST(a_crown_that_cannot_be_is_refused)
{
    struct groom_diag diag = {0};
    float swapped[3], front[3][3];
    set_up();
    draw_crown();
    float(*ring)[3] = hairline.curves[0].points;
    memcpy(swapped, ring[2], sizeof swapped);
    memcpy(ring[2], ring[10], sizeof swapped);
    memcpy(ring[10], swapped, sizeof swapped);
    ck_status(groom_hairline_relocate(region, &hairline, NULL, moved, bald, NULL, &report, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "crosses itself"));
    groom_scalp_region_front(region, 3, front);
    draw_ring((const double[3]){0, front[1][1] - 0.03, front[1][2] + 0.02}, (const double[3]){0, 1, 0}, 0.01); /* on the forehead */
    ck_status(groom_hairline_relocate(region, &hairline, NULL, moved, bald, NULL, &report, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "no hair grows within"));
    tear_down();
}
END_TEST

START_TEST(balding_gives_up_what_lies_before_the_curve_and_moves_nothing)
{
    set_up();
    hairlines_draw(region, HAIRLINES_RECEDING, 24, &hairline);
    hairline.kind = GROOM_HAIRLINE_BALDING;
    relocate();
    uint32_t n_bald = 0;
    for (uint32_t i = 0; i < N; i++) {
        ck_assert_double_lt(distance(roots[i], moved[i]), 1e-5);
        n_bald += bald[i];
        if (bald[i])
            ck_assert_float_gt(roots[i][2], -0.02f);
    }
    ck_assert_uint_eq(n_bald, report.n_bald);
    ck_assert_uint_gt(n_bald, N / 100);
    ck_assert_uint_lt(n_bald, N / 5);
    tear_down();
}
END_TEST

/* --- refusals -------------------------------------------------------------------------------------- */

static void check_refused(const char *pointer, const char *words)
{
    struct groom_diag diag = {0};
    memset(moved, 0, sizeof moved);
    ck_status(groom_hairline_relocate(region, &hairline, NULL, moved, NULL, NULL, NULL, &diag), GROOM_EINVAL);
    ck_assert_msg(strstr(diag.detail, words) != NULL, "\"%s\" does not say \"%s\"", diag.detail, words);
    ck_assert_msg(strncmp(diag.pointer, pointer, strlen(pointer)) == 0, "refused at %s", diag.pointer);
}

START_TEST(hairlines_that_cannot_be_are_refused_with_a_pointer)
{
    set_up();
    struct groom_hairline_curve *curve = &hairline.curves[0];
    float p[3];
    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    curve->n_points = 2;
    check_refused("/points", "3 to 512 points");

    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    curve->points[12][2] += 0.05f;
    check_refused("/points/12", "leaves the head");

    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    curve->points[12][1] = 1.40f; /* the throat */
    curve->points[12][2] = 0.05f;
    check_refused("/points/12", "leaves the head");

    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    memcpy(p, curve->points[10], sizeof p);
    memcpy(curve->points[10], curve->points[15], sizeof p);
    memcpy(curve->points[15], p, sizeof p);
    curve->points[12][1] += 0.01f;
    check_refused("/points/", "crosses itself");

    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    memmove(curve->points, curve->points + 8, 16 * sizeof *curve->points);
    curve->n_points = 16;
    check_refused("/points", "left ear");

    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    hairline.n_curves = 2;
    check_refused("/curves", "takes 1 to 1 curves");
    tear_down();
}
END_TEST

/* Over the crown and down the back, behind the held line. */
START_TEST(a_front_drawn_behind_the_back_is_refused)
{
    set_up();
    struct groom_hairline_curve *curve = &hairline.curves[0];
    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    for (uint32_t i = 1; i + 1 < 24; i++) {
        double angle = M_PI * i / 23;
        curve->points[i][0] = (float)(0.075 * cos(angle));
        curve->points[i][1] = (float)(1.64 - 0.075 * sin(angle));
        curve->points[i][2] = (float)(-0.075 * sin(angle));
    }
    check_refused("/points", "");
    tear_down();
}
END_TEST

static int yes(void *user) { return 1; }

START_TEST(cancelling_stops_the_membrane)
{
    set_up();
    const struct groom_progress progress = {.cancelled = yes};
    const struct groom_context context = {.progress = &progress};
    hairlines_draw(region, HAIRLINES_WIDOW, 24, &hairline);
    ck_status(groom_hairline_relocate(region, &hairline, &context, moved, NULL, NULL, NULL, NULL), GROOM_ECANCELLED);
    tear_down();
}
END_TEST

START_TEST(every_allocation_may_fail)
{
    set_up();
    struct test_failing_allocator state;
    struct groom_allocator allocator;
    struct groom_scalp_region *other;
    for (size_t fail_at = 0;; fail_at++) {
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = groom_scalp_region_create(head, (const float (*)[3])roots, N, NULL, NULL, &context, &other, NULL, NULL);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
    }
    hairlines_draw(region, HAIRLINES_SAME, 24, &hairline);
    size_t held = state.outstanding_bytes;
    for (int method = 0; method < GROOM_RELOCATE_COUNT; method++)
        for (size_t more = 1;; more++) {
            hairline.method = (groom_relocate_method)method;
            state.fail_at = state.n_allocations + more;
            groom_status st = groom_hairline_relocate(other, &hairline, NULL, moved, NULL, NULL, NULL, NULL);
            ck_assert_uint_eq(state.outstanding_bytes, held);
            if (st == GROOM_OK)
                break;
            ck_status(st, GROOM_ENOMEM);
        }
    groom_scalp_region_destroy(other);
    ck_assert_uint_eq(state.outstanding_bytes, 0);
    tear_down();
}
END_TEST

TEST_SUITE("hairline", gradient_and_hessian_are_the_energys_differences,
           the_projected_hessian_never_falls_and_is_the_hessian_at_rest, a_collapsed_triangle_costs_infinitely_much,
           the_region_holds_all_roots_and_parts_at_the_ears,
           sparse_roots_on_a_fine_mesh_make_one_region_without_holes, regions_that_cannot_be_are_refused,
           a_hairline_prints_as_what_reads_the_same, unsound_hairlines_are_refused_at_their_field,
           todays_line_drawn_after_moves_roots_by_less_than_a_millimetre,
           the_membrane_changes_density_least_where_the_line_is_straightened,
           the_membrane_changes_density_least_where_a_peak_is_drawn, roots_stay_on_the_head_at_their_height,
           the_same_edit_gives_the_same_bits_with_more_threads, a_curve_drawn_from_right_to_left_is_the_same_edit,
           turning_points_that_are_given_hold, sideburns_move_their_side_alone,
           balding_gives_up_what_lies_before_the_curve_and_moves_nothing,
           a_bald_crown_gives_up_what_lies_within_and_moves_nothing, a_crown_that_cannot_be_is_refused,
           hairlines_that_cannot_be_are_refused_with_a_pointer, a_front_drawn_behind_the_back_is_refused,
           cancelling_stops_the_membrane, every_allocation_may_fail)
