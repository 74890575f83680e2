/* retarget: carry strands or a groom from the head that they are on to others; hairline: today's line on another. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "client/groomctl/json_path.h"
#include "client/groomctl/output_file.h"
#include "client/groomctl/read_file.h"
#include "client/groomctl/submit.h"
#include "proto/url.h"

/* --- what is carried ------------------------------------------------------------------------ */

static int is_groom(const char *what) { return !strncmp(what, "grm_", 4) && access(what, F_OK); }

static int take_subject(struct groomctl *ctl, const struct arguments *arguments, cJSON *body)
{
    const char *what = arguments->operands[0], *revision = argument(arguments, "revision");
    cJSON *strands = NULL;
    if (is_groom(what)) {
        cJSON_AddStringToObject(body, "groom", what);
        if (argument(arguments, "dense"))
            cJSON_AddBoolToObject(body, "dense", 1);
        if (revision)
            cJSON_AddItemToObject(body, "revision", json_value(revision));
        return DONE;
    }
    if (argument(arguments, "dense") || revision)
        return groomctl_usage_error("retarget", "--dense and --revision are for grooms; %s is none", what);
    int status = submit_input(ctl, arguments, SIZED_HAIR, what, &strands);
    if (status == DONE)
        cJSON_AddStringToObject(body, "strands", api_text(strands, "id"));
    cJSON_Delete(strands);
    return status;
}

/* --- bodies ------------------------------------------------------------------------------------ */

/* A member of a body that stands in a file of JSON. */
static int take_file(const struct arguments *arguments, const char *option, const char *member, cJSON *body)
{
    const char *path = argument(arguments, option);
    if (!path)
        return DONE;
    cJSON *json = read_json_file(path);
    if (!json)
        return REFUSED; /* said already */
    cJSON_AddItemToObject(body, member, json);
    return DONE;
}

static int take_head(struct groomctl *ctl, const struct arguments *arguments, const char *what, cJSON *body)
{
    cJSON *head = NULL;
    int status = what ? submit_input(ctl, arguments, SIZED_HEAD, what, &head) : DONE;
    if (status == DONE && head)
        cJSON_AddStringToObject(body, "head", api_text(head, "id"));
    cJSON_Delete(head);
    return status;
}

/* Landmarks may stand in an object of that name, as the library prints them. */
static void unwrap(cJSON *body, const char *name)
{
    cJSON *inner = cJSON_DetachItemFromObjectCaseSensitive(cJSON_GetObjectItemCaseSensitive(body, name), name);
    if (inner)
        cJSON_ReplaceItemInObjectCaseSensitive(body, name, inner);
}

static int take_parts(const struct arguments *arguments, cJSON *body)
{
    static const char *const parts[] = {"skeleton", "landmarks", "hairline"};
    int status = DONE;
    for (size_t i = 0; status == DONE && i < sizeof parts / sizeof parts[0]; i++)
        status = take_file(arguments, parts[i], parts[i], body);
    unwrap(body, "landmarks");
    return status;
}

static int take_target(struct groomctl *ctl, const struct arguments *arguments, const char *what, cJSON *targets)
{
    cJSON *body = cJSON_CreateObject();
    cJSON_AddItemToArray(targets, body);
    int status = take_head(ctl, arguments, what, body);
    return status == DONE ? take_parts(arguments, body) : status;
}

static int take_bodies(struct groomctl *ctl, const struct arguments *arguments, cJSON *body)
{
    cJSON *source = cJSON_AddObjectToObject(body, "source"), *targets = cJSON_AddArrayToObject(body, "targets");
    int status = take_head(ctl, arguments, argument(arguments, "source"), source);
    if (status == DONE)
        status = take_file(arguments, "source-skeleton", "skeleton", source);
    for (size_t i = 1; status == DONE && i < arguments->n_operands; i++)
        status = take_target(ctl, arguments, arguments->operands[i], targets);
    return status;
}

static int take_options(const struct arguments *arguments, cJSON *body)
{
    static const char *const members[] = {"guides", "iterations", "mode", "seed"};
    cJSON *options = NULL;
    int status = submit_options_file(arguments, &options);
    if (status != DONE) {
        cJSON_Delete(options);
        return status;
    }
    cJSON_AddItemToObject(body, "options", options);
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        const char *value = argument(arguments, members[i]);
        if (!value)
            continue;
        cJSON_DeleteItemFromObjectCaseSensitive(options, members[i]);
        cJSON_AddItemToObject(options, members[i], json_value(value));
    }
    return submit_options_paths("retarget", arguments, options);
}

/* --- what has come of it ---------------------------------------------------------------------------- */

static const cJSON *at(const cJSON *object, const char *first, const char *second)
{
    return cJSON_GetObjectItemCaseSensitive(cJSON_GetObjectItemCaseSensitive(object, first), second);
}

static void print_groom(const cJSON *groom)
{
    const cJSON *report = cJSON_GetObjectItemCaseSensitive(groom, "report");
    const cJSON *before = at(report, "energy", "before"), *after = at(report, "energy", "after");
    const cJSON *inside = at(report, "inside", "before"), *left = at(report, "inside", "after");
    const cJSON *length = cJSON_GetObjectItemCaseSensitive(report, "length_ratio");
    printf("%s on %s\n", api_text(groom, "groom"), api_text(groom, "head"));
    printf("  %-24s %12s %12s\n", "", "transfer", "result");
    printf("  %-24s %12.4g %12.4g\n", "energy", api_number(before, "total", 0), api_number(after, "total", 0));
    printf("  %-24s %12.0f %12.0f\n", "vertices inside", api_number(inside, "vertices", 0), api_number(left, "vertices", 0));
    printf("  %-24s %12.0f %12.0f\n", "segments inside", api_number(inside, "segments", 0), api_number(left, "segments", 0));
    printf("  %-24s %12.2f %12.2f\n", "deepest, mm", 1000 * api_number(inside, "deepest", 0), 1000 * api_number(left, "deepest", 0));
    printf("  %-24s %.3f to %.3f, median %.3f\n", "length over the source's", api_number(length, "min", 0),
           api_number(length, "max", 0), api_number(length, "median", 0));
}

static void print_report(struct groomctl *ctl, const cJSON *job)
{
    const cJSON *groom;
    if (ctl->json) {
        api_print(ctl, job);
        return;
    }
    cJSON_ArrayForEach(groom, cJSON_GetObjectItemCaseSensitive(cJSON_GetObjectItemCaseSensitive(job, "result"), "grooms"))
    {
        print_groom(groom);
    }
}

/* --- the commands --------------------------------------------------------------------------------------- */

static int check_source(const char *command, const struct arguments *arguments)
{
    if (is_groom(arguments->operands[0]) || argument(arguments, "source"))
        return DONE;
    return groomctl_usage_error(command, "--source is missing: the head that %s is on, an id or a file", arguments->operands[0]);
}

static int run(struct groomctl *ctl, const struct arguments *arguments, cJSON *body)
{
    cJSON *job = NULL;
    int status = take_options(arguments, body);
    if (status == DONE)
        status = take_subject(ctl, arguments, body);
    if (status == DONE)
        status = take_bodies(ctl, arguments, body);
    if (status == DONE)
        status = submit_job(ctl, "retarget", arguments, body, &job);
    if (status == DONE)
        status = submit_follow(ctl, arguments, job, print_report);
    cJSON_Delete(job);
    return status;
}

int command_retarget(struct groomctl *ctl, const struct arguments *arguments)
{
    static const char *const of_one[] = {"output", "groom-id-file", "skeleton", "landmarks", "hairline"};
    int status = submit_check_output("retarget", arguments);
    for (size_t i = 0; status == DONE && i < sizeof of_one / sizeof of_one[0]; i++)
        if (arguments->n_operands > 2 && argument(arguments, of_one[i]))
            status = groomctl_usage_error("retarget", "--%s goes with one target; there are %zu", of_one[i],
                                          arguments->n_operands - 1);
    if (status == DONE)
        status = check_source("retarget", arguments);
    if (status != DONE)
        return status;
    cJSON *body = cJSON_CreateObject();
    cJSON_AddStringToObject(body, "kind", "retarget");
    status = run(ctl, arguments, body);
    cJSON_Delete(body);
    return status;
}

/* The line of the first target's body: its head stands in the path. */
static int ask_hairline(struct groomctl *ctl, const struct arguments *arguments, cJSON *body, cJSON **answer)
{
    cJSON *source = cJSON_AddObjectToObject(body, "source"), *target = cJSON_CreateObject();
    struct url url;
    int status = take_head(ctl, arguments, argument(arguments, "source"), source);
    if (status == DONE)
        status = take_head(ctl, arguments, arguments->operands[1], target);
    if (status == DONE) {
        url_init(&url, "/v1/heads");
        url_segment(&url, api_text(target, "head"));
        url_segment(&url, "hairline");
        status = api_json(ctl, "POST", url.text, body, NULL, answer);
    }
    cJSON_Delete(target);
    return status;
}

/* As a target takes it: move its points and hand it to --hairline. Takes the points over. */
static int save_line(const struct groomctl *ctl, cJSON *points, const char *path)
{
    cJSON *line = cJSON_CreateObject();
    cJSON_AddItemToObject(line, "points", points);
    char *text = path ? cJSON_Print(line) : NULL;
    int saved = !path || (text && output_file_save(path, text, strlen(text)));
    if (!path)
        api_print(ctl, line);
    cJSON_free(text);
    cJSON_Delete(line);
    return saved ? DONE : REFUSED;
}

int command_hairline(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *points = argument(arguments, "points");
    cJSON *body = cJSON_CreateObject(), *answer = NULL;
    int status = check_source("hairline", arguments);
    if (points)
        cJSON_AddItemToObject(body, "points", json_value(points));
    if (status == DONE)
        status = take_subject(ctl, arguments, body);
    if (status == DONE)
        status = ask_hairline(ctl, arguments, body, &answer);
    if (status == DONE)
        status = save_line(ctl, cJSON_DetachItemFromObjectCaseSensitive(answer, "front"), argument(arguments, "output"));
    cJSON_Delete(answer);
    cJSON_Delete(body);
    return status;
}
