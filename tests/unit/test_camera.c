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

TEST_SUITE("camera", the_target_is_seen_in_the_middle, right_is_right_and_down_is_down, a_camera_may_look_straight_down,
           json_gives_the_same_camera_again, what_is_no_camera_is_refused_by_name)
