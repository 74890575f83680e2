/* retarget: carry strands or a groom from the head that they are on to others. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "client/groomctl/json_path.h"
#include "client/groomctl/read_file.h"
#include "client/groomctl/submit.h"

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

static int take_target(struct groomctl *ctl, const struct arguments *arguments, const char *what, cJSON *targets)
{
    cJSON *body = cJSON_CreateObject();
    cJSON_AddItemToArray(targets, body);
    int status = take_head(ctl, arguments, what, body);
    return status == DONE ? take_file(arguments, "skeleton", "skeleton", body) : status;
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

/* --- the command ---------------------------------------------------------------------------------------- */

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
    const char *one = argument(arguments, "output") ? "output" : argument(arguments, "groom-id-file") ? "groom-id-file"
                    : argument(arguments, "skeleton")                                                 ? "skeleton"
                                                                                                      : NULL;
    int status = submit_check_output("retarget", arguments);
    if (status != DONE)
        return status;
    if (arguments->n_operands > 2 && one)
        return groomctl_usage_error("retarget", "--%s goes with one target; there are %zu", one, arguments->n_operands - 1);
    if (!is_groom(arguments->operands[0]) && !argument(arguments, "source"))
        return groomctl_usage_error("retarget", "--source is missing: the head that %s is on, an id or a file",
                                    arguments->operands[0]);
    cJSON *body = cJSON_CreateObject();
    cJSON_AddStringToObject(body, "kind", "retarget");
    status = run(ctl, arguments, body);
    cJSON_Delete(body);
    return status;
}
