/* closest points, rays, inside; nearest neighbours; Delaunay: against brute force */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/random.h"
#include "groom/spatial.h"
#include "tests/support/test.h"

static float uniform(uint32_t index, uint32_t draw)
{
    return groom_random_uniform((struct groom_random_key){11, 5}, index, draw);
}

/* --- meshes to ask ------------------------------------------------------------- */

/* A closed sphere of radius 1 about the origin, 2 n (n - 1) triangles; `rows` of latitude from the top. */
static struct groom_mesh *sphere(uint32_t n, uint32_t rows)
{
    struct groom_mesh *mesh;
    uint32_t columns = 2 * n, t = 0;
    ck_ok(groom_mesh_create((n + 1) * columns, 2 * columns * rows, 0, NULL, &mesh, NULL));
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j < columns; j++) {
            double theta = M_PI * i / n, phi = 2 * M_PI * j / columns;
            double s = i == n ? 0 : sin(theta);
            float *p = mesh->points[i * columns + j];
            p[0] = (float)(s * sin(phi));
            p[1] = (float)cos(theta);
            p[2] = (float)(s * cos(phi));
        }
    for (uint32_t i = 0; i < rows; i++)
        for (uint32_t j = 0; j < columns; j++) {
            uint32_t a = i * columns + j, b = i * columns + (j + 1) % columns, c = a + columns, d = b + columns;
            memcpy(mesh->triangles[t++], (uint32_t[3]){a, c, d}, sizeof *mesh->triangles);
            memcpy(mesh->triangles[t++], (uint32_t[3]){a, d, b}, sizeof *mesh->triangles);
        }
    return mesh;
}

static struct groom_mesh *soup(uint32_t n)
{
    struct groom_mesh *mesh;
    ck_ok(groom_mesh_create(3 * n, n, 0, NULL, &mesh, NULL));
    for (uint32_t i = 0; i < 3 * n; i++) {
        for (uint32_t k = 0; k < 3; k++)
            mesh->points[i][k] = uniform(i / 3, k) + 0.2f * uniform(i, 3 + k);
        mesh->triangles[i / 3][i % 3] = i;
    }
    memcpy(mesh->points[1], mesh->points[0], sizeof *mesh->points); /* one is a segment */
    memcpy(mesh->points[4], mesh->points[3], sizeof *mesh->points); /* one is a point */
    memcpy(mesh->points[5], mesh->points[3], sizeof *mesh->points);
    return mesh;
}

/* --- brute force ---------------------------------------------------------------- */

/* the least distance to a triangle by sampling its weights finely, then closing in */
static double triangle_distance(const struct groom_mesh *mesh, uint32_t t, const float p[3])
{
    double best = INFINITY, bu = 0, bv = 0, step = 0.25;
    for (int round = 0; round < 24; round++, step *= 0.5) {
        double cu = bu, cv = bv;
        for (int i = -4; i <= 4; i++)
            for (int j = -4; j <= 4; j++) {
                double u = fmin(1, fmax(0, cu + i * step)), v = fmin(1 - u, fmax(0, cv + j * step)), d = 0;
                for (int k = 0; k < 3; k++) {
                    const uint32_t *c = mesh->triangles[t];
                    double q = mesh->points[c[0]][k] * (1 - u - v) + mesh->points[c[1]][k] * u + mesh->points[c[2]][k] * v - p[k];
                    d += q * q;
                }
                if (d < best) {
                    best = d;
                    bu = u;
                    bv = v;
                }
            }
    }
    return sqrt(best);
}

START_TEST(closest_point_is_the_least_of_all_triangles)
{
    struct groom_mesh *mesh = soup(60);
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (uint32_t q = 0; q < 60; q++) {
        float p[3] = {3 * uniform(q, 20) - 1, 3 * uniform(q, 21) - 1, 3 * uniform(q, 22) - 1};
        struct groom_surface_point s;
        double least = INFINITY;
        for (uint32_t t = 0; t < mesh->n_triangles; t++)
            least = fmin(least, triangle_distance(mesh, t, p));
        ck_assert_int_eq(groom_bvh_closest(bvh, p, INFINITY, &s), 1);
        ck_assert_double_eq_tol(s.distance, least, 1e-4);
        double length = 0;
        for (int k = 0; k < 3; k++) {
            double x = 0;
            for (int i = 0; i < 3; i++)
                x += s.barycentric[i] * mesh->points[mesh->triangles[s.triangle][i]][k];
            ck_assert_double_eq_tol(x, s.position[k], 1e-6);
            length += (s.position[k] - p[k]) * (s.position[k] - p[k]);
        }
        ck_assert_double_eq_tol(sqrt(length), s.distance, 1e-6);
        ck_assert_int_eq(groom_bvh_closest(bvh, p, (float)least * 0.99f, &s), 0);
        ck_assert_int_eq(groom_bvh_closest(bvh, p, (float)least * 1.01f, &s), 1);
    }
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(ties_go_to_the_lower_triangle)
{
    struct groom_mesh *mesh = sphere(8, 8);
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (uint32_t v = 0; v < mesh->n_vertices; v++) {
        struct groom_surface_point s;
        float p[3] = {mesh->points[v][0] * 2, mesh->points[v][1] * 2, mesh->points[v][2] * 2};
        uint32_t lowest = UINT32_MAX;
        ck_assert_int_eq(groom_bvh_closest(bvh, p, INFINITY, &s), 1);
        for (uint32_t t = 0; t < mesh->n_triangles && lowest == UINT32_MAX; t++)
            for (int i = 0; i < 3; i++)
                if (memcmp(mesh->points[mesh->triangles[t][i]], mesh->points[v], sizeof *mesh->points) == 0)
                    lowest = t;
        if (v >= 16 && v < 128) /* away from the poles, whose points differ in their last bits */
            ck_assert_uint_eq(s.triangle, lowest);
        float dot = s.normal[0] * p[0] + s.normal[1] * p[1] + s.normal[2] * p[2];
        ck_assert_float_gt(dot, 1.9f); /* the pseudo-normal of a vertex points outwards */
    }
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

/* Moeller and Trumbore in double */
static int hits(const struct groom_mesh *mesh, uint32_t t, const float o[3], const float d[3], double *at)
{
    const uint32_t *v = mesh->triangles[t];
    double e[3], f[3], s[3], p[3], q[3], a = 0, u = 0, w = 0, r = 0;
    for (int k = 0; k < 3; k++) {
        e[k] = (double)mesh->points[v[1]][k] - mesh->points[v[0]][k];
        f[k] = (double)mesh->points[v[2]][k] - mesh->points[v[0]][k];
        s[k] = (double)o[k] - mesh->points[v[0]][k];
    }
    for (int k = 0; k < 3; k++)
        p[k] = d[(k + 1) % 3] * f[(k + 2) % 3] - d[(k + 2) % 3] * f[(k + 1) % 3];
    for (int k = 0; k < 3; k++)
        a += e[k] * p[k], u += s[k] * p[k];
    for (int k = 0; k < 3; k++)
        q[k] = s[(k + 1) % 3] * e[(k + 2) % 3] - s[(k + 2) % 3] * e[(k + 1) % 3];
    for (int k = 0; k < 3; k++)
        w += d[k] * q[k], r += f[k] * q[k];
    if (a == 0)
        return 0;
    u /= a, w /= a, r /= a;
    *at = r;
    return u >= 0 && w >= 0 && u + w <= 1 && r >= 0;
}

START_TEST(rays_hit_the_first_of_all_triangles)
{
    struct groom_mesh *mesh = soup(300);
    struct groom_bvh *bvh;
    int n_hits = 0;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (uint32_t q = 0; q < 500; q++) {
        float o[3], d[3];
        for (uint32_t k = 0; k < 3; k++) {
            o[k] = 3 * uniform(q, 30 + k) - 1;
            d[k] = 0.6f + 0.3f * uniform(q, 33 + k) - o[k];
        }
        struct groom_surface_point s;
        double first = INFINITY, at;
        for (uint32_t t = 0; t < mesh->n_triangles; t++)
            if (hits(mesh, t, o, d, &at))
                first = fmin(first, at);
        int hit = groom_bvh_ray(bvh, o, d, 0, INFINITY, &s);
        ck_assert_int_eq(hit, isfinite(first));
        ck_assert_int_eq(groom_bvh_occluded(bvh, o, d, 0, INFINITY), hit);
        if (hit) {
            n_hits++;
            ck_assert_double_eq_tol(s.distance, first, 1e-4);
            for (int k = 0; k < 3; k++)
                ck_assert_double_eq_tol(s.position[k], o[k] + d[k] * first, 1e-4);
            ck_assert_int_eq(groom_bvh_occluded(bvh, o, d, 0, s.distance * 0.999f), 0);
        }
    }
    ck_assert_int_gt(n_hits, 100);
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(signed_distance_of_a_sphere_is_the_radius_less_one)
{
    struct groom_mesh *mesh = sphere(48, 48);
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (uint32_t q = 0; q < 500; q++) {
        float p[3] = {3 * uniform(q, 40) - 1.5f, 3 * uniform(q, 41) - 1.5f, 3 * uniform(q, 42) - 1.5f};
        double r = sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]);
        ck_assert_double_eq_tol(groom_bvh_signed_distance(bvh, p), r - 1, 3e-3);
        if (fabs(r - 1) > 5e-3) {
            struct groom_surface_point s;
            ck_assert_double_eq_tol(groom_bvh_winding(bvh, p), (r < 1 ? 1 : 0), 0.05);
            ck_assert_int_eq(groom_bvh_closest(bvh, p, INFINITY, &s), 1);
            float side = 0;
            for (int k = 0; k < 3; k++)
                side += (p[k] - s.position[k]) * s.normal[k];
            ck_assert_int_eq(side < 0, r < 1);
        }
    }
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(inside_stands_open_doubled_and_turned_over_surfaces)
{
    struct groom_mesh *open = sphere(32, 24), *turned = sphere(32, 32); /* a head cut at the neck; one inside out */
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(open, NULL, &bvh, NULL));
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){0, 0.9f, 0}), 1);
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){0, 0, 0}), 1);
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){0.9f, 0, 0}), 1);
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){0, 1.1f, 0}), 0);
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){1.1f, 0, 0}), 0);
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){0, -1.5f, 0}), 0);
    groom_bvh_destroy(bvh);
    for (uint32_t t = 0; t < turned->n_triangles; t++) {
        uint32_t swap = turned->triangles[t][0];
        turned->triangles[t][0] = turned->triangles[t][1];
        turned->triangles[t][1] = swap;
    }
    ck_ok(groom_bvh_create(turned, NULL, &bvh, NULL));
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){0, 0.9f, 0}), 1);
    ck_assert_int_eq(groom_bvh_inside(bvh, (float[]){0, 1.1f, 0}), 0);
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(open);
    groom_mesh_destroy(turned);
}
END_TEST

START_TEST(winding_agrees_with_the_sum_over_all_triangles)
{
    struct groom_mesh *mesh = soup(800);
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (uint32_t q = 0; q < 200; q++) {
        float p[3] = {3 * uniform(q, 50) - 1, 3 * uniform(q, 51) - 1, 3 * uniform(q, 52) - 1};
        double sum = 0;
        for (uint32_t t = 0; t < mesh->n_triangles; t++) {
            double r[3][3], l[3] = {0, 0, 0}, dots[3] = {0, 0, 0};
            for (int i = 0; i < 3; i++)
                for (int k = 0; k < 3; k++) {
                    r[i][k] = (double)mesh->points[mesh->triangles[t][i]][k] - p[k];
                    l[i] += r[i][k] * r[i][k];
                }
            for (int i = 0; i < 3; i++) {
                l[i] = sqrt(l[i]);
                for (int k = 0; k < 3; k++)
                    dots[i] += r[(i + 1) % 3][k] * r[(i + 2) % 3][k];
            }
            double det = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                         r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
            if (det != 0)
                sum += atan2(det, l[0] * l[1] * l[2] + dots[0] * l[0] + dots[1] * l[1] + dots[2] * l[2]) / (2 * M_PI);
        }
        ck_assert_double_eq_tol(groom_bvh_winding(bvh, p), sum, 0.05);
    }
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(bad_queries_and_meshes_are_answered_calmly)
{
    struct groom_mesh *mesh = sphere(4, 4), *empty;
    struct groom_bvh *bvh, *none = NULL;
    struct groom_surface_point s;
    float nan_point[3] = {NAN, 0, 0}, origin[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    ck_assert_int_eq(groom_bvh_closest(bvh, nan_point, INFINITY, &s), 0);
    ck_assert_int_eq(groom_bvh_closest(bvh, origin, NAN, &s), 0);
    ck_assert_int_eq(groom_bvh_ray(bvh, nan_point, up, 0, INFINITY, &s), 0);
    ck_assert_int_eq(groom_bvh_ray(bvh, origin, nan_point, 0, INFINITY, &s), 0);
    ck_assert_int_eq(groom_bvh_ray(bvh, origin, origin, 0, INFINITY, &s), 0);
    ck_assert_int_eq(groom_bvh_ray(bvh, origin, up, 2, 1, &s), 0);
    ck_assert_float_eq(groom_bvh_winding(bvh, nan_point), 0);
    ck_assert(isinf(groom_bvh_signed_distance(bvh, nan_point)));
    groom_bvh_closest_points(bvh, (const float(*)[3])nan_point, 1, &s, NULL);
    ck_assert_uint_eq(s.triangle, UINT32_MAX);
    groom_bvh_destroy(bvh);
    mesh->triangles[0][0] = 99999;
    ck_status(groom_bvh_create(mesh, NULL, &none, NULL), GROOM_EINVAL);
    mesh->triangles[0][0] = 0;
    mesh->points[0][1] = NAN;
    ck_status(groom_bvh_create(mesh, NULL, &none, NULL), GROOM_EINVAL);
    ck_ok(groom_mesh_create(0, 0, 0, NULL, &empty, NULL));
    ck_status(groom_bvh_create(empty, NULL, &none, NULL), GROOM_EEMPTY);
    ck_assert_ptr_null(none);
    groom_bvh_destroy(NULL);
    groom_mesh_destroy(empty);
    groom_mesh_destroy(mesh);
}
END_TEST

static int n_process_threads(void)
{
    char line[128];
    int n = 0;
    FILE *status = fopen("/proc/self/status", "r");
    while (status && fgets(line, sizeof line, status))
        if (sscanf(line, "Threads: %d", &n) == 1)
            break;
    if (status)
        fclose(status);
    return n;
}

START_TEST(indexing_a_mesh_starts_no_thread)
{
    struct groom_mesh *mesh = sphere(100, 100);
    struct groom_bvh *bvh;
    int before = n_process_threads();
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    ck_assert_int_eq(n_process_threads(), before);
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(many_queries_are_the_same_bits_for_1_and_3_threads)
{
    enum { N = 5000 };
    static float points[N][3], distances[2][N];
    static struct groom_surface_point closest[2][N];
    static uint32_t ids[2][N * 5];
    static float squared[2][N * 5];
    struct groom_mesh *mesh = sphere(24, 20);
    struct groom_bvh *bvh;
    struct groom_neighbours *nb;
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < 3; k++)
            points[i][k] = 3 * uniform(i, 60 + k) - 1.5f;
    for (uint32_t run = 0; run < 2; run++) {
        struct groom_pool *pool;
        ck_ok(groom_pool_create(run ? 3 : 1, &pool));
        struct groom_context context = {.pool = pool};
        ck_ok(groom_bvh_create(mesh, &context, &bvh, NULL));
        groom_bvh_closest_points(bvh, (const float(*)[3])points, N, closest[run], &context);
        groom_bvh_signed_distances(bvh, (const float(*)[3])points, N, distances[run], &context);
        ck_ok(groom_neighbours_create((float *)points, N, 3, &context, &nb, NULL));
        ck_ok(groom_neighbours_find(nb, (float *)points, N, 5, ids[run], squared[run], &context, NULL));
        groom_neighbours_destroy(nb);
        groom_bvh_destroy(bvh);
        groom_pool_destroy(pool);
    }
    ck_assert_mem_eq(closest[0], closest[1], sizeof closest[0]);
    ck_assert_mem_eq(distances[0], distances[1], sizeof distances[0]);
    ck_assert_mem_eq(ids[0], ids[1], sizeof ids[0]);
    ck_assert_mem_eq(squared[0], squared[1], sizeof squared[0]);
    groom_mesh_destroy(mesh);
}
END_TEST

/* --- nearest neighbours ----------------------------------------------------------- */

struct scored { double squared; uint32_t id; };
static int by_score(const void *a, const void *b)
{
    const struct scored *p = a, *q = b;
    return p->squared != q->squared ? (p->squared < q->squared ? -1 : 1) : p->id < q->id ? -1 : p->id > q->id;
}

static void check_against_brute_force(const float *points, uint32_t n, uint32_t dimension, uint32_t k)
{
    struct groom_neighbours *nb;
    uint32_t ids[64];
    float squared[64];
    struct scored *all = malloc(n * sizeof *all);
    ck_ok(groom_neighbours_create(points, n, dimension, NULL, &nb, NULL));
    for (uint32_t q = 0; q < n; q += 1 + n / 97) {
        const float *p = points + (size_t)q * dimension;
        for (uint32_t i = 0; i < n; i++) {
            all[i] = (struct scored){0, i};
            for (uint32_t d = 0; d < dimension; d++)
                all[i].squared += ((double)p[d] - points[(size_t)i * dimension + d]) * ((double)p[d] - points[(size_t)i * dimension + d]);
        }
        qsort(all, n, sizeof *all, by_score);
        ck_ok(groom_neighbours_find(nb, p, 1, k, ids, squared, NULL, NULL));
        for (uint32_t i = 0; i < k; i++) {
            ck_assert_uint_eq(ids[i], i < n ? all[i].id : UINT32_MAX);
            ck_assert(i < n ? squared[i] == (float)all[i].squared : isinf(squared[i]));
        }
    }
    groom_neighbours_destroy(nb);
    free(all);
}

START_TEST(neighbours_are_those_of_brute_force_in_any_dimension)
{
    static float points[3000 * 40];
    for (uint32_t i = 0; i < 3000 * 40; i++)
        points[i] = uniform(i, 70);
    check_against_brute_force(points, 3000, 2, 8);
    check_against_brute_force(points, 3000, 3, 5);
    check_against_brute_force(points, 3000, 40, 3);
    check_against_brute_force(points, 3, 3, 8); /* k above n */
    check_against_brute_force(points, 1, 2, 2);
}
END_TEST

START_TEST(ties_of_neighbours_go_by_index)
{
    static float grid[1600][2], same[500][2], circle[720][2];
    for (uint32_t i = 0; i < 1600; i++) {
        grid[i][0] = (float)(i * 7 % 40);
        grid[i][1] = (float)(i * 7 / 40 % 40);
    }
    check_against_brute_force((float *)grid, 1600, 2, 13);
    for (uint32_t i = 0; i < 500; i++)
        same[i][0] = (float)(i % 3);
    check_against_brute_force((float *)same, 500, 2, 20); /* three places */
    memset(same, 0, sizeof same);
    check_against_brute_force((float *)same, 500, 2, 20); /* one place */
    for (uint32_t i = 1; i < 720; i++) {
        circle[i][0] = (float)cos(i * M_PI / 360);
        circle[i][1] = (float)sin(i * M_PI / 360);
    }
    check_against_brute_force((float *)circle, 720, 2, 30);
}
END_TEST

START_TEST(bad_neighbour_queries_are_refused)
{
    float points[4] = {0, 0, 1, 1}, bad[2] = {NAN, 0};
    struct groom_neighbours *nb = NULL;
    uint32_t id;
    ck_status(groom_neighbours_create(points, 0, 2, NULL, &nb, NULL), GROOM_EEMPTY);
    ck_status(groom_neighbours_create(points, 2, 0, NULL, &nb, NULL), GROOM_EINVAL);
    ck_status(groom_neighbours_create(bad, 1, 2, NULL, &nb, NULL), GROOM_EINVAL);
    ck_assert_ptr_null(nb);
    ck_ok(groom_neighbours_create(points, 2, 2, NULL, &nb, NULL));
    ck_status(groom_neighbours_find(nb, bad, 1, 1, &id, NULL, NULL, NULL), GROOM_EINVAL);
    ck_status(groom_neighbours_find(nb, points, 1, 0, &id, NULL, NULL, NULL), GROOM_EINVAL);
    ck_ok(groom_neighbours_find(nb, points, 0, 1, &id, NULL, NULL, NULL));
    groom_neighbours_destroy(nb);
    groom_neighbours_destroy(NULL);
}
END_TEST

/* --- Delaunay ----------------------------------------------------------------------- */

/* Positive where d lies inside the circle through a b c (counter-clockwise), over its scale. */
static double in_circle(const float *a, const float *b, const float *c, const float *d)
{
    double m[3][3];
    const float *p[3] = {a, b, c};
    for (int i = 0; i < 3; i++) {
        m[i][0] = (double)p[i][0] - d[0];
        m[i][1] = (double)p[i][1] - d[1];
        m[i][2] = m[i][0] * m[i][0] + m[i][1] * m[i][1];
    }
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

static double twice_area(const float *a, const float *b, const float *c)
{
    return ((double)b[0] - a[0]) * ((double)c[1] - a[1]) - ((double)b[1] - a[1]) * ((double)c[0] - a[0]);
}

static struct groom_triangulation *triangulate(const float (*points)[2], uint32_t n)
{
    struct groom_triangulation *t;
    struct groom_diag diag = {0};
    groom_status st = groom_triangulation_create(points, n, NULL, &t, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    for (uint32_t i = 0; i < t->n_triangles; i++) {
        const uint32_t *v = t->triangles[i];
        ck_assert(v[0] < v[1] && v[0] < v[2] && v[1] < n && v[2] < n);
        ck_assert_double_gt(twice_area(points[v[0]], points[v[1]], points[v[2]]), 0);
        for (int k = 0; k < 3; k++)
            ck_assert_uint_eq(t->same_as[v[k]], v[k]);
    }
    return t;
}

START_TEST(no_point_lies_in_the_circle_of_a_triangle)
{
    enum { N = 400 };
    static float points[N][2];
    for (uint32_t i = 0; i < N; i++) {
        points[i][0] = uniform(i, 80);
        points[i][1] = uniform(i, 81);
    }
    struct groom_triangulation *t = triangulate((const float(*)[2])points, N);
    for (uint32_t i = 0; i < t->n_triangles; i++)
        for (uint32_t j = 0; j < N; j++)
            ck_assert_double_le(in_circle(points[t->triangles[i][0]], points[t->triangles[i][1]], points[t->triangles[i][2]], points[j]), 1e-9);
    ck_assert_uint_eq(t->n_points, N);
    /* Euler: V - E + F = 2, with the outside as a face */
    ck_assert_uint_eq(N + t->n_triangles + 1, t->n_edges + 2);
    groom_triangulation_destroy(t);
}
END_TEST

START_TEST(a_grid_is_covered_whole)
{
    enum { S = 20 };
    static float points[S * S][2];
    double area = 0;
    for (uint32_t i = 0; i < S * S; i++) {
        points[i][0] = (float)(i % S) * 0.05f + 100;
        points[i][1] = (float)(i / S) * 0.05f - 50;
    }
    struct groom_triangulation *t = triangulate((const float(*)[2])points, S * S);
    for (uint32_t i = 0; i < t->n_triangles; i++)
        area += twice_area(points[t->triangles[i][0]], points[t->triangles[i][1]], points[t->triangles[i][2]]) / 2;
    ck_assert_double_eq_tol(area, 0.05 * 0.05 * (S - 1) * (S - 1), 1e-4);
    ck_assert_uint_ge(t->n_triangles, 2 * (S - 1) * (S - 1));
    groom_triangulation_destroy(t);
}
END_TEST

START_TEST(duplicates_lines_and_few_points_are_no_trouble)
{
    const float one[1][2] = {{3, 3}}, two[2][2] = {{1, 0}, {0, 0}}, same[3][2] = {{1, 1}, {1, 1}, {1, 1}};
    const float line[4][2] = {{3, 3}, {1, 1}, {2, 2}, {0, 0}}, twice[5][2] = {{0, 0}, {1, 0}, {1, 0}, {0, 1}, {0, 0}};
    struct groom_triangulation *t = triangulate(one, 1);
    ck_assert(t->n_triangles == 0 && t->n_edges == 0 && t->same_as[0] == 0);
    groom_triangulation_destroy(t);
    t = triangulate(two, 2);
    ck_assert(t->n_triangles == 0 && t->n_edges == 1 && t->edges[0][0] == 0 && t->edges[0][1] == 1);
    groom_triangulation_destroy(t);
    t = triangulate(same, 3);
    ck_assert(t->n_triangles == 0 && t->n_edges == 0 && t->same_as[2] == 0);
    groom_triangulation_destroy(t);
    t = triangulate(line, 4);
    static const uint32_t path[3][2] = {{0, 2}, {1, 2}, {1, 3}};
    ck_assert_uint_eq(t->n_triangles, 0);
    ck_assert_uint_eq(t->n_edges, 3);
    ck_assert_mem_eq(t->edges, path, sizeof path);
    groom_triangulation_destroy(t);
    t = triangulate(twice, 5);
    ck_assert_uint_eq(t->n_triangles, 1);
    ck_assert_uint_eq(t->n_edges, 3);
    ck_assert(t->same_as[2] == 1 && t->same_as[4] == 0);
    groom_triangulation_destroy(t);
    ck_status(groom_triangulation_create(one, 0, NULL, &t, NULL), GROOM_EEMPTY);
    ck_status(groom_triangulation_create((const float[1][2]){{NAN, 0}}, 1, NULL, &t, NULL), GROOM_EINVAL);
}
END_TEST

START_TEST(points_of_every_scale_and_almost_on_a_line_are_triangulated)
{
    static float points[64][2];
    for (int scale = -12; scale <= 12; scale += 3)
        for (int bend = 0; bend < 6; bend++) {
            for (uint32_t i = 0; i < 64; i++) {
                points[i][0] = (float)(i * pow(10, scale));
                points[i][1] = (float)(uniform(i, 90) * pow(10, scale - bend));
            }
            groom_triangulation_destroy(triangulate((const float(*)[2])points, 64));
        }
}
END_TEST

/* --- memory --------------------------------------------------------------------------- */

static groom_status everything(const struct groom_mesh *mesh, const struct groom_context *context)
{
    struct groom_bvh *bvh = NULL;
    struct groom_neighbours *nb = NULL;
    struct groom_triangulation *t = NULL;
    static const float flat[5][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0.3f, 0.4f}};
    uint32_t ids[5];
    groom_status st = groom_bvh_create(mesh, context, &bvh, NULL);
    if (st == GROOM_OK)
        st = groom_neighbours_create((const float *)flat, 5, 2, context, &nb, NULL);
    if (st == GROOM_OK)
        st = groom_neighbours_find(nb, (const float *)flat, 5, 1, ids, NULL, context, NULL);
    if (st == GROOM_OK)
        st = groom_triangulation_create(flat, 5, context, &t, NULL);
    groom_triangulation_destroy(t);
    groom_neighbours_destroy(nb);
    groom_bvh_destroy(bvh);
    return st;
}

START_TEST(each_failing_allocation_is_reported_and_leaks_nothing)
{
    struct groom_mesh *mesh = sphere(3, 3);
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        groom_status st = everything(mesh, &(struct groom_context){.allocator = &allocator});
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_assert_int_eq(st, GROOM_ENOMEM);
        ck_assert_uint_lt(fail_at, 200);
    }
    groom_mesh_destroy(mesh);
}
END_TEST

TEST_SUITE("spatial", closest_point_is_the_least_of_all_triangles, ties_go_to_the_lower_triangle,
           rays_hit_the_first_of_all_triangles, signed_distance_of_a_sphere_is_the_radius_less_one,
           inside_stands_open_doubled_and_turned_over_surfaces, winding_agrees_with_the_sum_over_all_triangles,
           bad_queries_and_meshes_are_answered_calmly, indexing_a_mesh_starts_no_thread,
           many_queries_are_the_same_bits_for_1_and_3_threads, neighbours_are_those_of_brute_force_in_any_dimension,
           ties_of_neighbours_go_by_index, bad_neighbour_queries_are_refused, no_point_lies_in_the_circle_of_a_triangle,
           a_grid_is_covered_whole, duplicates_lines_and_few_points_are_no_trouble,
           points_of_every_scale_and_almost_on_a_line_are_triangulated,
           each_failing_allocation_is_reported_and_leaks_nothing)
