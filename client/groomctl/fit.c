/* fit: a job, and with --wait or -o all the way from a file to a groom in a file. */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "client/groomctl/jobs.h"
#include "client/groomctl/json_path.h"
#include "client/groomctl/output_file.h"
#include "client/groomctl/read_file.h"
#include "client/groomctl/transfer.h"
#include "groom/camera.h"
#include "groom/fit.h"
#include "proto/url.h"

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

static int read_options_file(const struct arguments *arguments, cJSON **options)
{
    const char *path = argument(arguments, "options");
    *options = path ? read_json_file(path) : cJSON_CreateObject();
    if (cJSON_IsObject(*options))
        return 1;
    if (*options)
        fprintf(stderr, "groomctl: %s does not hold a JSON object\n", path);
    return 0;
}

static int build_options(const struct arguments *arguments, cJSON **out)
{
    cJSON *options;
    const char *value;
    if (!read_options_file(arguments, &options))
        return REFUSED;
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
    for (size_t i = 0; (value = argument_nth(arguments, "option", i)); i++)
        if (!json_set_path(options, value))
            return groomctl_usage_error(
                "fit", "--option %s is not path=value (stages.initialize.n_smooth=40)", value);
    return DONE;
}

/* --- inputs --------------------------------------------------------------------------------- */

/* What was uploaded already. */
static int look_at(struct groomctl *ctl, enum sized_thing thing, const char *id, cJSON **answer)
{
    struct url url;
    url_init(&url, thing == SIZED_HEAD ? "/v1/heads" : "/v1/strands");
    url_segment(&url, id);
    return api_json(ctl, "GET", url.text, NULL, NULL, answer);
}

/* An id stays as it is; anything else is a file to upload. *answer: the upload, the caller's to delete. */
static int resolve(struct groomctl *ctl, const struct arguments *arguments, enum sized_thing thing,
                   const char *what, cJSON **answer)
{
    struct upload_options options = upload_options_of(arguments);
    if (!strncmp(what, thing == SIZED_HEAD ? "head_" : "str_", thing == SIZED_HEAD ? 5 : 4) &&
        access(what, F_OK))
        return look_at(ctl, thing, what, answer);
    if (thing == SIZED_HEAD)
        options.format = options.name = NULL;
    if (thing == SIZED_HEAD && argument(arguments, "head-unit"))
        options.unit = argument(arguments, "head-unit");
    if (thing == SIZED_HEAD && argument(arguments, "head-up"))
        options.up = argument(arguments, "head-up");
    int status = upload_file(ctl, thing, what, &options, answer);
    if (status == DONE)
        upload_describe(ctl, thing, &options, *answer);
    return status;
}

static void hint_where_apart(const cJSON *strands, const cJSON *head)
{
    struct sized_box hair_box, head_box;
    char text[256];
    if (!upload_box(strands, &hair_box) || !upload_box(head, &head_box))
        return;
    apart_hint_text(&hair_box, &head_box, text, sizeof text);
    if (text[0])
        fprintf(stderr, "hint: %s\n", text);
}

/* --- the job ----------------------------------------------------------------------------------- */

/* A key of this call's own: should the line break, the same request finds the same job. */
static void idempotency_header(char *header, size_t size)
{
    unsigned char bytes[16] = {0};
    FILE *random = fopen("/dev/urandom", "rb");
    size_t n = (size_t)snprintf(header, size, "Idempotency-Key: groomctl-");
    if (!random || fread(bytes, 1, sizeof bytes, random) != sizeof bytes)
        snprintf((char *)bytes, sizeof bytes, "%lx",
                 (unsigned long)time(NULL) ^ (unsigned long)getpid() << 20);
    if (random)
        fclose(random);
    for (size_t i = 0; i < sizeof bytes; i++)
        n += (size_t)snprintf(header + n, size - n, "%02x", bytes[i]);
}

/* Who is told of the end. returns  0 where half of it is missing (and said so) */
static int add_webhook(const struct arguments *arguments, cJSON *body)
{
    const char *url = argument(arguments, "webhook"), *secret = argument(arguments, "webhook-secret");
    if (!url && !secret)
        return 1;
    if (!url || !secret) {
        groomctl_usage_error("fit", "--webhook and --webhook-secret go together");
        return 0;
    }
    cJSON *webhook = cJSON_AddObjectToObject(body, "webhook");
    cJSON_AddStringToObject(webhook, "url", url);
    cJSON_AddStringToObject(webhook, "secret", secret);
    return 1;
}

static int submit(struct groomctl *ctl, const struct arguments *arguments, const char *strands, const char *head, cJSON *options,
                  cJSON **job)
{
    char header[96];
    const char *priority = argument(arguments, "priority");
    cJSON *body = cJSON_CreateObject();
    if (!add_webhook(arguments, body)) {
        cJSON_Delete(body);
        return WRONG_USAGE;
    }
    if (priority)
        cJSON_AddItemToObject(body, "priority", json_value(priority));
    idempotency_header(header, sizeof header);
    cJSON_AddStringToObject(body, "kind", "fit");
    cJSON_AddStringToObject(body, "strands", strands);
    if (head[0])
        cJSON_AddStringToObject(body, "head", head);
    cJSON_AddItemReferenceToObject(body, "options", options);
    int status = api_json(ctl, "POST", "/v1/jobs", body, header, job);
    cJSON_Delete(body);
    return status;
}

static int export_result(struct groomctl *ctl, const struct arguments *arguments, const char *groom,
                         const char *path)
{
    const char *format = argument(arguments, "output-format");
    struct url url;
    url_init(&url, "/v1/grooms");
    url_segment(&url, groom);
    url_segment(&url, "strands");
    url_query(&url, "format", format ? format : format_of_path(path));
    url_query(&url, "unit", argument(arguments, "unit"));
    url_query(&url, "up", argument(arguments, "up"));
    int status = download_file(ctl, url.text, path);
    if (status == DONE && !ctl->json)
        printf("%s\n", path);
    return status;
}

static int write_id(const char *groom, const char *path)
{
    char line[80];
    int n = snprintf(line, sizeof line, "%s\n", groom);
    return output_file_save(path, line, (size_t)n) ? DONE : REFUSED;
}

static int follow(struct groomctl *ctl, const struct arguments *arguments, const char *job)
{
    const char *path = argument(arguments, "output");
    struct job_view view;
    job_view_init(&view, job);
    int status = jobs_watch_all(ctl, &view, 1);
    if (status == DONE && argument(arguments, "groom-id-file"))
        status = write_id(view.groom, argument(arguments, "groom-id-file"));
    return status == DONE && path ? export_result(ctl, arguments, view.groom, path) : status;
}

static int run(struct groomctl *ctl, const struct arguments *arguments, cJSON *options)
{
    cJSON *strands = NULL, *head = NULL;
    const char *head_name =
        argument(arguments, "head-file") ? argument(arguments, "head-file") : argument(arguments, "head");
    int waits =
        argument(arguments, "wait") || argument(arguments, "output") || argument(arguments, "groom-id-file");
    cJSON *job = NULL;
    int status = resolve(ctl, arguments, SIZED_HAIR, arguments->operands[0], &strands);
    if (status == DONE && head_name)
        status = resolve(ctl, arguments, SIZED_HEAD, head_name, &head);
    if (status == DONE)
        hint_where_apart(strands, head);
    if (status == DONE)
        status = submit(ctl, arguments, api_text(strands, "id"), api_text(head, "id"), options, &job);
    cJSON_Delete(strands);
    cJSON_Delete(head);
    if (status == DONE && ctl->json)
        api_print(ctl, job);
    else if (status == DONE)
        printf("%s\n", api_text(job, "id"));
    fflush(stdout);
    if (status == DONE && waits)
        status = follow(ctl, arguments, api_text(job, "id"));
    else if (status == DONE && !ctl->json)
        fprintf(stderr, "watch it: groomctl watch %s\n", api_text(job, "id"));
    cJSON_Delete(job);
    return status;
}

int command_fit(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *path = argument(arguments, "output");
    cJSON *options = NULL;
    if (path && !argument(arguments, "output-format") && !format_of_path(path))
        return groomctl_usage_error("fit", "%s has no extension that names a format; add --output-format F",
                                    path);
    if (path && !output_file_check(path))
        return REFUSED; /* before minutes of work, not after */
    int status = build_options(arguments, &options);
    if (status == DONE)
        status = run(ctl, arguments, options);
    cJSON_Delete(options);
    return status;
}
