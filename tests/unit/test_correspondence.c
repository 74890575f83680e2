/* one mesh over another: by landmarks, by texture coordinates, and what is refused */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/correspondence.h"
#include "groom/spatial.h"
#include "retarget/rotation.h"
#include "tests/support/bodies.h"
#include "tests/support/test.h"

static const float middle[3] = {0, 1.64f, 0};

/* Another person's head: wider, taller, a longer back; smooth, no fold. */
static void reshape(const float p[3], float out[3])
{
    double x = p[0] - middle[0], y = p[1] - middle[1], z = p[2] - middle[2];
    double back = z < 0 ? 1 + 1.5 * z * z / 0.01 * 0.1 : 1;
    out[0] = (float)(1.12 * x * (1 + 0.6 * y) + 0.02);
    out[1] = (float)(1.06 * y + 0.15 * x * x / 0.1 + 1.60);
    out[2] = (float)(1.05 * z * back + 0.08 * y);
}

/* Every triangle in four: a mesh of other triangles on the same surface. uvs: whether it keeps texture coordinates */
static struct groom_mesh *subdivide(const struct groom_mesh *mesh, int uvs)
{
    struct groom_mesh *fine;
    uint32_t n = mesh->n_triangles;
    ck_ok(groom_mesh_create(6 * n, 4 * n, uvs ? 6 * n : 0, NULL, &fine, NULL));
    for (uint32_t t = 0; t < n; t++) {
        static const int ends[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
        static const uint32_t parts[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
        for (uint32_t k = 0; k < 6; k++) {
            for (int c = 0; c < 3; c++)
                fine->points[6 * t + k][c] = 0.5f * (mesh->points[mesh->triangles[t][ends[k][0]]][c] + mesh->points[mesh->triangles[t][ends[k][1]]][c]);
            for (int c = 0; c < 2 && uvs; c++)
                fine->uvs[6 * t + k][c] = 0.5f * (mesh->uvs[mesh->uv_triangles[t][ends[k][0]]][c] + mesh->uvs[mesh->uv_triangles[t][ends[k][1]]][c]);
        }
        for (uint32_t k = 0; k < 4; k++)
            for (int i = 0; i < 3; i++) {
                fine->triangles[4 * t + k][i] = 6 * t + parts[k][i];
                if (uvs)
                    fine->uv_triangles[4 * t + k][i] = 6 * t + parts[k][i];
            }
    }
    return fine;
}

static struct groom_mesh *other_head(const struct groom_mesh *head, int uvs)
{
    struct groom_mesh *other = subdivide(head, uvs);
    for (uint32_t v = 0; v < other->n_vertices; v++)
        reshape(other->points[v], other->points[v]);
    return other;
}

/* The vertex in a direction from the middle. */
static const float *seen_in(const struct groom_mesh *head, double x, double y, double z)
{
    const float *best = NULL;
    double most = -2;
    for (uint32_t v = 0; v < head->n_vertices; v++) {
        const float *p = head->points[v];
        double d[3] = {p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]}, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        double along = (d[0] * x + d[1] * y + d[2] * z) / length / sqrt(x * x + y * y + z * z);
        if (along > most) {
            most = along;
            best = p;
        }
    }
    return best;
}

/* Fourteen places that a person would pick. */
static void pick(const struct groom_mesh *head, struct groom_landmarks *landmarks)
{
    static const double directions[][3] = {{0, -0.16, 1}, {0, -0.82, 0.72}, {0.33, 0.02, 1}, {-0.33, 0.02, 1}, {0, 0.22, 1}, {1, -0.14, -0.08}, {-1, -0.14, -0.08},
                                           {0, 1, 0}, {0, 0.1, -1}, {0, 0.7, 0.7}, {0, 0.7, -0.7}, {0.7, 0.5, 0.3}, {-0.7, 0.5, 0.3}, {0, -0.9, -0.4}};
    memset(landmarks, 0, sizeof *landmarks);
    for (; landmarks->n < sizeof directions / sizeof *directions; landmarks->n++) {
        const double *d = directions[landmarks->n];
        struct groom_landmark *pair = &landmarks->pairs[landmarks->n];
        memcpy(pair->source, seen_in(head, d[0], d[1], d[2]), sizeof pair->source);
        reshape(pair->source, pair->target);
    }
}

/* Mean and largest distance from where each vertex belongs, above the ears. */
static void check_truth(const struct groom_mesh *head, const struct groom_mesh *registered, double most_mean, double most)
{
    double sum = 0, largest = 0;
    uint32_t n = 0;
    for (uint32_t v = 0; v < head->n_vertices; v++) {
        float wanted[3];
        double squared = 0;
        if (head->points[v][1] < 1.60f)
            continue;
        reshape(head->points[v], wanted);
        for (int c = 0; c < 3; c++)
            squared += pow((double)registered->points[v][c] - wanted[c], 2);
        sum += sqrt(squared);
        largest = fmax(largest, sqrt(squared));
        n++;
    }
    if (getenv("CORRESPONDENCE_SHOW"))
        fprintf(stderr, "from the truth: mean %.2f mm, largest %.2f mm\n", 1e3 * sum / n, 1e3 * largest);
    ck_assert_double_lt(sum / n, most_mean);
    ck_assert_double_lt(largest, most);
}

static void show(const char *what, const struct groom_correspondence_report *report)
{
    if (getenv("CORRESPONDENCE_SHOW"))
        fprintf(stderr, "%s: covered %.3f, distance %.3f mm mean, %.2f mm largest, landmarks %.2f and %.2f mm, %u flipped, %u folded, %u iterations\n", what,
               report->covered, 1e3 * report->mean_distance, 1e3 * report->max_distance, 1e3 * report->mean_landmark_error,
               1e3 * report->max_landmark_error, report->n_flipped, report->n_folded, report->iterations);
}

START_TEST(the_best_rotation_is_found_for_flat_and_full_sets)
{
    const double axis[3] = {2.0 / 3, -1.0 / 3, 2.0 / 3}, c = cos(2.1), s = sin(2.1);
    double wanted[3][3], found[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int k = 3 - i - j;
            double skew = i == j ? 0 : ((j - i + 3) % 3 == 1 ? -axis[k] : axis[k]);
            wanted[i][j] = (i == j ? c : 0) + (1 - c) * axis[i] * axis[j] + s * skew;
        }
    for (int n = 2; n <= 3; n++) {
        static const double x[3][3] = {{1, 0.2, 0}, {-0.3, 1.4, 0}, {0.1, 0.2, 0.8}};
        double sum[3][3] = {{0}};
        for (int p = 0; p < n; p++)
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++)
                    for (int k = 0; k < 3; k++)
                        sum[i][j] += wanted[i][k] * x[p][k] * x[p][j];
        rotation_fit((const double (*)[3])sum, found);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                ck_assert_double_eq_tol(found[i][j], wanted[i][j], 1e-12);
    }
}
END_TEST

START_TEST(landmarks_lay_a_head_over_another_of_other_triangles)
{
    struct groom_mesh *head = bodies_sample_head(), *other = other_head(head, 0), *registered;
    struct groom_correspondence_report report;
    struct groom_landmarks landmarks;
    struct groom_diag diag = {0};
    pick(head, &landmarks);
    groom_status st = groom_correspondence_create(head, other, &landmarks, NULL, &registered, &report, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    show("sample", &report);
    ck_assert_mem_eq(registered->triangles, head->triangles, head->n_triangles * sizeof *head->triangles);
    ck_assert_double_gt(report.covered, 0.98);
    ck_assert_double_lt(report.mean_distance, 1e-4);
    ck_assert_double_lt(report.max_landmark_error, 3e-3);
    ck_assert_uint_eq(report.n_flipped, 0);
    check_truth(head, registered, 4e-3, 12e-3);
    groom_mesh_destroy(registered);
    groom_mesh_destroy(other);
    groom_mesh_destroy(head);
}
END_TEST

START_TEST(texture_coordinates_lay_it_exactly)
{
    struct groom_mesh *head = bodies_sample_head(), *other = other_head(head, 1), *registered;
    struct groom_correspondence_report report;
    struct groom_diag diag = {0};
    groom_status st = groom_correspondence_create(head, other, NULL, NULL, &registered, &report, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    show("textured", &report);
    ck_assert(report.by_texture);
    ck_assert_double_lt(report.mean_distance, 1e-4);
    check_truth(head, registered, 5e-4, 3e-3);
    groom_mesh_destroy(registered);
    groom_mesh_destroy(other);
    groom_mesh_destroy(head);
}
END_TEST

START_TEST(the_same_call_gives_the_same_bits_with_more_threads)
{
    struct groom_mesh *head = bodies_sample_head(), *other = other_head(head, 1), *a, *b;
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_correspondence_create(head, other, NULL, NULL, &a, NULL, NULL));
    ck_ok(groom_correspondence_create(head, other, NULL, &context, &b, NULL, NULL));
    ck_assert_mem_eq(a->points, b->points, a->n_vertices * sizeof *a->points);
    groom_mesh_destroy(a);
    groom_mesh_destroy(b);
    groom_pool_destroy(pool);
    groom_mesh_destroy(other);
    groom_mesh_destroy(head);
}
END_TEST

static void check_refused(const struct groom_mesh *source, const struct groom_mesh *target, const struct groom_landmarks *landmarks,
                          groom_status status, const char *pointer, const char *words)
{
    struct groom_mesh *none = NULL;
    struct groom_diag diag = {0};
    ck_status(groom_correspondence_create(source, target, landmarks, NULL, &none, NULL, &diag), status);
    ck_assert_str_eq(diag.pointer, pointer);
    ck_assert_msg(strstr(diag.detail, words) != NULL, "\"%s\" does not say \"%s\"", diag.detail, words);
    ck_assert_ptr_null(none);
}

START_TEST(what_cannot_be_laid_over_is_refused)
{
    struct groom_mesh *head = bodies_sample_head(), *bare = other_head(head, 0), *other = other_head(head, 1);
    struct groom_landmarks landmarks;
    check_refused(head, bare, NULL, GROOM_EINVAL, "/landmarks", "the target has no texture coordinates");
    for (uint32_t i = 0; i < other->n_uvs; i++) { /* another layout */
        float u = other->uvs[i][0];
        other->uvs[i][0] = 0.5f * other->uvs[i][1] + 0.3f;
        other->uvs[i][1] = u;
    }
    check_refused(head, other, NULL, GROOM_EINVAL, "/landmarks", "different layouts");
    pick(head, &landmarks);
    landmarks.n = 3;
    check_refused(head, bare, &landmarks, GROOM_EINVAL, "/landmarks", "4 to 256");
    pick(head, &landmarks);
    landmarks.pairs[2].source[2] += 0.1f;
    check_refused(head, bare, &landmarks, GROOM_EINVAL, "/landmarks/2/source", "off the source");
    pick(head, &landmarks);
    landmarks.pairs[4].target[1] += 1;
    check_refused(head, bare, &landmarks, GROOM_EINVAL, "/landmarks/4/target", "off the target");
    pick(head, &landmarks);
    for (uint32_t i = 0; i < landmarks.n; i++)
        landmarks.pairs[i] = landmarks.pairs[i % 2 ? 0 : i % 4 ? 7 : 8]; /* nose, crown, back of the head */
    check_refused(head, bare, &landmarks, GROOM_EINVAL, "/landmarks", "in a plane");
    groom_mesh_destroy(head);
    groom_mesh_destroy(bare);
    groom_mesh_destroy(other);
}
END_TEST

START_TEST(exchanged_sides_are_refused)
{
    struct groom_mesh *head = bodies_sample_head(), *other = other_head(head, 0), *registered = NULL;
    struct groom_landmarks landmarks;
    struct groom_diag diag = {0};
    pick(head, &landmarks);
    static const int partners[][2] = {{2, 3}, {5, 6}, {11, 12}};
    for (int i = 0; i < 3; i++) {
        float p[3];
        memcpy(p, landmarks.pairs[partners[i][0]].target, sizeof p);
        memcpy(landmarks.pairs[partners[i][0]].target, landmarks.pairs[partners[i][1]].target, sizeof p);
        memcpy(landmarks.pairs[partners[i][1]].target, p, sizeof p);
    }
    ck_status(groom_correspondence_create(head, other, &landmarks, NULL, &registered, NULL, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "left and right"));
    groom_mesh_destroy(head);
    groom_mesh_destroy(other);
}
END_TEST

START_TEST(landmarks_read_as_they_print_and_are_refused_at_their_field)
{
    static const struct {
        const char *json, *pointer;
    } cases[] = {
        {"[]", ""},
        {"{\"landmarks\":[]}", "/landmarks"},
        {"{\"landmark\":[]}", "/landmark"},
        {"{\"landmarks\":[1,2,3,4]}", "/landmarks/0"},
        {"{\"landmarks\":[{\"source\":[0,0,0]},0,0,0]}", "/landmarks/0/target"},
        {"{\"landmarks\":[{\"source\":[0,0],\"target\":[0,0,0]},0,0,0]}", "/landmarks/0/source"},
        {"{\"landmarks\":[{\"name\":3,\"source\":[0,0,0],\"target\":[0,0,0]},0,0,0]}", "/landmarks/0/name"},
    };
    static struct groom_landmarks a, b;
    char *json;
    memset(&a, 0, sizeof a);
    a.n = 5;
    strcpy(a.pairs[1].name, "nose");
    a.pairs[4].target[2] = 0.1f;
    ck_ok(groom_landmarks_print(&a, &json, NULL));
    ck_ok(groom_landmarks_parse(json, strlen(json), &b, NULL));
    ck_assert_mem_eq(&a, &b, sizeof a);
    free(json);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct groom_diag diag = {0};
        ck_status(groom_landmarks_parse(cases[i].json, strlen(cases[i].json), &b, &diag), GROOM_EINVAL);
        ck_assert_str_eq(diag.pointer, cases[i].pointer);
    }
}
END_TEST

/* The first hit of a ray that comes from outside towards a point. */
static void ray_to(const struct groom_mesh *mesh, const double from[3], const double to[3], float out[3])
{
    struct groom_bvh *bvh;
    struct groom_surface_point hit;
    float origin[3], direction[3];
    for (int c = 0; c < 3; c++) {
        origin[c] = (float)from[c];
        direction[c] = (float)(to[c] - from[c]);
    }
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    ck_assert(groom_bvh_ray(bvh, origin, direction, 0, 10, &hit));
    memcpy(out, hit.position, sizeof hit.position);
    groom_bvh_destroy(bvh);
}

/* Places at fractions of a head's own box: top, chin and nose told by hand for both. */
static void pick_real(const struct groom_mesh *mesh, double top, double chin, double nose_z, double back_z, uint32_t i, float out[3])
{
    /* {x, y, z} of where a ray comes from, and of where it goes: x in head heights, y from chin 0 to top 1, z from back 0 to nose 1 */
    static const double rays[][6] = {{0, 0.34, 3, 0, 0.34, 0.5}, {0, 0.03, 3, 0, 0.03, 0.5}, {0, 0.75, 3, 0, 0.75, 0.5}, {0, 3, 0.5, 0, 0.5, 0.5},
                                     {0, 0.65, -3, 0, 0.65, 0.5}, {0, 0.9, -3, 0, 0.9, 0.5}, {3, 0.8, 0.45, 0, 0.8, 0.45}, {-3, 0.8, 0.45, 0, 0.8, 0.45},
                                     {3, 0.25, 0.6, 0, 0.25, 0.6}, {-3, 0.25, 0.6, 0, 0.25, 0.6}, {0, 0.25, -3, 0, 0.25, 0.5}};
    double height = top - chin, from[3], to[3];
    const double *r = rays[i];
    for (int end = 0; end < 2; end++) {
        double *p = end ? to : from;
        p[0] = r[3 * end] * height;
        p[1] = chin + r[3 * end + 1] * height;
        p[2] = back_z + r[3 * end + 2] * (nose_z - back_z);
    }
    ray_to(mesh, from, to, out);
}

START_TEST(sintel_lies_over_the_makehuman_head)
{
    struct groom_mesh *sintel = bodies_shared("sintel/head.obj", 1, GROOM_UP_Y, NULL), *human = bodies_shared("makehuman/base.obj", 0.1, GROOM_UP_Y, "body"), *registered;
    struct groom_correspondence_report report;
    struct groom_landmarks landmarks = {.n = 11};
    struct groom_diag diag = {0};
    if (!sintel || !human)
        return;
    for (uint32_t i = 0; i < landmarks.n; i++) {
        pick_real(sintel, 1.655, 1.425, 0.119, -0.101, i, landmarks.pairs[i].source);
        pick_real(human, 0.849, 0.620, 0.168, -0.039, i, landmarks.pairs[i].target);
    }
    groom_status st = groom_correspondence_create(sintel, human, &landmarks, NULL, &registered, &report, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    show("sintel over makehuman", &report);
    ck_assert_double_gt(report.covered, 0.7);
    ck_assert_double_lt(report.mean_distance, 5e-4);
    groom_mesh_destroy(registered);
    groom_mesh_destroy(sintel);
    groom_mesh_destroy(human);
}
END_TEST

TEST_SUITE("correspondence", the_best_rotation_is_found_for_flat_and_full_sets, landmarks_lay_a_head_over_another_of_other_triangles,
           texture_coordinates_lay_it_exactly, the_same_call_gives_the_same_bits_with_more_threads, what_cannot_be_laid_over_is_refused,
           exchanged_sides_are_refused, landmarks_read_as_they_print_and_are_refused_at_their_field,
           sintel_lies_over_the_makehuman_head)
