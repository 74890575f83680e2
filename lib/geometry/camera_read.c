/* Cameras in files: our own, NeRF's transforms.json, COLMAP's cameras.txt and images.txt. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "geometry/camera_json.h"

#define NERF_SIDE 1000 /* pixels, where only an angle of view is given */

/* --- frames ------------------------------------------------------------------------------ */

/* From the file's unit and axis to metres, y up: p' = s U p, so R' = R U^T, t' = s t. */
static void reframe(struct groom_camera *camera, struct groom_frame frame)
{
    double unit = frame.unit_m > 0 ? frame.unit_m : 1;
    for (int row = 0; row < 3; row++) {
        double *r = camera->rotation + 3 * row, y = r[1];
        camera->translation[row] *= unit;
        if (frame.up == GROOM_UP_Z) { /* (x, y, z) was (x, z, -y) */
            r[1] = r[2];
            r[2] = -y;
        }
    }
}

static groom_status check(const struct groom_camera *camera, uint32_t index, struct groom_diag *diag)
{
    int sound = camera->width >= 1 && camera->width <= 65536 && camera->height >= 1 && camera->height <= 65536 &&
                camera->fx > 0 && camera->fy > 0 && isfinite(camera->cx) && isfinite(camera->cy) && camera->fx < 1e9 &&
                camera->fy < 1e9;
    for (int a = 0; a < 3; a++) {
        sound &= fabs(camera->translation[a]) < 1e6;
        for (int b = 0; b < 3; b++) {
            const double *p = camera->rotation + 3 * a, *q = camera->rotation + 3 * b;
            sound &= fabs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2] - (a == b)) < 1e-3;
        }
    }
    return sound ? GROOM_OK : groom_fail(diag, GROOM_EFORMAT, "camera %u has no sound size, focal length, rotation or place", index);
}

/* The last part of a path. */
static void name_camera(struct groom_camera *camera, const char *path, size_t n)
{
    size_t begin = n;
    while (begin > 0 && path[begin - 1] != '/')
        begin--;
    snprintf(camera->name, sizeof camera->name, "%.*s", (int)(n - begin), path + begin);
}

/* --- transforms.json ----------------------------------------------------------------------- */

/* A number of the frame, or of the file for all frames. */
static double member(const cJSON *file, const cJSON *frame, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(frame, name);
    if (!cJSON_IsNumber(item))
        item = cJSON_GetObjectItemCaseSensitive(file, name);
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

static double otherwise(double value, double other) { return isnan(value) ? other : value; }

static void read_lens(const cJSON *file, const cJSON *frame, struct groom_camera *camera)
{
    double width = otherwise(member(file, frame, "w"), NERF_SIDE), height = otherwise(member(file, frame, "h"), NERF_SIDE);
    double by_x = 0.5 * width / tan(0.5 * member(file, frame, "camera_angle_x"));
    double by_y = 0.5 * height / tan(0.5 * member(file, frame, "camera_angle_y"));
    camera->fx = otherwise(member(file, frame, "fl_x"), by_x);
    camera->fy = otherwise(otherwise(member(file, frame, "fl_y"), by_y), camera->fx);
    camera->cx = otherwise(member(file, frame, "cx"), 0.5 * width);
    camera->cy = otherwise(member(file, frame, "cy"), 0.5 * height);
    camera->width = width >= 1 && width <= 65536 ? (uint32_t)width : 0;
    camera->height = height >= 1 && height <= 65536 ? (uint32_t)height : 0;
}

/* transform_matrix takes the camera (x right, y up, z backward) to the world. */
static int read_pose(const cJSON *frame, struct groom_camera *camera)
{
    const cJSON *matrix = cJSON_GetObjectItemCaseSensitive(frame, "transform_matrix");
    double m[3][4];
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++) {
            const cJSON *item = cJSON_GetArrayItem(cJSON_GetArrayItem(matrix, row), column);
            if (!cJSON_IsNumber(item))
                return 0;
            m[row][column] = item->valuedouble;
        }
    for (int axis = 0; axis < 3; axis++) {
        double sign = axis == 0 ? 1 : -1, along = 0;
        for (int c = 0; c < 3; c++) {
            camera->rotation[3 * axis + c] = sign * m[c][axis];
            along += camera->rotation[3 * axis + c] * m[c][3];
        }
        camera->translation[axis] = -along;
    }
    return 1;
}

static groom_status read_transforms(const cJSON *file, struct groom_frame frame, struct groom_camera *cameras, uint32_t most,
                                    uint32_t *n, struct groom_diag *diag)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(file, "frames")) {
        const char *path = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "file_path"));
        if (*n == most)
            return groom_fail(diag, GROOM_ETOOBIG, "there are more than %u cameras", most);
        struct groom_camera *camera = &cameras[*n];
        memset(camera, 0, sizeof *camera);
        read_lens(file, item, camera);
        if (!read_pose(item, camera))
            return groom_fail(diag, GROOM_EFORMAT, "frame %u has no transform_matrix of 4 x 4 numbers", *n);
        if (path)
            name_camera(camera, path, strlen(path));
        reframe(camera, frame);
        groom_status st = check(camera, (*n)++, diag);
        if (st != GROOM_OK)
            return st;
    }
    return GROOM_OK;
}

/* --- our own ---------------------------------------------------------------------------------- */

static groom_status read_own(const cJSON *list, const char *pointer, struct groom_camera *cameras, uint32_t most, uint32_t *n,
                             struct groom_diag *diag)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, list) {
        char of_item[128];
        if (*n == most)
            return groom_fail(diag, GROOM_ETOOBIG, "there are more than %u cameras", most);
        snprintf(of_item, sizeof of_item, "%.90s/%u", pointer, *n);
        groom_status st = camera_from_json(item, of_item, &cameras[*n], diag);
        if (st != GROOM_OK)
            return st;
        (*n)++;
    }
    return GROOM_OK;
}

groom_status groom_cameras_read_json(const char *json, size_t n_bytes, struct groom_frame frame, struct groom_camera *cameras,
                                     uint32_t most, uint32_t *n, struct groom_diag *diag)
{
    cJSON *file = cJSON_ParseWithLength(json, n_bytes);
    uint32_t found = 0;
    groom_status st;
    if (cJSON_IsArray(cJSON_GetObjectItemCaseSensitive(file, "frames")))
        st = read_transforms(file, frame, cameras, most, &found, diag);
    else if (cJSON_IsArray(cJSON_GetObjectItemCaseSensitive(file, "cameras")))
        st = read_own(cJSON_GetObjectItemCaseSensitive(file, "cameras"), "/cameras", cameras, most, &found, diag);
    else
        st = groom_fail(diag, GROOM_EFORMAT, "this is neither {\"cameras\":[...]} nor a transforms.json with \"frames\"");
    cJSON_Delete(file);
    if (st == GROOM_OK)
        *n = found;
    return st;
}

/* --- COLMAP ------------------------------------------------------------------------------------- */

/* A line without comments and empty ones; the next begins at *at. NULL at the end. */
static const char *next_line(const char **at, const char *end, const char **line_end, int comments_too)
{
    while (*at < end) {
        const char *line = *at, *stop = memchr(line, '\n', (size_t)(end - line));
        *line_end = stop ? stop : end;
        *at = stop ? stop + 1 : end;
        if (comments_too || (*line_end > line && line[0] != '#' && line[0] != '\r'))
            return line;
    }
    return NULL;
}

static const char *skip_blanks(const char *at, const char *end)
{
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\r'))
        at++;
    return at;
}

/* The next word; empty at the end of the line. */
static const char *next_word(const char **at, const char *end, size_t *n)
{
    const char *word = skip_blanks(*at, end), *stop = word;
    while (stop < end && *stop != ' ' && *stop != '\t' && *stop != '\r')
        stop++;
    *at = stop;
    *n = (size_t)(stop - word);
    return word;
}

static int next_number(const char **at, const char *end, double *value)
{
    const char *stop = (const char *)number_scan((const unsigned char *)skip_blanks(*at, end), value);
    if (!stop || stop > end || !isfinite(*value))
        return 0;
    *at = stop;
    return 1;
}

/* Of each model how many focal lengths come first; the rest behind the principal point is distortion,
 * which is too small to hide a strand. */
static const struct { const char *name; int n_focal; } models[] = {
    {"SIMPLE_PINHOLE", 1}, {"PINHOLE", 2},        {"SIMPLE_RADIAL", 1},  {"RADIAL", 1},
    {"OPENCV", 2},         {"FULL_OPENCV", 2},    {"SIMPLE_RADIAL_FISHEYE", 1}, {"RADIAL_FISHEYE", 1},
    {"OPENCV_FISHEYE", 2}, {"FOV", 2},            {"THIN_PRISM_FISHEYE", 2}};

static int read_lens_line(const char *line, const char *end, double *id, struct groom_camera *camera)
{
    double width, height;
    size_t n;
    int n_focal = 0;
    memset(camera, 0, sizeof *camera);
    if (!next_number(&line, end, id))
        return 0;
    const char *model = next_word(&line, end, &n);
    for (size_t k = 0; k < sizeof models / sizeof models[0]; k++)
        if (strlen(models[k].name) == n && memcmp(models[k].name, model, n) == 0)
            n_focal = models[k].n_focal;
    if (!n_focal || !next_number(&line, end, &width) || !next_number(&line, end, &height) ||
        !next_number(&line, end, &camera->fx) || (n_focal == 2 && !next_number(&line, end, &camera->fy)) ||
        !next_number(&line, end, &camera->cx) || !next_number(&line, end, &camera->cy))
        return 0;
    camera->fy = n_focal == 2 ? camera->fy : camera->fx;
    camera->width = width >= 1 && width <= 65536 ? (uint32_t)width : 0;
    camera->height = height >= 1 && height <= 65536 ? (uint32_t)height : 0;
    return 1;
}

static int find_lens(const char *text, size_t n, double wanted, struct groom_camera *camera)
{
    const char *at = text, *end = text + n, *line, *line_end;
    double id;
    while ((line = next_line(&at, end, &line_end, 0)) != NULL)
        if (read_lens_line(line, line_end, &id, camera) && fabs(id - wanted) < 0.5)
            return 1;
    return 0;
}

static void rotation_of(const double q[4], double r[9])
{
    double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]); /* 0: NANs, which check refuses */
    double w = q[0] / size, x = q[1] / size, y = q[2] / size, z = q[3] / size;
    const double rows[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
    memcpy(r, rows, sizeof rows);
}

groom_status groom_cameras_read_colmap(const char *lenses, size_t n_lenses, const char *images, size_t n_images,
                                       struct groom_frame frame, struct groom_camera *cameras, uint32_t most, uint32_t *n,
                                       struct groom_diag *diag)
{
    const char *at = images, *end = images + n_images, *line, *line_end, *points_end;
    uint32_t found = 0;
    while ((line = next_line(&at, end, &line_end, 0)) != NULL) {
        double id, q[4], t[3], lens;
        size_t n_name;
        int sound = next_number(&line, line_end, &id);
        for (int k = 0; k < 4; k++)
            sound = sound && next_number(&line, line_end, &q[k]);
        for (int k = 0; k < 3; k++)
            sound = sound && next_number(&line, line_end, &t[k]);
        if (!sound || !next_number(&line, line_end, &lens))
            return groom_fail(diag, GROOM_EFORMAT, "image %u of images.txt is not \"ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\"", found);
        if (found == most)
            return groom_fail(diag, GROOM_ETOOBIG, "there are more than %u cameras", most);
        if (!find_lens(lenses, n_lenses, lens, &cameras[found]))
            return groom_fail(diag, GROOM_EFORMAT, "cameras.txt has no camera %.0f of a known model", lens);
        const char *name = next_word(&line, line_end, &n_name);
        name_camera(&cameras[found], name, n_name);
        rotation_of(q, cameras[found].rotation);
        memcpy(cameras[found].translation, t, sizeof t);
        reframe(&cameras[found], frame);
        groom_status st = check(&cameras[found], found, diag);
        if (st != GROOM_OK)
            return st;
        found++;
        next_line(&at, end, &points_end, 1); /* the image's points, empty or not */
    }
    *n = found;
    return GROOM_OK;
}

/* --- in options ----------------------------------------------------------------------------------- */

/* "unit": a word or a number of metres; "up": "y" or "z". */
static groom_status read_frame(const cJSON *json, const char *pointer, struct groom_frame *frame, struct groom_diag *diag)
{
    const cJSON *unit = cJSON_GetObjectItemCaseSensitive(json, "unit"), *up = cJSON_GetObjectItemCaseSensitive(json, "up");
    char at[128], number[40];
    *frame = (struct groom_frame){.unit_m = 1};
    snprintf(number, sizeof number, "%.17g", cJSON_IsNumber(unit) ? unit->valuedouble : 1);
    snprintf(at, sizeof at, "%.90s/unit", pointer);
    if (unit && groom_unit_parse(cJSON_IsString(unit) ? unit->valuestring : number, &frame->unit_m, NULL) != GROOM_OK)
        return groom_fail_field(diag, GROOM_EINVAL, at, "unit must be m, cm, mm, dm, in or a number of metres");
    snprintf(at, sizeof at, "%.90s/up", pointer);
    if (up && (!cJSON_IsString(up) || groom_up_parse(up->valuestring, &frame->up, NULL) != GROOM_OK))
        return groom_fail_field(diag, GROOM_EINVAL, at, "up must be \"y\" or \"z\"");
    return GROOM_OK;
}

static groom_status read_texts(const cJSON *json, const char *pointer, struct groom_frame frame, struct groom_camera *cameras,
                               uint32_t most, uint32_t *n, struct groom_diag *diag)
{
    const char *lenses = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "cameras_txt"));
    const char *images = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "images_txt"));
    if (!lenses || !images)
        return groom_fail_field(diag, GROOM_EINVAL, pointer,
                                "cameras must be an array of cameras, a transforms.json with \"frames\", or COLMAP's files "
                                "as the texts \"cameras_txt\" and \"images_txt\"");
    return groom_cameras_read_colmap(lenses, strlen(lenses), images, strlen(images), frame, cameras, most, n, diag);
}

groom_status cameras_from_json(const cJSON *json, const char *pointer, struct groom_camera *cameras, uint32_t most,
                               uint32_t *n, struct groom_diag *diag)
{
    struct groom_frame frame;
    struct groom_diag own = {0};
    uint32_t found = 0;
    groom_status st;
    if (cJSON_IsArray(json))
        st = read_own(json, pointer, cameras, most, &found, &own);
    else if ((st = read_frame(json, pointer, &frame, &own)) == GROOM_OK)
        st = cJSON_IsArray(cJSON_GetObjectItemCaseSensitive(json, "frames"))
                 ? read_transforms(json, frame, cameras, most, &found, &own)
                 : read_texts(json, pointer, frame, cameras, most, &found, &own);
    if (st != GROOM_OK)
        return groom_fail_field(diag, GROOM_EINVAL, own.pointer[0] ? own.pointer : pointer, "%s", own.detail);
    *n = found;
    return GROOM_OK;
}

/* --- writing ------------------------------------------------------------------------------------- */

groom_status groom_cameras_print(const struct groom_camera *cameras, uint32_t n, char **out, struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject(), *array = cJSON_AddArrayToObject(json, "cameras");
    int whole = array != NULL;
    for (uint32_t i = 0; whole && i < n; i++) {
        cJSON *camera = camera_to_json(&cameras[i]);
        whole = cJSON_AddItemToArray(array, camera);
        if (!whole)
            cJSON_Delete(camera);
    }
    char *text = whole ? cJSON_Print(json) : NULL;
    cJSON_Delete(json);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u cameras as JSON", n);
    *out = text;
    return GROOM_OK;
}
