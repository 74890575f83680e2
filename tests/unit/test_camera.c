/* pinhole cameras and their JSON */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "geometry/camera_json.h"
#include "tests/support/test.h"

static struct groom_camera front(void)
{
    struct groom_camera camera;
    groom_camera_look_at((double[3]){0, 1.6, 1}, (double[3]){0, 1.6, 0}, 1.0, 640, 480, &camera);
    return camera;
}

START_TEST(the_target_is_seen_in_the_middle)
{
    struct groom_camera camera = front();
    double pixel[2], depth;
    ck_assert_int_eq(groom_camera_project(&camera, (float[3]){0, 1.6f, 0}, pixel, &depth), 1);
    ck_assert_double_eq_tol(pixel[0], 320, 1e-3);
    ck_assert_double_eq_tol(pixel[1], 240, 1e-3);
    ck_assert_double_eq_tol(depth, 1, 1e-6);
}
END_TEST

START_TEST(right_is_right_and_down_is_down)
{
    struct groom_camera camera = front();
    double pixel[2], depth;
    groom_camera_project(&camera, (float[3]){0.1f, 1.5f, 0}, pixel, &depth);
    ck_assert_double_gt(pixel[0], 320);
    ck_assert_double_gt(pixel[1], 240);
    /* the lower edge of the picture is half the field of view down */
    groom_camera_project(&camera, (float[3]){0, (float)(1.6 - tan(0.5)), 0}, pixel, &depth);
    ck_assert_double_eq_tol(pixel[1], 480, 1e-2);
    ck_assert_int_eq(groom_camera_project(&camera, (float[3]){0, 1.6f, 2}, pixel, &depth), 0);
}
END_TEST

START_TEST(a_camera_may_look_straight_down)
{
    struct groom_camera camera;
    double pixel[2], depth;
    groom_camera_look_at((double[3]){0, 3, 0}, (double[3]){0, 1, 0}, 1.0, 100, 100, &camera);
    groom_camera_project(&camera, (float[3]){0.1f, 1, 0.2f}, pixel, &depth);
    ck_assert_double_gt(pixel[0], 50);
    ck_assert_double_gt(pixel[1], 50); /* the face, towards +z, at the bottom */
}
END_TEST

START_TEST(json_gives_the_same_camera_again)
{
    struct groom_camera camera = front(), again;
    strcpy(camera.name, "front");
    cJSON *made = camera_to_json(&camera);
    char *text = cJSON_PrintUnformatted(made);
    cJSON *json = cJSON_Parse(text); /* numbers are printed exactly */
    memset(&again, 0xff, sizeof again);
    ck_ok(camera_from_json(json, "/cameras/0", &again, NULL));
    ck_assert_mem_eq(&camera, &again, sizeof camera);
    free(text);
    cJSON_Delete(made);
    cJSON_Delete(json);
}
END_TEST

static void refused(const char *name, const char *value)
{
    struct groom_camera camera = front(), out;
    struct groom_diag diag = {0};
    char pointer[64] = "/cameras/0/";
    cJSON *made = camera_to_json(&camera);
    char *text = cJSON_PrintUnformatted(made);
    cJSON *json = cJSON_Parse(text);
    cJSON_Delete(made);
    free(text);
    cJSON_DeleteItemFromObject(json, name);
    if (value)
        cJSON_AddItemToObject(json, name, cJSON_Parse(value));
    ck_status(camera_from_json(json, "/cameras/0", &out, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, strcat(pointer, name));
    cJSON_Delete(json);
}

START_TEST(what_is_no_camera_is_refused_by_name)
{
    refused("width", NULL);
    refused("height", "0");
    refused("fx", "-3");
    refused("fy", "\"1\"");
    refused("cx", "1e400");
    refused("rotation", "[[1,0,0],[0,1,0],[0,0,2]]");
    refused("rotation", "[[1,0,0],[0,1,0]]");
    refused("translation", "[1,2]");
    refused("lens", "5");
    refused("name", "\"a name that is much too long for a camera\"");
}
END_TEST

/* --- other programs' files ------------------------------------------------------------------- */

static const struct groom_frame metres = {1, GROOM_UP_Y};

/* The camera of front(): at (0, 1.6, 1), looking along -z. */
static const char transforms[] =
    "{\"w\":640,\"h\":480,\"camera_angle_x\":1.2,\"fl_y\":439.3,\"frames\":[{\"file_path\":\"./images/front.png\","
    "\"transform_matrix\":[[1,0,0,0],[0,1,0,1.6],[0,0,1,1],[0,0,0,1]]}]}";

START_TEST(transforms_are_read_as_nerf_means_them)
{
    struct groom_camera camera, expected = front();
    uint32_t n;
    ck_ok(groom_cameras_read_json(transforms, strlen(transforms), metres, &camera, 1, &n, NULL));
    ck_assert_uint_eq(n, 1);
    ck_assert_str_eq(camera.name, "front.png");
    for (int k = 0; k < 9; k++)
        ck_assert_double_eq_tol(camera.rotation[k], expected.rotation[k], 1e-9);
    for (int k = 0; k < 3; k++)
        ck_assert_double_eq_tol(camera.translation[k], expected.translation[k], 1e-9);
    ck_assert_double_eq_tol(camera.fx, 320 / tan(0.6), 1e-9);
    ck_assert_double_eq(camera.fy, 439.3);
    ck_assert_double_eq(camera.cx, 320);
}
END_TEST

static const char lenses[] = "# Camera list\n1 SIMPLE_RADIAL 640 480 500 320 240 0.01\n7 PINHOLE 800 600 700 710 400 300\r\n";
/* at the origin, turned half around y: looks along +z of a file in which that is forward */
static const char images[] = "# Image list\n1 1 0 0 0 0 0 0 7 a.jpg\n1.5 2.5 -1 3 4 5\n2 0 0 1 0 0.5 0 2 1 sub/b.jpg\n\n";

START_TEST(colmap_text_is_read)
{
    struct groom_camera camera[2];
    uint32_t n;
    ck_ok(groom_cameras_read_colmap(lenses, strlen(lenses), images, strlen(images), metres, camera, 2, &n, NULL));
    ck_assert_uint_eq(n, 2);
    ck_assert_str_eq(camera[1].name, "b.jpg");
    ck_assert_double_eq(camera[0].fy, 710);
    ck_assert_double_eq(camera[1].fy, 500);
    ck_assert_double_eq(camera[1].rotation[0], -1);
    ck_assert_double_eq(camera[1].rotation[4], 1);
    ck_assert_double_eq(camera[1].rotation[8], -1);
    ck_assert_double_eq(camera[1].translation[2], 2);
}
END_TEST

START_TEST(a_camera_sees_a_point_of_its_file_wherever_that_is_put)
{
    struct groom_frame frame = {0.01, GROOM_UP_Z};
    struct groom_camera as_it_is[2], moved[2];
    float point[3] = {12, -7, 150}, inside[3];
    double a[2], b[2], depth, deeper;
    uint32_t n;
    ck_ok(groom_cameras_read_colmap(lenses, strlen(lenses), images, strlen(images), metres, as_it_is, 2, &n, NULL));
    ck_ok(groom_cameras_read_colmap(lenses, strlen(lenses), images, strlen(images), frame, moved, 2, &n, NULL));
    groom_frame_to_metres(frame, point, inside);
    ck_assert(groom_camera_project(&as_it_is[0], point, a, &depth));
    ck_assert(groom_camera_project(&moved[0], inside, b, &deeper));
    ck_assert_double_eq_tol(a[0], b[0], 1e-3);
    ck_assert_double_eq_tol(a[1], b[1], 1e-3);
    ck_assert_double_eq_tol(deeper, 0.01 * depth, 1e-6);
}
END_TEST

START_TEST(files_that_hold_no_cameras_are_refused)
{
    static const char *const bad[] = {"", "[]", "{}", "{\"frames\":[{}]}", "{\"cameras\":[{}]}",
                                      "{\"frames\":[{\"transform_matrix\":[[2,0,0,0],[0,1,0,0],[0,0,1,0]]}],\"fl_x\":5}",
                                      "{\"frames\":[{\"transform_matrix\":[[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}"};
    static const char *const bad_images[] = {"1 1 0 0", "1 1 0 0 0 0 0 0 9 a.jpg\n", "1 0 0 0 0 0 0 0 7 a.jpg\n", "x\n"};
    struct groom_camera camera;
    uint32_t n;
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++)
        ck_assert_int_ne(groom_cameras_read_json(bad[k], strlen(bad[k]), metres, &camera, 1, &n, NULL), GROOM_OK);
    for (size_t k = 0; k < sizeof bad_images / sizeof bad_images[0]; k++)
        ck_status(groom_cameras_read_colmap(lenses, strlen(lenses), bad_images[k], strlen(bad_images[k]), metres, &camera, 1, &n, NULL), GROOM_EFORMAT);
    ck_status(groom_cameras_read_colmap(lenses, strlen(lenses), images, strlen(images), metres, &camera, 1, &n, NULL), GROOM_ETOOBIG);
}
END_TEST

TEST_SUITE("camera", the_target_is_seen_in_the_middle, right_is_right_and_down_is_down, a_camera_may_look_straight_down,
           json_gives_the_same_camera_again, what_is_no_camera_is_refused_by_name,
           transforms_are_read_as_nerf_means_them, colmap_text_is_read, a_camera_sees_a_point_of_its_file_wherever_that_is_put,
           files_that_hold_no_cameras_are_refused)
