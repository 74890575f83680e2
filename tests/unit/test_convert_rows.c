/* Conversion's kernels that work on four at a time: against the plain ones, and the same bits for every
 * instruction set. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "curvature/element.h"
#include "curvature/helix.h"
#include "curvature/helix_rows.h"
#include "curvature/refine.h"
#include "curvature/spline.h"
#include "curvature/spline_rows.h"
#include "curvature/trig_rows.h"
#include "groom/random.h"
#include "tests/support/test.h"

enum { N = 203 }; /* not a multiple of four */

static double normal(uint32_t i, uint32_t k) { return groom_random_normal((struct groom_random_key){5, 5}, i, k); }

static vec3 unit(vec3 a) { return vec_scale(1.0 / sqrt(vec_dot(a, a)), a); }

#if defined(__x86_64__) && defined(__GNUC__)
static int has_avx2(void) { return __builtin_cpu_supports("avx2"); }
#else
static int has_avx2(void) { return 0; }
#endif

/* --- trigonometry -------------------------------------------------------------------------- */

/* aligned, as the kernel asks */
static double *row(void) { return aligned_alloc(64, sizeof(double) * 256); }

START_TEST(rows_of_trigonometry_are_those_of_single_angles)
{
    struct trig_rows a = {row(), row(), row(), row(), row(), row()}, b = {a.x, row(), row(), row(), row(), row()};
    for (uint32_t i = 0; i < 256; i++)
        a.x[i] = i < N ? pow(10.0, -12.0 + 15.0 * i / N) : 0.0;
    trig_rows_generic(&a, N);
    for (uint32_t i = 0; i < N; i++) {
        trig5 f = trig5_of(a.x[i]);
        ck_assert(f.A == a.A[i] && f.B == a.B[i] && f.C == a.C[i] && f.B1 == a.B1[i] && f.C1 == a.C1[i]);
    }
#if defined(__x86_64__) && defined(__GNUC__)
    if (has_avx2()) {
        trig_rows_avx2(&b, N);
        ck_assert_mem_eq(a.A, b.A, N * sizeof(double));
        ck_assert_mem_eq(a.C, b.C, N * sizeof(double));
        ck_assert_mem_eq(a.C1, b.C1, N * sizeof(double));
    }
#endif
    free(a.x), free(a.A), free(a.B), free(a.C), free(a.B1), free(a.C1);
    free(b.A), free(b.B), free(b.C), free(b.B1), free(b.C1);
}
END_TEST

/* --- helices --------------------------------------------------------------------------------- */

/* Pairs of every kind: gentle, wild, straight, contradictory. */
static void make_pairs(vec3 *p, vec3 *t)
{
    p[0] = (vec3){0.0, 0.0, 0.0};
    t[0] = (vec3){0.0, 1.0, 0.0};
    for (uint32_t i = 0; i < N; i++) {
        double bend = i % 7 == 6 ? 0.0 : i % 7 == 5 ? 3.0 : 0.3;
        t[i + 1] = unit((vec3){t[i].x + bend * normal(i, 0), t[i].y + bend * normal(i, 1), t[i].z + bend * normal(i, 2)});
        vec3 way = vec_add(t[i], t[i + 1]);
        if (i % 11 == 10)
            way = (vec3){normal(i, 3), normal(i, 4), normal(i, 5)};
        p[i + 1] = vec_add(p[i], vec_scale(0.001, way));
    }
    double work[2 * N];
    helix_float_points(N, p, t, work);
}

START_TEST(rows_of_helices_are_those_of_single_pairs)
{
    static vec3 p[N + 1], t[N + 1];
    static double omega[N][3], length[N], omega2[N][3], length2[N];
    make_pairs(p, t);
    helix_chain_generic(N, (const double (*)[3])p, (const double (*)[3])t, omega, length);
    for (uint32_t i = 0; i < N; i++) {
        struct helix want = helix_through(p[i], t[i], p[i + 1], t[i + 1]);
        double size = sqrt(vec_dot(want.omega, want.omega)) + 1.0;
        ck_assert_double_eq_tol(length[i], want.length, 1e-10 * want.length);
        ck_assert_double_eq_tol(omega[i][0], want.omega.x, 1e-9 * size);
        ck_assert_double_eq_tol(omega[i][1], want.omega.y, 1e-9 * size);
        ck_assert_double_eq_tol(omega[i][2], want.omega.z, 1e-9 * size);
    }
#if defined(__x86_64__) && defined(__GNUC__)
    if (has_avx2()) {
        helix_chain_avx2(N, (const double (*)[3])p, (const double (*)[3])t, omega2, length2);
        ck_assert_mem_eq(omega, omega2, sizeof omega);
        ck_assert_mem_eq(length, length2, sizeof length);
    }
#endif
    /* a pair does not see its neighbours */
    helix_chain(1, (const double (*)[3])(p + 5), (const double (*)[3])(t + 5), omega2, length2);
    ck_assert_mem_eq(omega2[0], omega[5], sizeof omega[5]);
}
END_TEST

/* --- splines ----------------------------------------------------------------------------------- */

START_TEST(rows_of_splines_are_the_same_bits_for_every_instruction_set)
{
    static vec3 point[N], slope[N];
    static double h[N + 3], arc[N], work[N], rate[9 * (N + 3)], arc2[N], at[N], p[2][N][3], t[2][N][3];
    struct spline s = {.n = N, .point = point, .slope = slope, .h = h, .arc = arc, .work = work, .rate = rate};
    for (uint32_t i = 0; i < N; i++) {
        point[i] = (vec3){0.01 * cos(0.2 * i), 0.001 * i, 0.01 * sin(0.2 * i) + 1e-4 * normal(i, 7)};
        if (i) {
            vec3 d = vec_sub(point[i], point[i - 1]);
            h[i - 1] = sqrt(vec_dot(d, d));
        }
    }
    spline_solve(&s);
    for (uint32_t i = 0; i < N; i++)
        at[i] = arc[N - 1] * i / (N - 1);
    struct spline_curve curve = {N, rate, h, arc, (const double (*)[3])point};
    spline_stations_generic(&curve, at, N, p[0], t[0]);
    for (uint32_t i = 0; i < N; i++)
        ck_assert_double_eq_tol(t[0][i][0] * t[0][i][0] + t[0][i][1] * t[0][i][1] + t[0][i][2] * t[0][i][2], 1.0, 1e-12);
    for (int c = 0; c < 3; c++)
        ck_assert_double_eq_tol(p[0][N - 1][c], ((double *)&point[N - 1])[c], 1e-12);
#if defined(__x86_64__) && defined(__GNUC__)
    if (has_avx2()) {
        spline_arcs_generic(N, rate, h, arc2);
        ck_assert_mem_eq(arc, arc2, sizeof arc);
        spline_stations_avx2(&curve, at, N, p[1], t[1]);
        ck_assert_mem_eq(p[0], p[1], sizeof p[0]);
        ck_assert_mem_eq(t[0], t[1], sizeof t[0]);
    }
#endif
}
END_TEST

TEST_SUITE("convert_rows", rows_of_trigonometry_are_those_of_single_angles, rows_of_helices_are_those_of_single_pairs,
           rows_of_splines_are_the_same_bits_for_every_instruction_set)
