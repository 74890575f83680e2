#include "client/groomctl/submit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "client/groomctl/jobs.h"
#include "client/groomctl/json_path.h"
#include "client/groomctl/output_file.h"
#include "client/groomctl/read_file.h"
#include "client/groomctl/transfer.h"
#include "proto/url.h"

int submit_check_output(const char *command, const struct arguments *arguments)
{
    const char *path = argument(arguments, "output");
    if (path && !argument(arguments, "output-format") && !format_of_path(path))
        return groomctl_usage_error(command, "%s has no extension that names a format; add --output-format F", path);
    return !path || output_file_check(path) ? DONE : REFUSED;
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

int submit_input(struct groomctl *ctl, const struct arguments *arguments, enum sized_thing thing, const char *what,
                 cJSON **answer)
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

void submit_hint_where_apart(const cJSON *strands, const cJSON *head)
{
    struct sized_box hair_box, head_box;
    char text[256];
    if (!upload_box(strands, &hair_box) || !upload_box(head, &head_box))
        return;
    apart_hint_text(&hair_box, &head_box, text, sizeof text);
    if (text[0])
        fprintf(stderr, "hint: %s\n", text);
}

/* --- options ----------------------------------------------------------------------------------- */

int submit_options_file(const struct arguments *arguments, cJSON **options)
{
    const char *path = argument(arguments, "options");
    *options = path ? read_json_file(path) : cJSON_CreateObject();
    if (cJSON_IsObject(*options))
        return DONE;
    if (*options)
        fprintf(stderr, "groomctl: %s does not hold a JSON object\n", path);
    return REFUSED;
}

int submit_options_paths(const char *command, const struct arguments *arguments, cJSON *options)
{
    const char *value;
    for (size_t i = 0; (value = argument_nth(arguments, "option", i)); i++)
        if (!json_set_path(options, value))
            return groomctl_usage_error(command, "--option %s is not path=value (see: groomctl options)", value);
    return DONE;
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
static int add_webhook(const char *command, const struct arguments *arguments, cJSON *body)
{
    const char *url = argument(arguments, "webhook"), *secret = argument(arguments, "webhook-secret");
    if (!url && !secret)
        return 1;
    if (!url || !secret) {
        groomctl_usage_error(command, "--webhook and --webhook-secret go together");
        return 0;
    }
    cJSON *webhook = cJSON_AddObjectToObject(body, "webhook");
    cJSON_AddStringToObject(webhook, "url", url);
    cJSON_AddStringToObject(webhook, "secret", secret);
    return 1;
}

int submit_job(struct groomctl *ctl, const char *command, const struct arguments *arguments, cJSON *body, cJSON **job)
{
    char header[96];
    const char *priority = argument(arguments, "priority");
    if (!add_webhook(command, arguments, body))
        return WRONG_USAGE;
    if (priority)
        cJSON_AddItemToObject(body, "priority", json_value(priority));
    idempotency_header(header, sizeof header);
    return api_json(ctl, "POST", "/v1/jobs", body, header, job);
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

static int follow(struct groomctl *ctl, const struct arguments *arguments, const char *job,
                  void (*ended)(struct groomctl *ctl, const cJSON *job))
{
    const char *path = argument(arguments, "output");
    struct job_view view;
    cJSON *resource = NULL;
    job_view_init(&view, job);
    int status = jobs_watch_all(ctl, &view, 1);
    if (status == DONE && ended && (status = jobs_look(ctl, &view, &resource)) == DONE)
        ended(ctl, resource);
    cJSON_Delete(resource);
    if (status == DONE && argument(arguments, "groom-id-file"))
        status = write_id(view.groom, argument(arguments, "groom-id-file"));
    return status == DONE && path ? export_result(ctl, arguments, view.groom, path) : status;
}

int submit_follow(struct groomctl *ctl, const struct arguments *arguments, const cJSON *job,
                  void (*ended)(struct groomctl *ctl, const cJSON *job))
{
    int waits = argument(arguments, "wait") || argument(arguments, "output") || argument(arguments, "groom-id-file");
    if (ctl->json)
        api_print(ctl, job);
    else
        printf("%s\n", api_text(job, "id"));
    fflush(stdout);
    if (waits)
        return follow(ctl, arguments, api_text(job, "id"), ended);
    if (!ctl->json)
        fprintf(stderr, "watch it: groomctl watch %s\n", api_text(job, "id"));
    return DONE;
}
