#include "geometry/camera_json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/json.h"

/* Puts item into parent, under a name or at the end; takes it also where that fails. */
static int add(cJSON *parent, const char *name, cJSON *item)
{
    if (item && (name ? cJSON_AddItemToObject(parent, name, item) : cJSON_AddItemToArray(parent, item)))
        return 1;
    cJSON_Delete(item);
    return 0;
}

static cJSON *numbers_to_json(const double *numbers, int n)
{
    cJSON *array = cJSON_CreateArray();
    for (int i = 0; array && i < n; i++)
        if (!add(array, NULL, json_number(numbers[i]))) {
            cJSON_Delete(array);
            return NULL;
        }
    return array;
}

static cJSON *rotation_to_json(const double rotation[9])
{
    cJSON *rows = cJSON_CreateArray();
    for (int row = 0; rows && row < 3; row++)
        if (!add(rows, NULL, numbers_to_json(rotation + 3 * row, 3))) {
            cJSON_Delete(rows);
            return NULL;
        }
    return rows;
}

cJSON *camera_to_json(const struct groom_camera *camera)
{
    cJSON *json = cJSON_CreateObject();
    if (json && cJSON_AddStringToObject(json, "name", camera->name) &&
        cJSON_AddNumberToObject(json, "width", camera->width) &&
        cJSON_AddNumberToObject(json, "height", camera->height) && add(json, "fx", json_number(camera->fx)) &&
        add(json, "fy", json_number(camera->fy)) && add(json, "cx", json_number(camera->cx)) &&
        add(json, "cy", json_number(camera->cy)) && add(json, "rotation", rotation_to_json(camera->rotation)) &&
        add(json, "translation", numbers_to_json(camera->translation, 3)))
        return json;
    cJSON_Delete(json);
    return NULL;
}

/* --- reading ---------------------------------------------------------------- */

static groom_status refuse(struct groom_diag *diag, const char *pointer, const char *name, const char *what)
{
    char full[128];
    snprintf(full, sizeof full, "%.90s/%.30s", pointer, name);
    return groom_fail_field(diag, GROOM_EINVAL, full, "a camera's %.30s must be %s", name, what);
}

static groom_status read_numbers(const cJSON *array, int n, double *out)
{
    const cJSON *item;
    int at = 0;
    if (!cJSON_IsArray(array) || cJSON_GetArraySize(array) != n)
        return GROOM_EINVAL;
    cJSON_ArrayForEach(item, array) {
        if (!cJSON_IsNumber(item) || !(fabs(item->valuedouble) < 1e6))
            return GROOM_EINVAL;
        out[at++] = item->valuedouble;
    }
    return GROOM_OK;
}

static groom_status read_rotation(const cJSON *rows, double rotation[9])
{
    const cJSON *row;
    int at = 0;
    if (!cJSON_IsArray(rows) || cJSON_GetArraySize(rows) != 3)
        return GROOM_EINVAL;
    cJSON_ArrayForEach(row, rows) {
        if (read_numbers(row, 3, rotation + 3 * at++) != GROOM_OK)
            return GROOM_EINVAL;
    }
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            const double *p = rotation + 3 * a, *q = rotation + 3 * b;
            if (fabs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2] - (a == b)) > 1e-3)
                return GROOM_EINVAL;
        }
    return GROOM_OK;
}

static int read_number(const cJSON *json, const char *name, double minimum, double maximum, double *out)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(json, name);
    if (!cJSON_IsNumber(item) || !(item->valuedouble >= minimum && item->valuedouble <= maximum))
        return 0;
    *out = item->valuedouble;
    return 1;
}

static const char *const names[] = {"name", "width", "height", "fx", "fy", "cx", "cy", "rotation", "translation"};

static groom_status check_names(const cJSON *json, const char *pointer, struct groom_diag *diag)
{
    const cJSON *item;
    if (!cJSON_IsObject(json))
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "a camera must be an object with width, height, "
                                                             "fx, fy, cx, cy, rotation and translation");
    cJSON_ArrayForEach(item, json) {
        size_t at = 0;
        while (at < sizeof names / sizeof names[0] && strcmp(names[at], item->string) != 0)
            at++;
        if (at == sizeof names / sizeof names[0])
            return refuse(diag, pointer, item->string, "left out: a camera has no such field");
    }
    return GROOM_OK;
}

groom_status camera_from_json(const cJSON *json, const char *pointer, struct groom_camera *camera,
                              struct groom_diag *diag)
{
    struct groom_camera c = {0};
    double width, height;
    const cJSON *name = cJSON_GetObjectItemCaseSensitive(json, "name");
    groom_status st = check_names(json, pointer, diag);
    if (st != GROOM_OK)
        return st;
    if (name && (!cJSON_IsString(name) || strlen(name->valuestring) >= sizeof c.name))
        return refuse(diag, pointer, "name", "a string of at most 31 bytes");
    if (name)
        strcpy(c.name, name->valuestring);
    if (!read_number(json, "width", 1, 65536, &width))
        return refuse(diag, pointer, "width", "a number of pixels, 1 to 65536");
    if (!read_number(json, "height", 1, 65536, &height))
        return refuse(diag, pointer, "height", "a number of pixels, 1 to 65536");
    if (!read_number(json, "fx", 1e-3, 1e9, &c.fx))
        return refuse(diag, pointer, "fx", "a focal length in pixels, above 0");
    if (!read_number(json, "fy", 1e-3, 1e9, &c.fy))
        return refuse(diag, pointer, "fy", "a focal length in pixels, above 0");
    if (!read_number(json, "cx", -1e9, 1e9, &c.cx))
        return refuse(diag, pointer, "cx", "the principal point in pixels");
    if (!read_number(json, "cy", -1e9, 1e9, &c.cy))
        return refuse(diag, pointer, "cy", "the principal point in pixels");
    if (read_rotation(cJSON_GetObjectItemCaseSensitive(json, "rotation"), c.rotation) != GROOM_OK)
        return refuse(diag, pointer, "rotation", "three orthonormal rows of three numbers");
    if (read_numbers(cJSON_GetObjectItemCaseSensitive(json, "translation"), 3, c.translation) != GROOM_OK)
        return refuse(diag, pointer, "translation", "three numbers (metres)");
    c.width = (uint32_t)width;
    c.height = (uint32_t)height;
    *camera = c;
    return GROOM_OK;
}
