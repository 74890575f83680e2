/* skeletons: JSON, names, made from a mesh, carried to another, regions; and what makes a mesh a body */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/body.h"
#include "groom/skeleton.h"
#include "groom/spatial.h"
#include "tests/support/bodies.h"
#include "tests/support/test.h"

#define TWO "{\"bones\":[{\"name\":\"head\",\"head\":[0,1.5,0],\"tail\":[0,1.7,0]}," \
            "{\"name\":\"neck\",\"head\":[0,1.4,0],\"tail\":[0,1.5,0]}]}"

static const struct groom_bone *bone_of(const struct groom_skeleton *skeleton, const char *name)
{
    for (uint32_t b = 0; b < skeleton->n_bones; b++)
        if (strcmp(skeleton->bones[b].name, name) == 0)
            return &skeleton->bones[b];
    return NULL;
}

/* --- JSON ------------------------------------------------------------------------------ */

START_TEST(what_is_printed_reads_back_to_the_same_bits)
{
    struct groom_skeleton skeleton = {0}, again = {0};
    char *json;
    ck_ok(groom_skeleton_parse(TWO, strlen(TWO), &skeleton, NULL));
    skeleton.bones[1].tail[2] = 0.1f;
    ck_ok(groom_skeleton_print(&skeleton, &json, NULL));
    ck_ok(groom_skeleton_parse(json, strlen(json), &again, NULL));
    ck_assert_mem_eq(&skeleton, &again, sizeof skeleton);
    free(json);
}
END_TEST

START_TEST(unsound_skeletons_are_refused_at_their_field)
{
    static const struct {
        const char *json, *pointer;
    } cases[] = {
        {"[]", ""},
        {"{\"bones\":[", ""},
        {"{\"bones\":[]}", "/bones"},
        {"{\"bones\":{}}", "/bones"},
        {"{\"bones\":[],\"joints\":[]}", "/joints"},
        {"{\"bones\":[7]}", "/bones/0"},
        {"{\"bones\":[{\"name\":\"a\",\"head\":[0,0,0],\"tail\":[0,1,0],\"roll\":0}]}", "/bones/0/roll"},
        {"{\"bones\":[{\"head\":[0,0,0],\"tail\":[0,1,0]}]}", "/bones/0/name"},
        {"{\"bones\":[{\"name\":\"\",\"head\":[0,0,0],\"tail\":[0,1,0]}]}", "/bones/0/name"},
        {"{\"bones\":[{\"name\":\"a name that is longer than thirty-one bytes\",\"head\":[0,0,0],\"tail\":[0,1,0]}]}", "/bones/0/name"},
        {"{\"bones\":[{\"name\":\"a\",\"head\":[0,0],\"tail\":[0,1,0]}]}", "/bones/0/head"},
        {"{\"bones\":[{\"name\":\"a\",\"head\":[0,0,0],\"tail\":[0,1,1e9]}]}", "/bones/0/tail"},
        {"{\"bones\":[{\"name\":\"a\",\"head\":[0,1,0],\"tail\":[0,1,0]}]}", "/bones/0"},
        {"{\"bones\":[{\"name\":\"a\",\"head\":[0,0,0],\"tail\":[0,1,0]},{\"name\":\"a\",\"head\":[0,0,0],\"tail\":[0,2,0]}]}", "/bones/1"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct groom_skeleton skeleton = {.n_bones = 77};
        struct groom_diag diag = {0};
        ck_status(groom_skeleton_parse(cases[i].json, strlen(cases[i].json), &skeleton, &diag), GROOM_EINVAL);
        ck_assert_str_eq(diag.pointer, cases[i].pointer);
        ck_assert_uint_ne(diag.detail[0], 0);
        ck_assert_uint_eq(skeleton.n_bones, 77);
    }
}
END_TEST

START_TEST(bones_are_matched_by_name_and_a_missing_one_is_named)
{
    struct groom_skeleton a, b, lacking;
    struct groom_diag diag = {0};
    ck_ok(groom_skeleton_parse(TWO, strlen(TWO), &a, NULL));
    b = a;
    b.bones[0] = a.bones[1];
    b.bones[1] = a.bones[0];
    ck_ok(groom_skeleton_match(&a, &b, NULL));
    ck_assert_str_eq(b.bones[0].name, "head");
    ck_assert_str_eq(b.bones[1].name, "neck");
    lacking = a;
    lacking.n_bones = 1;
    ck_status(groom_skeleton_match(&a, &lacking, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "target's skeleton has no bone \"neck\""));
    ck_status(groom_skeleton_match(&lacking, &a, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "source's skeleton has no bone \"neck\""));
}
END_TEST

/* --- made ------------------------------------------------------------------------------- */

static void check_inside(const struct groom_skeleton *skeleton, const struct groom_mesh *mesh)
{
    struct groom_bvh *bvh;
    ck_ok(groom_bvh_create(mesh, NULL, &bvh, NULL));
    for (uint32_t b = 0; b < skeleton->n_bones; b++)
        for (int k = 0; k <= 8; k++) {
            float p[3];
            for (int c = 0; c < 3; c++)
                p[c] = skeleton->bones[b].head[c] + (float)k / 8 * (skeleton->bones[b].tail[c] - skeleton->bones[b].head[c]);
            ck_assert_msg(groom_bvh_inside(bvh, p), "bone %s leaves the body at %g %g %g", skeleton->bones[b].name, (double)p[0],
                          (double)p[1], (double)p[2]);
        }
    groom_bvh_destroy(bvh);
}

START_TEST(a_bare_head_gives_head_and_neck)
{
    struct groom_mesh *head = bodies_sample_head();
    struct groom_skeleton skeleton;
    ck_ok(groom_skeleton_make(head, NULL, &skeleton, NULL));
    ck_assert_uint_eq(skeleton.n_bones, 2);
    const struct groom_bone *bone = bone_of(&skeleton, "head"), *neck = bone_of(&skeleton, "neck");
    ck_assert(bone && neck);
    ck_assert_float_gt(bone->tail[1], bone->head[1] + 0.08f);
    ck_assert_float_eq(bone->head[1], neck->tail[1]);
    check_inside(&skeleton, head);
    groom_mesh_destroy(head);
}
END_TEST

START_TEST(a_ball_is_a_head_alone)
{
    struct groom_mesh *ball = bodies_sample_head();
    struct groom_skeleton skeleton;
    for (uint32_t v = 0; v < ball->n_vertices; v++) {
        double d[3], r = 0;
        for (int c = 0; c < 3; c++) {
            d[c] = ball->points[v][c] - (c == 1 ? 1.64 : 0);
            r += d[c] * d[c];
        }
        for (int c = 0; c < 3; c++)
            ball->points[v][c] = (float)(0.1 * d[c] / sqrt(r));
    }
    ck_ok(groom_skeleton_make(ball, NULL, &skeleton, NULL));
    ck_assert_uint_eq(skeleton.n_bones, 1);
    ck_assert_str_eq(skeleton.bones[0].name, "head");
    check_inside(&skeleton, ball);
    groom_mesh_destroy(ball);
}
END_TEST

START_TEST(real_bodies_give_shoulders_and_arms_inside_of_them)
{
    static const struct {
        const char *path;
        double unit;
        groom_up up;
        const char *group;
        uint32_t n_bones;
    } bodies[] = {
        {"harolongo/body.obj", 0.01, GROOM_UP_Y, NULL, 6},
        {"combover/body.obj", 1, GROOM_UP_Z, NULL, 6},
        {"makehuman/base.obj", 0.1, GROOM_UP_Y, "body", 6},
        {"sintel/head.obj", 1, GROOM_UP_Y, NULL, 4},
        {"../vectors/retarget-straight/source.obj", 1, GROOM_UP_Z, NULL, 6},
    };
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        struct groom_mesh *mesh = bodies_shared(bodies[i].path, bodies[i].unit, bodies[i].up, bodies[i].group);
        struct groom_skeleton skeleton;
        if (!mesh)
            continue;
        ck_ok(groom_skeleton_make(mesh, NULL, &skeleton, NULL));
        for (uint32_t b = 0; b < skeleton.n_bones && getenv("SKELETON_SHOW"); b++)
            printf("%s %-16s %6.3f %6.3f %6.3f  %6.3f %6.3f %6.3f\n", bodies[i].path, skeleton.bones[b].name,
                   (double)skeleton.bones[b].head[0], (double)skeleton.bones[b].head[1], (double)skeleton.bones[b].head[2],
                   (double)skeleton.bones[b].tail[0], (double)skeleton.bones[b].tail[1], (double)skeleton.bones[b].tail[2]);
        ck_assert_msg(skeleton.n_bones == bodies[i].n_bones, "%s has %u bones", bodies[i].path, skeleton.n_bones);
        check_inside(&skeleton, mesh);
        groom_mesh_destroy(mesh);
    }
}
END_TEST

/* --- carried ------------------------------------------------------------------------------ */

START_TEST(an_affine_image_carries_its_skeleton_exactly)
{
    static const double map[3][4] = {{1.2, 0.1, 0, 0.3}, {0, 0.9, 0.05, -0.2}, {-0.02, 0, 1.1, 0.1}};
    struct groom_mesh *head = bodies_sample_head(), *image = bodies_copy(head);
    struct groom_skeleton skeleton, carried;
    for (uint32_t v = 0; v < head->n_vertices; v++)
        for (int i = 0; i < 3; i++)
            image->points[v][i] = (float)(map[i][0] * head->points[v][0] + map[i][1] * head->points[v][1] +
                                          map[i][2] * head->points[v][2] + map[i][3]);
    ck_ok(groom_skeleton_make(head, NULL, &skeleton, NULL));
    ck_ok(groom_skeleton_carry(&skeleton, head, image, &carried, NULL));
    for (uint32_t b = 0; b < skeleton.n_bones; b++)
        for (int i = 0; i < 3; i++) {
            const float *p = skeleton.bones[b].head;
            double wanted = map[i][0] * p[0] + map[i][1] * p[1] + map[i][2] * p[2] + map[i][3];
            ck_assert_double_eq_tol(carried.bones[b].head[i], wanted, 2e-6);
        }
    image->n_triangles--;
    struct groom_diag diag = {0};
    ck_status(groom_skeleton_carry(&skeleton, head, image, &carried, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "triangles"));
    image->n_triangles++;
    groom_mesh_destroy(image);
    groom_mesh_destroy(head);
}
END_TEST

/* --- the worked case ------------------------------------------------------------------------- */

/* Bones of vectors/retarget-straight as they stand in skeleton.json, z up. */
static const struct groom_skeleton worked_source = {6, {
    {"head", {0, -0.012f, 1.51f}, {0, 0, 1.67175f}}, {"neck", {0, -0.016f, 1.405f}, {0, -0.012f, 1.51f}},
    {"clavL", {0.02f, -0.012f, 1.37f}, {0.1599f, -0.012f, 1.33f}}, {"clavR", {-0.02f, -0.012f, 1.37f}, {-0.1599f, -0.012f, 1.33f}},
    {"armL", {0.1599f, -0.012f, 1.33f}, {0.164f, -0.012f, 1.145f}}, {"armR", {-0.1599f, -0.012f, 1.33f}, {-0.164f, -0.012f, 1.145f}}}};
static const struct groom_skeleton worked_target = {6, {
    {"head", {0, -0.016f, 1.622f}, {0, 0, 1.794f}}, {"neck", {0, -0.02f, 1.512f}, {0, -0.016f, 1.622f}},
    {"clavL", {0.02f, -0.016f, 1.4825f}, {0.1911f, -0.016f, 1.4465f}}, {"clavR", {-0.02f, -0.016f, 1.4825f}, {-0.1911f, -0.016f, 1.4465f}},
    {"armL", {0.1911f, -0.016f, 1.4465f}, {0.196f, -0.016f, 1.28f}}, {"armR", {-0.1911f, -0.016f, 1.4465f}, {-0.196f, -0.016f, 1.28f}}}};

START_TEST(regions_of_the_worked_case_are_those_of_its_file)
{
    struct groom_mesh *mesh = bodies_shared("../vectors/retarget-straight/source.obj", 1, GROOM_UP_Y, NULL);
    const char *path = test_shared_data("../vectors/retarget-straight/valid_tris.txt");
    if (!mesh || !path)
        return;
    FILE *file = fopen(path, "r");
    uint32_t *mask = malloc(mesh->n_triangles * sizeof *mask), *wanted = calloc(mesh->n_triangles, sizeof *wanted), n_bones = 0;
    char line[65536];
    while (fgets(line, sizeof line, file)) {
        for (char *at = line, *end; strtoul(at, &end, 10), end != at; at = end)
            wanted[strtoul(at, NULL, 10)] |= 1u << n_bones;
        n_bones++;
    }
    ck_assert_uint_eq(n_bones, 6);
    groom_skeleton_regions(&worked_source, mesh, mask);
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        ck_assert_msg(mask[t] == wanted[t], "triangle %u serves %#x, not %#x", t, mask[t], wanted[t]);
    fclose(file);
    free(wanted);
    free(mask);
    groom_mesh_destroy(mesh);
}
END_TEST

START_TEST(the_worked_case_carries_its_skeleton_to_within_two_centimetres)
{
    struct groom_mesh *source = bodies_shared("../vectors/retarget-straight/source.obj", 1, GROOM_UP_Y, NULL);
    struct groom_mesh *target = bodies_shared("../vectors/retarget-straight/target.obj", 1, GROOM_UP_Y, NULL);
    struct groom_skeleton carried;
    if (!source || !target)
        return;
    ck_ok(groom_skeleton_carry(&worked_source, source, target, &carried, NULL));
    for (uint32_t b = 0; b < carried.n_bones; b++) {
        double squared = 0;
        for (int c = 0; c < 3; c++)
            squared += pow((double)carried.bones[b].head[c] - worked_target.bones[b].head[c], 2);
        if (getenv("SKELETON_SHOW"))
            printf("%s is carried to %.4f m from the file's\n", carried.bones[b].name, sqrt(squared));
        ck_assert_double_lt(sqrt(squared), 0.02);
    }
    groom_mesh_destroy(source);
    groom_mesh_destroy(target);
}
END_TEST

/* --- bodies -------------------------------------------------------------------------------------- */

START_TEST(flipped_triangles_are_turned_right_side_out_and_told)
{
    struct groom_mesh *head = bodies_sample_head(), *copy = bodies_copy(head);
    struct groom_body_report report;
    for (uint32_t t = 0; t < copy->n_triangles; t++)
        if (t % 3 != 1) {
            uint32_t second = copy->triangles[t][1];
            copy->triangles[t][1] = copy->triangles[t][2];
            copy->triangles[t][2] = second;
        }
    ck_ok(groom_body_check(copy, NULL, &report, NULL));
    ck_assert_uint_eq(report.n_turned, copy->n_triangles - (copy->n_triangles + 1) / 3);
    ck_assert_ptr_nonnull(strstr(report.warnings[0], "turned right side out"));
    ck_assert_double_gt(report.volume, 0.002);
    ck_assert_uint_eq(report.n_boundary_edges, 0);
    for (uint32_t t = 0; t < copy->n_triangles; t++) {
        int same = 0;
        for (int shift = 0; shift < 3; shift++)
            same |= copy->triangles[t][0] == head->triangles[t][shift] && copy->triangles[t][1] == head->triangles[t][(shift + 1) % 3];
        ck_assert(same);
    }
    ck_ok(groom_body_check(copy, NULL, &report, NULL));
    ck_assert_uint_eq(report.n_turned, 0);
    ck_assert_uint_eq(report.n_warnings, 0);
    ck_assert(groom_topology_same(head, copy, NULL));
    groom_mesh_destroy(copy);
    groom_mesh_destroy(head);
}
END_TEST

/* Leave out the triangles whose middles lie below y. */
static void cut_below(struct groom_mesh *mesh, float y)
{
    uint32_t n = 0;
    for (uint32_t t = 0; t < mesh->n_triangles; t++) {
        const uint32_t *v = mesh->triangles[t];
        if (mesh->points[v[0]][1] + mesh->points[v[1]][1] + mesh->points[v[2]][1] >= 3 * y)
            memmove(mesh->triangles[n++], v, sizeof *mesh->triangles);
    }
    mesh->n_triangles = n;
}

START_TEST(a_cut_at_the_neck_is_let_pass_and_a_sheet_refused)
{
    struct groom_mesh *head = bodies_sample_head(), *copy = bodies_copy(head);
    struct groom_body_report report;
    struct groom_diag diag = {0};
    uint32_t n = copy->n_triangles;
    cut_below(copy, 1.46f);
    ck_ok(groom_body_check(copy, NULL, &report, NULL));
    ck_assert_uint_eq(report.n_holes, 1);
    ck_assert_double_gt(report.open, 0.02);
    ck_assert_ptr_nonnull(strstr(report.warnings[0], "open"));
    cut_below(copy, 1.70f);
    ck_status(groom_body_check(copy, NULL, &report, &diag), GROOM_EDEGENERATE);
    ck_assert_ptr_nonnull(strstr(diag.detail, "open sheet"));
    copy->n_triangles = n;
    groom_mesh_destroy(copy);
    groom_mesh_destroy(head);
}
END_TEST

START_TEST(doubled_faces_are_refused_and_shells_told)
{
    struct groom_mesh *head = bodies_sample_head(), *twice;
    struct groom_body_report report;
    struct groom_diag diag = {0};
    ck_ok(groom_mesh_create(2 * head->n_vertices, 2 * head->n_triangles, 0, NULL, &twice, NULL));
    for (uint32_t v = 0; v < twice->n_vertices; v++)
        memcpy(twice->points[v], head->points[v % head->n_vertices], sizeof *twice->points);
    for (uint32_t t = 0; t < twice->n_triangles; t++)
        for (int i = 0; i < 3; i++)
            twice->triangles[t][i] = head->triangles[t % head->n_triangles][i] + (t < head->n_triangles ? 0 : head->n_vertices);
    ck_status(groom_body_check(twice, NULL, &report, &diag), GROOM_EDEGENERATE);
    ck_assert_ptr_nonnull(strstr(diag.detail, "more than two triangles"));
    for (uint32_t v = head->n_vertices; v < twice->n_vertices; v++)
        for (int c = 0; c < 3; c++)
            twice->points[v][c] = twice->points[v][c] * 0.1f + (c == 1 ? 1.5f : 0);
    ck_ok(groom_body_check(twice, NULL, &report, NULL));
    ck_assert_uint_eq(report.n_shells, 2);
    ck_assert_ptr_nonnull(strstr(report.warnings[0], "2 shells"));
    groom_mesh_destroy(twice);
    groom_mesh_destroy(head);
}
END_TEST

START_TEST(a_surface_of_one_side_is_refused)
{
    enum { N = 40 };
    struct groom_mesh *band;
    struct groom_diag diag = {0};
    ck_ok(groom_mesh_create(2 * N, 2 * N, 0, NULL, &band, NULL));
    for (uint32_t i = 0; i < N; i++)
        for (int k = 0; k < 2; k++) {
            double angle = 2 * M_PI * i / N, across = k ? 0.3 : -0.3, r = 1 + across * cos(angle / 2);
            band->points[2 * i + (uint32_t)k][0] = (float)(r * cos(angle));
            band->points[2 * i + (uint32_t)k][1] = (float)(across * sin(angle / 2));
            band->points[2 * i + (uint32_t)k][2] = (float)(r * sin(angle));
        }
    for (uint32_t i = 0; i < N; i++) {
        uint32_t a = 2 * i, b = a + 1, c = i + 1 < N ? a + 2 : 1, d = i + 1 < N ? a + 3 : 0;
        memcpy(band->triangles[2 * i], (uint32_t[3]){a, b, c}, sizeof *band->triangles);
        memcpy(band->triangles[2 * i + 1], (uint32_t[3]){b, d, c}, sizeof *band->triangles);
    }
    ck_status(groom_body_check(band, NULL, NULL, &diag), GROOM_EDEGENERATE);
    ck_assert_ptr_nonnull(strstr(diag.detail, "one side"));
    groom_mesh_destroy(band);
}
END_TEST

START_TEST(every_allocation_may_fail)
{
    struct groom_mesh *head = bodies_sample_head();
    struct groom_skeleton skeleton;
    for (int what = 0; what < 2; what++)
        for (size_t fail_at = 0;; fail_at++) {
            struct test_failing_allocator state;
            struct groom_allocator allocator;
            test_failing_allocator_init(&state, fail_at, &allocator);
            struct groom_context context = {.allocator = &allocator};
            groom_status st = what ? groom_skeleton_make(head, &context, &skeleton, NULL) : groom_body_check(head, &context, NULL, NULL);
            ck_assert_uint_eq(state.outstanding_bytes, 0);
            if (st == GROOM_OK)
                break;
            ck_status(st, GROOM_ENOMEM);
        }
    groom_mesh_destroy(head);
}
END_TEST

START_TEST(real_bodies_pass_with_what_is_odd_about_them_told)
{
    static const struct {
        const char *path;
        double unit;
        groom_up up;
        const char *group;
    } bodies[] = {
        {"harolongo/body.obj", 0.01, GROOM_UP_Y, NULL},
        {"combover/body.obj", 1, GROOM_UP_Z, NULL},
        {"makehuman/base.obj", 0.1, GROOM_UP_Y, "body"},
        {"sintel/head.obj", 1, GROOM_UP_Y, NULL},
    };
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        struct groom_mesh *mesh = bodies_shared(bodies[i].path, bodies[i].unit, bodies[i].up, bodies[i].group);
        struct groom_body_report report;
        struct groom_diag diag = {0};
        if (!mesh)
            continue;
        groom_status st = groom_body_check(mesh, NULL, &report, &diag);
        ck_assert_msg(st == GROOM_OK, "%s: %s", bodies[i].path, diag.detail);
        for (uint32_t w = 0; w < report.n_warnings && getenv("SKELETON_SHOW"); w++)
            printf("%s: %s\n", bodies[i].path, report.warnings[w]);
        ck_assert_uint_le(report.n_turned, mesh->n_triangles / 20);
        groom_mesh_destroy(mesh);
    }
}
END_TEST

TEST_SUITE("skeleton", what_is_printed_reads_back_to_the_same_bits, unsound_skeletons_are_refused_at_their_field,
           bones_are_matched_by_name_and_a_missing_one_is_named, a_bare_head_gives_head_and_neck, a_ball_is_a_head_alone,
           real_bodies_give_shoulders_and_arms_inside_of_them, an_affine_image_carries_its_skeleton_exactly,
           regions_of_the_worked_case_are_those_of_its_file, the_worked_case_carries_its_skeleton_to_within_two_centimetres,
           flipped_triangles_are_turned_right_side_out_and_told, a_cut_at_the_neck_is_let_pass_and_a_sheet_refused,
           doubled_faces_are_refused_and_shells_told, a_surface_of_one_side_is_refused, every_allocation_may_fail,
           real_bodies_pass_with_what_is_odd_about_them_told)
