/* scalp coordinates: when the head's own serve, when they are computed, and that distance is distance */
#include <math.h>
#include <string.h>

#include "groom/random.h"
#include "groom/scalp.h"
#include "tests/support/test.h"

enum { N = 3000, ROWS = 40, COLUMNS = 80 };

enum atlas { NONE, POLAR, SEAM, MIRRORED };

/* The upper half of a ball of 0.1 m, with texture coordinates of one kind or another. */
static struct groom_mesh *dome(enum atlas atlas)
{
    struct groom_mesh *mesh;
    uint32_t n = (ROWS + 1) * (COLUMNS + 1), t = 0;
    ck_ok(groom_mesh_create(n, 2 * ROWS * COLUMNS, atlas ? n : 0, NULL, &mesh, NULL));
    for (uint32_t i = 0; i <= ROWS; i++)
        for (uint32_t j = 0; j <= COLUMNS; j++) {
            double theta = M_PI / 2 * i / ROWS, phi = 2 * M_PI * (j % COLUMNS) / COLUMNS;
            uint32_t v = i * (COLUMNS + 1) + j;
            mesh->points[v][0] = (float)(0.1 * sin(theta) * sin(phi));
            mesh->points[v][1] = (float)(0.1 * cos(theta));
            mesh->points[v][2] = (float)(0.1 * sin(theta) * cos(phi));
            if (atlas == POLAR || atlas == MIRRORED) {
                double u = 0.1 * theta * sin(phi);
                mesh->uvs[v][0] = (float)(0.3 + (atlas == MIRRORED ? fabs(u) : u));
                mesh->uvs[v][1] = (float)(0.7 + 0.1 * theta * cos(phi));
            } else if (atlas == SEAM) {
                mesh->uvs[v][0] = (float)j / COLUMNS;
                mesh->uvs[v][1] = (float)i / ROWS;
            }
        }
    for (uint32_t i = 0; i < ROWS; i++)
        for (uint32_t j = 0; j < COLUMNS; j++) {
            uint32_t a = i * (COLUMNS + 1) + j, b = a + 1, c = a + COLUMNS + 1, d = c + 1;
            memcpy(mesh->triangles[t++], (uint32_t[3]){a, c, d}, sizeof *mesh->triangles);
            memcpy(mesh->triangles[t++], (uint32_t[3]){a, d, b}, sizeof *mesh->triangles);
        }
    if (atlas)
        memcpy(mesh->uv_triangles, mesh->triangles, mesh->n_triangles * sizeof *mesh->triangles);
    return mesh;
}

/* Roots over the cap within 60 degrees of the top, a little off the surface. */
static void cap(float (*roots)[3], uint32_t n)
{
    struct groom_random_key key = {3, 1};
    for (uint32_t i = 0; i < n; i++) {
        double z = 1 - 0.5 * groom_random_uniform(key, i, 0), phi = 2 * M_PI * groom_random_uniform(key, i, 1);
        double r = 0.1 + 0.002 * groom_random_uniform(key, i, 2), s = sqrt(1 - z * z);
        roots[i][0] = (float)(r * s * sin(phi));
        roots[i][1] = (float)(r * z);
        roots[i][2] = (float)(r * s * cos(phi));
    }
}

static struct groom_scalp *chart_of(const float (*roots)[3], uint32_t n, const struct groom_bvh *bvh)
{
    struct groom_scalp *scalp;
    struct groom_diag diag = {0};
    groom_status st = groom_scalp_create(roots, n, bvh, NULL, &scalp, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    ck_assert(groom_scalp_note(scalp)[0] != '\0');
    return scalp;
}

/* Within the cap, chart distance times metres is distance on the ball, to a fifth or so. */
static void check_distances(const struct groom_scalp *scalp, const float (*roots)[3], uint32_t n)
{
    static float uv[N][2];
    float low[2] = {1, 1}, high[2] = {0, 0};
    groom_scalp_coordinates(scalp, roots, n, uv, NULL);
    for (uint32_t i = 0; i < n; i++) {
        for (int k = 0; k < 2; k++) {
            ck_assert(uv[i][k] >= 0 && uv[i][k] <= 1);
            low[k] = fminf(low[k], uv[i][k]);
            high[k] = fmaxf(high[k], uv[i][k]);
        }
        uint32_t j = (i + 1) % n;
        double dot = 0, li = 0, lj = 0;
        for (int k = 0; k < 3; k++) {
            dot += roots[i][k] * roots[j][k];
            li += roots[i][k] * roots[i][k];
            lj += roots[j][k] * roots[j][k];
        }
        double metres = 0.1 * acos(fmin(1, dot / sqrt(li * lj)));
        double chart = hypot(uv[i][0] - uv[j][0], uv[i][1] - uv[j][1]) * groom_scalp_metres(scalp);
        ck_assert_msg(fabs(chart - metres) < 0.25 * metres + 1e-3, "root %u: %g m on the chart, %g on the scalp", i, chart, metres);
    }
    ck_assert_float_eq_tol(fmaxf(high[0] - low[0], high[1] - low[1]), 1, 1e-4f);
}

START_TEST(texture_coordinates_that_serve_are_taken)
{
    static float roots[N][3];
    struct groom_mesh *mesh = dome(POLAR);
    struct groom_bvh *bvh;
    cap(roots, N);
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    struct groom_scalp *scalp = chart_of((const float(*)[3])roots, N, bvh);
    ck_assert_int_eq(groom_scalp_source_of(scalp), GROOM_SCALP_MESH_UV);
    ck_assert_str_eq(groom_scalp_source_name(groom_scalp_source_of(scalp)), "mesh_uv");
    check_distances(scalp, (const float(*)[3])roots, N);
    groom_scalp_destroy(scalp);
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(seams_mirrors_and_missing_coordinates_are_computed_around)
{
    static float roots[N][3];
    static const enum atlas atlases[] = {NONE, SEAM, MIRRORED};
    cap(roots, N);
    for (int i = 0; i < 3; i++) {
        struct groom_mesh *mesh = dome(atlases[i]);
        struct groom_bvh *bvh;
        ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
        struct groom_scalp *scalp = chart_of((const float(*)[3])roots, N, bvh);
        ck_assert_msg(groom_scalp_source_of(scalp) == GROOM_SCALP_COMPUTED, "atlas %d: %s", i, groom_scalp_note(scalp));
        check_distances(scalp, (const float(*)[3])roots, N);
        groom_scalp_destroy(scalp);
        groom_bvh_destroy(bvh);
        groom_mesh_destroy(mesh);
    }
}
END_TEST

START_TEST(roots_alone_make_a_chart)
{
    static float roots[N][3];
    cap(roots, N);
    struct groom_scalp *scalp = chart_of((const float(*)[3])roots, N, NULL);
    ck_assert_int_eq(groom_scalp_source_of(scalp), GROOM_SCALP_ROOTS);
    check_distances(scalp, (const float(*)[3])roots, N);
    /* seen from above with the back up, the left of the person (+x) is on the right */
    float uv[3][2], places[3][3] = {{0, 0.1f, 0}, {0.05f, 0.0866f, 0}, {0, 0.0866f, -0.05f}};
    groom_scalp_coordinates(scalp, (const float(*)[3])places, 3, uv, NULL);
    ck_assert_float_gt(uv[1][0], uv[0][0] + 0.1f);
    ck_assert_float_gt(uv[2][1], uv[0][1] + 0.1f);
    groom_scalp_destroy(scalp);
}
END_TEST

START_TEST(few_flat_and_lined_up_roots_have_coordinates)
{
    static const float cases[][5][3] = {
        {{0, 0.1f, 0}},                                                                    /* one place, five times */
        {{0, 0.1f, 0}, {0.01f, 0.1f, 0}, {0.02f, 0.1f, 0}, {0.03f, 0.1f, 0}, {0.05f, 0.1f, 0}}, /* a line */
        {{0, 0, 0}, {0.01f, 0, 0}, {0, 0, 0.01f}, {0.01f, 0, 0.01f}, {0.02f, 0, 0.01f}},   /* a plane */
        {{NAN, 0, 0}, {0, 0.1f, 0}, {0.01f, 0.1f, 0}, {0, 0.1f, INFINITY}, {0, 0.1f, 0.01f}}};
    struct groom_mesh *mesh = dome(POLAR);
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (int c = 0; c < 4; c++)
        for (int with_head = 0; with_head < 2; with_head++)
            for (uint32_t n = c == 3 ? 2 : 1; n <= 5; n++) {
                float uv[5][2];
                struct groom_scalp *scalp = chart_of(cases[c], n, with_head ? bvh : NULL);
                groom_scalp_coordinates(scalp, cases[c], n, uv, NULL);
                for (uint32_t i = 0; i < n; i++)
                    ck_assert(uv[i][0] >= 0 && uv[i][0] <= 1 && uv[i][1] >= 0 && uv[i][1] <= 1);
                ck_assert(isfinite(groom_scalp_metres(scalp)) && groom_scalp_metres(scalp) > 0);
                if (c == 1 && n == 5 && !with_head)
                    ck_assert_float_eq_tol(hypotf(uv[0][0] - uv[4][0], uv[0][1] - uv[4][1]), 1, 1e-3f);
                groom_scalp_destroy(scalp);
            }
    struct groom_scalp *none = NULL;
    ck_status(groom_scalp_create(cases[3], 1, NULL, NULL, &none, NULL), GROOM_EEMPTY);
    ck_status(groom_scalp_create(cases[3], 0, NULL, NULL, &none, NULL), GROOM_EEMPTY);
    ck_status(groom_scalp_create(cases[3], 1, bvh, NULL, &none, NULL), GROOM_EEMPTY);
    ck_assert_ptr_null(none);
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(coordinates_are_the_same_bits_for_1_and_3_threads)
{
    static float roots[N][3], uv[2][N][2];
    struct groom_mesh *mesh = dome(SEAM);
    struct groom_bvh *bvh;
    cap(roots, N);
    for (uint32_t run = 0; run < 2; run++) {
        struct groom_pool *pool;
        struct groom_scalp *scalp;
        ck_ok(groom_pool_create(run ? 3 : 1, &pool));
        struct groom_context context = {.pool = pool};
        ck_ok(groom_bvh_create(mesh, &context, &bvh, NULL));
        ck_ok(groom_scalp_create((const float(*)[3])roots, N, bvh, &context, &scalp, NULL));
        groom_scalp_coordinates(scalp, (const float(*)[3])roots, N, uv[run], &context);
        groom_scalp_destroy(scalp);
        groom_bvh_destroy(bvh);
        groom_pool_destroy(pool);
    }
    ck_assert_mem_eq(uv[0], uv[1], sizeof uv[0]);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(each_failing_allocation_is_reported_and_leaks_nothing)
{
    static float roots[64][3];
    struct groom_mesh *mesh = dome(POLAR);
    struct groom_bvh *bvh;
    cap(roots, 64);
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_scalp *scalp = NULL;
        test_failing_allocator_init(&state, fail_at, &allocator);
        groom_status st = groom_scalp_create((const float(*)[3])roots, 64, bvh, &(struct groom_context){.allocator = &allocator}, &scalp, NULL);
        groom_scalp_destroy(scalp);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_assert_int_eq(st, GROOM_ENOMEM);
        ck_assert_uint_lt(fail_at, 100);
    }
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

TEST_SUITE("scalp", texture_coordinates_that_serve_are_taken, seams_mirrors_and_missing_coordinates_are_computed_around,
           roots_alone_make_a_chart, few_flat_and_lined_up_roots_have_coordinates,
           coordinates_are_the_same_bits_for_1_and_3_threads, each_failing_allocation_is_reported_and_leaks_nothing)
