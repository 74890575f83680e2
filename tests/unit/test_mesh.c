/* reading, checking and writing meshes */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/mesh.h"
#include "tests/support/test.h"

static groom_status read_text(const char *text, size_t n, const struct groom_mesh_read_options *options,
                              struct groom_mesh **mesh, struct groom_mesh_read_report *report, struct groom_diag *diag)
{
    struct groom_memory_source state;
    struct groom_source source = groom_source_from_memory(&state, text, n);
    return groom_mesh_read(&source, options, NULL, mesh, report, diag);
}

static struct groom_mesh *mesh_of(const char *text)
{
    struct groom_mesh *mesh = NULL;
    struct groom_diag diag = {0};
    groom_status st = read_text(text, strlen(text), NULL, &mesh, NULL, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    ck_ok(groom_mesh_validate(mesh, NULL));
    return mesh;
}

/* signed area in the x-y plane */
static double area(const struct groom_mesh *mesh)
{
    double sum = 0;
    for (uint32_t i = 0; i < mesh->n_triangles; i++) {
        const float *a = mesh->points[mesh->triangles[i][0]], *b = mesh->points[mesh->triangles[i][1]], *c = mesh->points[mesh->triangles[i][2]];
        double t = ((double)b[0] - a[0]) * ((double)c[1] - a[1]) - ((double)b[1] - a[1]) * ((double)c[0] - a[0]);
        ck_assert_msg(t >= 0, "a triangle is turned over");
        sum += t / 2;
    }
    return sum;
}

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

START_TEST(obj_reads_points_faces_and_texture_coordinates)
{
    struct groom_mesh *mesh = mesh_of("# a square\n" SQUARE "vt 0 0\nvt 1 0\nvt 1 .5\nvt 0 .5\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n");
    ck_assert_uint_eq(mesh->n_vertices, 4);
    ck_assert_uint_eq(mesh->n_triangles, 2);
    ck_assert_uint_eq(mesh->n_uvs, 4);
    ck_assert_double_eq(area(mesh), 1.0);
    for (int t = 0; t < 2; t++)
        for (int i = 0; i < 3; i++) {
            ck_assert_float_eq(mesh->uvs[mesh->uv_triangles[t][i]][0], mesh->points[mesh->triangles[t][i]][0]);
            ck_assert_float_eq(mesh->uvs[mesh->uv_triangles[t][i]][1], mesh->points[mesh->triangles[t][i]][1] / 2);
        }
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(obj_reads_negative_indices_joined_lines_and_carriage_returns)
{
    struct groom_mesh *mesh = mesh_of("v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf -3 \\\r\n -2 \\\r\n -1\r\n");
    ck_assert_double_eq(area(mesh), 0.5);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(concave_polygons_keep_their_area)
{
    struct groom_mesh *mesh = mesh_of("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n");
    ck_assert_uint_eq(mesh->n_triangles, 3);
    ck_assert_double_eq(area(mesh), 10.0);
    groom_mesh_destroy(mesh);
    mesh = mesh_of("v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 1 2 3 4\n"); /* a dart: only one diagonal will do */
    ck_assert_double_eq(area(mesh), 4.0);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(a_star_of_a_thousand_corners_keeps_its_area)
{
    static char text[100000];
    size_t n = 0;
    double expected = 0;
    for (int i = 0; i < 1000; i++) {
        double r = i % 2 ? 1.0 : 3.0, a = 2 * M_PI * i / 1000, b = 2 * M_PI * (i + 1) / 1000;
        n += (size_t)snprintf(text + n, sizeof text - n, "v %.9g %.9g 0\n", r * cos(a), r * sin(a));
        expected += 0.5 * 3.0 * sin(b - a);
    }
    n += (size_t)snprintf(text + n, sizeof text - n, "f");
    for (int i = 0; i < 1000; i++)
        n += (size_t)snprintf(text + n, sizeof text - n, " %d", i + 1);
    struct groom_mesh *mesh = mesh_of(text);
    ck_assert_uint_eq(mesh->n_triangles, 998);
    ck_assert_double_eq_tol(area(mesh), expected, 1e-4);
    groom_mesh_destroy(mesh);
}
END_TEST

/* The shorter diagonal of the first is the longer one of the second, and a triangle of it has no area. */
START_TEST(the_same_faces_can_be_cut_alike_wherever_their_corners_are)
{
    static const char *const files[] = {"v 0 0 0\nv 3 0 0\nv 4 1 0\nv 1 1 0\nv 5 0 0\nf 1 2 3 4\nf 2 5 3\n",
                                        "v 1 0 0\nv 4 0 0\nv 3 1 0\nv 0 1 0\nv 5 -1 0\nf 1 2 3 4\nf 2 5 3\n"};
    const struct groom_mesh_read_options alike = {.by_faces_alone = 1};
    struct groom_mesh *mesh[2], *other[2];
    for (int i = 0; i < 2; i++) {
        other[i] = mesh_of(files[i]);
        ck_ok(read_text(files[i], strlen(files[i]), &alike, &mesh[i], NULL, NULL));
        ck_assert_uint_eq(mesh[i]->n_triangles, 3);
    }
    ck_assert_int_ne(memcmp(other[0]->triangles, other[1]->triangles, 2 * sizeof *other[0]->triangles), 0);
    ck_assert_uint_eq(other[1]->n_triangles, 2);
    ck_assert_mem_eq(mesh[0]->triangles, mesh[1]->triangles, 3 * sizeof *mesh[0]->triangles);
    for (int i = 0; i < 2; i++) {
        groom_mesh_destroy(mesh[i]);
        groom_mesh_destroy(other[i]);
    }
}
END_TEST

START_TEST(unusable_faces_are_dropped_and_counted)
{
    const char *text = SQUARE "v nan 0 0\nv 2 0 0\nv 7 7 7\nf 1 2 3\nf 1 2 5\nf 1 2 6\nf 1 1 2\n";
    struct groom_mesh *mesh = NULL;
    struct groom_mesh_read_report report;
    ck_ok(read_text(text, strlen(text), NULL, &mesh, &report, NULL));
    ck_assert_uint_eq(mesh->n_triangles, 1);
    ck_assert_uint_eq(mesh->n_vertices, 3);
    ck_assert_uint_eq(report.n_faces_in_file, 4);
    ck_assert_uint_eq(report.n_vertices_in_file, 7);
    ck_assert_uint_eq(report.n_dropped_not_finite, 1);
    ck_assert_uint_eq(report.n_dropped_degenerate, 2);
    ck_assert_uint_eq(report.n_warnings, 2);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(texture_coordinates_that_some_faces_lack_are_dropped_with_a_warning)
{
    const char *text = SQUARE "vt 0 0\nf 1/1 2/1 3/1\nf 1 3 4\n";
    struct groom_mesh *mesh = NULL;
    struct groom_mesh_read_report report;
    ck_ok(read_text(text, strlen(text), NULL, &mesh, &report, NULL));
    ck_assert_uint_eq(mesh->n_uvs, 0);
    ck_assert_ptr_null(mesh->uvs);
    ck_assert_uint_eq(report.n_warnings, 1);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(units_and_axes_become_metres_y_up)
{
    const char *text = "v 0 0 170\nv 100 0 170\nv 0 -10 170\nf 1 2 3\n";
    struct groom_mesh_read_options options = {.frame = {0.01, GROOM_UP_Z}};
    struct groom_mesh *mesh = NULL;
    ck_ok(read_text(text, strlen(text), &options, &mesh, NULL, NULL));
    ck_assert_float_eq(mesh->points[2][0], 0.0f);
    ck_assert_float_eq_tol(mesh->points[2][1], 1.7f, 1e-7f);
    ck_assert_float_eq_tol(mesh->points[2][2], 0.1f, 1e-7f);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(a_group_is_kept_alone)
{
    const char *text = SQUARE "g body\nf 1 2 3\ng helper joint\nf 1 3 4\nf 2 3 4\n";
    struct groom_mesh_read_options options = {.group = "joint"};
    struct groom_mesh *mesh = NULL;
    struct groom_diag diag;
    ck_ok(read_text(text, strlen(text), &options, &mesh, NULL, NULL));
    ck_assert_uint_eq(mesh->n_triangles, 2);
    groom_mesh_destroy(mesh);
    options.group = "hat";
    ck_status(read_text(text, strlen(text), &options, &mesh, NULL, &diag), GROOM_EEMPTY);
    ck_assert_ptr_nonnull(strstr(diag.detail, "hat"));
}
END_TEST

static const char ply_ascii[] =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nproperty float s\nproperty float t\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n"
    "0 0 0 9 0 0\n1 0 0 9 1 0\n1 1 0 9 1 1\n0 1 0 9 0 1\n4 0 1 2 3\n";

static const char ply_little[] =
    "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200\077\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200\077\0\0\0\0"
    "\003\0\0\0\0\001\0\0\0\002\0\0\0";

static const char ply_big[] =
    "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "\0\0\0\0\0\0\0\0\0\0\0\0\077\200\0\0\0\0\0\0\0\0\0\0\0\0\0\0\077\200\0\0\0\0\0\0"
    "\003\0\0\0\0\0\0\0\001\0\0\0\002";

START_TEST(ply_reads_ascii_and_both_byte_orders)
{
    struct groom_mesh *mesh = mesh_of(ply_ascii);
    ck_assert_uint_eq(mesh->n_uvs, 4);
    ck_assert_double_eq(area(mesh), 1.0);
    groom_mesh_destroy(mesh);
    ck_ok(read_text(ply_little, sizeof ply_little - 1, NULL, &mesh, NULL, NULL));
    ck_assert_double_eq(area(mesh), 0.5);
    groom_mesh_destroy(mesh);
    ck_ok(read_text(ply_big, sizeof ply_big - 1, NULL, &mesh, NULL, NULL));
    ck_assert_double_eq(area(mesh), 0.5);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(ply_reads_texture_coordinates_of_corners)
{
    struct groom_mesh *mesh = mesh_of("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
        "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0.25 0 1 0 0 1\n");
    ck_assert_uint_eq(mesh->n_uvs, 3);
    ck_assert_float_eq(mesh->uvs[mesh->uv_triangles[0][0]][0], 0.25f);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(every_truncation_is_refused_or_leaves_a_valid_mesh)
{
    static const char obj[] = SQUARE "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    const struct { const char *bytes; size_t n; } files[] = {
        {obj, sizeof obj - 1}, {ply_ascii, sizeof ply_ascii - 1}, {ply_little, sizeof ply_little - 1}, {ply_big, sizeof ply_big - 1}};
    for (size_t f = 0; f < 4; f++)
        for (size_t n = 0; n < files[f].n; n++) {
            struct groom_mesh *mesh = NULL;
            struct groom_diag diag = {0};
            if (read_text(files[f].bytes, n, NULL, &mesh, NULL, &diag) == GROOM_OK)
                ck_ok(groom_mesh_validate(mesh, NULL));
            else
                ck_assert_msg(diag.detail[0] != '\0', "file %zu cut at %zu has no detail", f, n);
            ck_assert_msg(f < 2 || !mesh, "a binary file cut at %zu was read", n);
            groom_mesh_destroy(mesh);
        }
}
END_TEST

START_TEST(bad_files_are_refused_by_name_and_offset)
{
    static const struct { const char *text; groom_status status; int has_offset; } cases[] = {
        {"", GROOM_ETRUNCATED, 1},
        {"hello\n", GROOM_EUNKNOWN, 1},
        {"v 0 0\n", GROOM_EFORMAT, 1},
        {"v a b c\n", GROOM_EFORMAT, 1},
        {SQUARE "f 1 2 9\n", GROOM_EFORMAT, 1},
        {SQUARE "f 0 1 2\n", GROOM_EFORMAT, 1},
        {SQUARE "f -9 1 2\n", GROOM_EFORMAT, 1},
        {SQUARE "f 1 2 99999999999999999999999\n", GROOM_EFORMAT, 1},
        {SQUARE "f 1/5 2/5 3/5\n", GROOM_EFORMAT, 1},
        {SQUARE, GROOM_EEMPTY, 0},
        {SQUARE "f 1 1 1\n", GROOM_EEMPTY, 0},
        {"ply\nformat klingon 1.0\nend_header\n", GROOM_EFORMAT, 1},
        {"ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n", GROOM_ETRUNCATED, 1},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n2000000000 0 0\n", GROOM_EFORMAT, 1},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", GROOM_EFORMAT, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct groom_mesh *mesh = NULL;
        struct groom_diag diag = {0};
        groom_status st = read_text(cases[i].text, strlen(cases[i].text), NULL, &mesh, NULL, &diag);
        ck_assert_msg(st == cases[i].status, "case %zu: %s (%s)", i, groom_status_name(st), diag.detail);
        ck_assert_msg((diag.byte_offset >= 0) == cases[i].has_offset, "case %zu: offset %ld", i, (long)diag.byte_offset);
        ck_assert_ptr_null(mesh);
    }
}
END_TEST

START_TEST(a_file_beyond_the_limit_is_refused)
{
    struct groom_mesh *mesh = NULL;
    struct groom_mesh_read_options options = {.max_bytes = 10};
    ck_status(read_text(SQUARE, sizeof SQUARE - 1, &options, &mesh, NULL, NULL), GROOM_ETOOBIG);
}
END_TEST

START_TEST(each_failing_allocation_is_reported_and_leaks_nothing)
{
    static const char text[] = SQUARE "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    const struct { const char *bytes; size_t n; } files[] = {{text, sizeof text - 1}, {ply_little, sizeof ply_little - 1}};
    for (int f = 0; f < 2; f++) {
        for (size_t fail_at = 0;; fail_at++) {
            struct test_failing_allocator state;
            struct groom_allocator allocator;
            test_failing_allocator_init(&state, fail_at, &allocator);
            struct groom_context context = {.allocator = &allocator};
            struct groom_memory_source memory;
            struct groom_source source = groom_source_from_memory(&memory, files[f].bytes, files[f].n);
            struct groom_mesh *mesh = NULL;
            groom_status st = groom_mesh_read(&source, NULL, &context, &mesh, NULL, NULL);
            groom_mesh_destroy(mesh);
            ck_assert_uint_eq(state.outstanding_bytes, 0);
            if (st == GROOM_OK)
                break;
            ck_assert_int_eq(st, GROOM_ENOMEM);
            ck_assert_uint_lt(fail_at, 200);
        }
    }
}
END_TEST

struct gathered { char bytes[4096]; size_t n; };
static groom_status gather(void *user, const void *bytes, size_t n)
{
    struct gathered *g = user;
    if (g->n + n > sizeof g->bytes)
        return GROOM_ENOSPC;
    memcpy(g->bytes + g->n, bytes, n);
    g->n += n;
    return GROOM_OK;
}

START_TEST(a_written_mesh_reads_back_the_same)
{
    struct groom_frame frame = {0.01, GROOM_UP_Z};
    struct groom_mesh *mesh = mesh_of("v 0 0.1 0\nv 1 0 0.3\nv 1 1 0\nvt 0 0.1\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n"), *again = NULL;
    struct gathered g = {.n = 0};
    ck_ok(groom_mesh_write_obj(mesh, frame, (struct groom_sink){gather, &g}, NULL));
    ck_ok(read_text(g.bytes, g.n, &(struct groom_mesh_read_options){.frame = frame}, &again, NULL, NULL));
    for (int i = 0; i < 9; i++)
        ck_assert_float_eq_tol(((float *)mesh->points)[i], ((float *)again->points)[i], 1e-6f);
    ck_assert_mem_eq(mesh->uvs, again->uvs, sizeof(float) * 6);
    ck_assert_mem_eq(mesh->triangles, again->triangles, sizeof(uint32_t) * 3);
    g.n = sizeof g.bytes;
    ck_status(groom_mesh_write_obj(mesh, frame, (struct groom_sink){gather, &g}, NULL), GROOM_ENOSPC);
    groom_mesh_destroy(mesh);
    groom_mesh_destroy(again);
}
END_TEST

START_TEST(real_heads_are_read)
{
    static const struct { const char *file; double unit; groom_up up; const char *group; uint32_t triangles, uvs; float low, high; } heads[] = {
        {"harolongo/body.obj", 0.01, GROOM_UP_Y, NULL, 55588, 29450, -1.6f, 0.2f},
        {"sintel/head.obj", 1, GROOM_UP_Y, NULL, 5952, 3140, 1.2f, 1.7f},
        {"combover/body.obj", 1, GROOM_UP_Z, NULL, 74398, 0, 0, 1.8f},
        {"makehuman/base.obj", 0.1, GROOM_UP_Y, "body", 26756, 14517, -1, 1},
    };
    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        const char *path = test_shared_data(heads[i].file);
        if (!path)
            continue;
        int fd = open(path, O_RDONLY);
        struct groom_source source = groom_source_from_fd(fd);
        struct groom_mesh_read_options options = {.frame = {heads[i].unit, heads[i].up}, .group = heads[i].group};
        struct groom_mesh *mesh = NULL;
        ck_ok(groom_mesh_read(&source, &options, NULL, &mesh, NULL, NULL));
        close(fd);
        float low[3], high[3];
        groom_mesh_bounds(mesh, low, high);
        ck_assert_uint_eq(mesh->n_triangles, heads[i].triangles);
        ck_assert_uint_eq(mesh->n_uvs, heads[i].uvs);
        ck_assert(low[1] > heads[i].low && high[1] < heads[i].high);
        groom_mesh_destroy(mesh);
    }
}
END_TEST

TEST_SUITE("mesh", obj_reads_points_faces_and_texture_coordinates,
           obj_reads_negative_indices_joined_lines_and_carriage_returns, concave_polygons_keep_their_area,
           a_star_of_a_thousand_corners_keeps_its_area,
           the_same_faces_can_be_cut_alike_wherever_their_corners_are, unusable_faces_are_dropped_and_counted,
           texture_coordinates_that_some_faces_lack_are_dropped_with_a_warning, units_and_axes_become_metres_y_up,
           a_group_is_kept_alone, ply_reads_ascii_and_both_byte_orders, ply_reads_texture_coordinates_of_corners,
           every_truncation_is_refused_or_leaves_a_valid_mesh, bad_files_are_refused_by_name_and_offset,
           a_file_beyond_the_limit_is_refused, each_failing_allocation_is_reported_and_leaks_nothing,
           a_written_mesh_reads_back_the_same, real_heads_are_read)
