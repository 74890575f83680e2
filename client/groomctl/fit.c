/* fit: a job, and with --wait or -o all the way from a file to a groom in a file. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "client/groomctl/json_path.h"
#include "client/groomctl/read_file.h"
#include "client/groomctl/submit.h"
#include "groom/camera.h"
#include "groom/fit.h"

/* --- options ---------------------------------------------------------------------------- */

/* Options of the command line that are members of the job's options by another spelling. */
static const struct {
    const char *option, *member;
} members[] = {
    {"guides", "guides"},     {"operator-guides", "operator_guides"},
    {"vertices", "vertices"}, {"quality", "quality"},
    {"seed", "seed"},
};

/* "scale,curl" -> ["scale","curl"]; "auto" stays a word. */
static cJSON *operator_list(const char *text)
{
    if (!strcmp(text, "auto"))
        return cJSON_CreateString(text);
    cJSON *list = cJSON_CreateArray();
    while (*text) {
        char name[32];
        size_t n = strcspn(text, ",");
        snprintf(name, sizeof name, "%.*s", (int)n, text);
        if (n)
            cJSON_AddItemToArray(list, cJSON_CreateString(name));
        text += n + (text[n] == ',');
    }
    return list;
}

/* COLMAP's two files of a folder, or a JSON file; in the unit and axis of the strands where they are not ours. */
static groom_status read_cameras(const char *path, struct groom_frame frame, struct groom_camera *cameras, uint32_t *n,
                                 struct groom_diag *diag)
{
    char lenses_path[4096], images_path[4096];
    struct stat status;
    size_t n_text = 0, n_images = 0;
    int is_folder = stat(path, &status) == 0 && S_ISDIR(status.st_mode);
    snprintf(lenses_path, sizeof lenses_path, is_folder ? "%s/cameras.txt" : "%s", path);
    snprintf(images_path, sizeof images_path, "%s/images.txt", path);
    char *text = read_whole_file(lenses_path, &n_text), *images = is_folder ? read_whole_file(images_path, &n_images) : NULL;
    groom_status st = GROOM_EIO; /* said already */
    if (text && !is_folder)
        st = groom_cameras_read_json(text, n_text, frame, cameras, GROOM_FIT_MAX_CAMERAS, n, diag);
    else if (text && images)
        st = groom_cameras_read_colmap(text, n_text, images, n_images, frame, cameras, GROOM_FIT_MAX_CAMERAS, n, diag);
    free(text);
    free(images);
    return st;
}

/* The cameras become the visibility option; what else it holds stays. */
static int add_cameras(const struct arguments *arguments, cJSON *options, const char *path)
{
    const char *unit = argument(arguments, "unit"), *up = argument(arguments, "up");
    struct groom_frame frame = {.unit_m = 1};
    struct groom_camera *cameras = calloc(GROOM_FIT_MAX_CAMERAS, sizeof *cameras);
    struct groom_diag diag = {0};
    char *text = NULL;
    uint32_t n = 0;
    groom_status st = cameras ? GROOM_OK : GROOM_ENOMEM;
    if (st == GROOM_OK && unit)
        st = groom_unit_parse(unit, &frame.unit_m, &diag);
    if (st == GROOM_OK && up)
        st = groom_up_parse(up, &frame.up, &diag);
    if (st == GROOM_OK && (st = read_cameras(path, frame, cameras, &n, &diag)) == GROOM_OK)
        st = groom_cameras_print(cameras, n, &text, &diag);
    free(cameras);
    if (st != GROOM_OK && diag.detail[0])
        fprintf(stderr, "groomctl: %s: %s%s%s\n", path, diag.detail, diag.pointer[0] ? " at " : "", diag.pointer);
    cJSON *json = text ? cJSON_Parse(text) : NULL, *list = cJSON_DetachItemFromObject(json, "cameras");
    cJSON *visibility = cJSON_GetObjectItemCaseSensitive(options, "visibility");
    free(text);
    cJSON_Delete(json);
    if (list && !cJSON_IsObject(visibility)) {
        cJSON_DeleteItemFromObjectCaseSensitive(options, "visibility");
        visibility = cJSON_AddObjectToObject(options, "visibility");
    }
    cJSON_DeleteItemFromObjectCaseSensitive(visibility, "cameras");
    return list && cJSON_AddItemToObject(visibility, "cameras", list);
}

static int build_options(const struct arguments *arguments, cJSON **out)
{
    cJSON *options;
    const char *value;
    int status = submit_options_file(arguments, &options);
    if (status != DONE)
        return status;
    *out = options;
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        if (!(value = argument(arguments, members[i].option)))
            continue;
        cJSON_DeleteItemFromObjectCaseSensitive(options, members[i].member);
        cJSON_AddItemToObject(options, members[i].member, json_value(value));
    }
    if ((value = argument(arguments, "operators"))) {
        cJSON_DeleteItemFromObjectCaseSensitive(options, "operators");
        cJSON_AddItemToObject(options, "operators", operator_list(value));
    }
    if ((value = argument(arguments, "cameras")) && !add_cameras(arguments, options, value))
        return REFUSED;
    return submit_options_paths("fit", arguments, options);
}

static int submit(struct groomctl *ctl, const struct arguments *arguments, const char *strands, const char *head, cJSON *options,
                  cJSON **job)
{
    cJSON *body = cJSON_CreateObject();
    cJSON_AddStringToObject(body, "kind", "fit");
    cJSON_AddStringToObject(body, "strands", strands);
    if (head[0])
        cJSON_AddStringToObject(body, "head", head);
    cJSON_AddItemReferenceToObject(body, "options", options);
    int status = submit_job(ctl, "fit", arguments, body, job);
    cJSON_Delete(body);
    return status;
}

static int run(struct groomctl *ctl, const struct arguments *arguments, cJSON *options)
{
    cJSON *strands = NULL, *head = NULL, *job = NULL;
    const char *head_name =
        argument(arguments, "head-file") ? argument(arguments, "head-file") : argument(arguments, "head");
    int status = submit_input(ctl, arguments, SIZED_HAIR, arguments->operands[0], &strands);
    if (status == DONE && head_name)
        status = submit_input(ctl, arguments, SIZED_HEAD, head_name, &head);
    if (status == DONE)
        submit_hint_where_apart(strands, head);
    if (status == DONE)
        status = submit(ctl, arguments, api_text(strands, "id"), api_text(head, "id"), options, &job);
    cJSON_Delete(strands);
    cJSON_Delete(head);
    if (status == DONE)
        status = submit_follow(ctl, arguments, job, NULL);
    cJSON_Delete(job);
    return status;
}

int command_fit(struct groomctl *ctl, const struct arguments *arguments)
{
    cJSON *options = NULL;
    int status = submit_check_output("fit", arguments);
    if (status == DONE)
        status = build_options(arguments, &options);
    if (status == DONE)
        status = run(ctl, arguments, options);
    cJSON_Delete(options);
    return status;
}
