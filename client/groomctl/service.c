/* whoami, audit, metrics and openapi: about the service and who uses it. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "client/groomctl/transfer.h"
#include "proto/url.h"

static int print_answer(struct groomctl *ctl, const char *path)
{
    cJSON *answer = NULL;
    int status = api_json(ctl, "GET", path, NULL, NULL, &answer);
    if (status == DONE)
        api_print(ctl, answer);
    cJSON_Delete(answer);
    return status;
}

int command_whoami(struct groomctl *ctl, const struct arguments *arguments)
{
    (void)arguments;
    return print_answer(ctl, "/v1/session");
}

static int save_or_print(struct groomctl *ctl, const char *path, const char *file)
{
    int status = download_file(ctl, path, file ? file : "-");
    return file ? download_said(ctl, file, status) : status;
}

/* Already lines of text: with --json, too. */
int command_metrics(struct groomctl *ctl, const struct arguments *arguments)
{
    return save_or_print(ctl, "/metrics", argument(arguments, "output"));
}

int command_openapi(struct groomctl *ctl, const struct arguments *arguments)
{
    return save_or_print(ctl, "/openapi.json", argument(arguments, "output"));
}

/* --- audit ------------------------------------------------------------------------------------ */

static void print_audit(const struct groomctl *ctl, const cJSON *row)
{
    const cJSON *who = cJSON_GetObjectItemCaseSensitive(row, "who");
    if (ctl->json)
        api_print(ctl, row);
    else
        printf("%s  %-14s  %-14s  %-24s  %s\n", api_text(row, "at"), api_text(who, "name")[0] ? api_text(who, "name") : "-",
               api_text(row, "action"), api_text(row, "subject"), api_text(row, "detail"));
}

int command_audit(struct groomctl *ctl, const struct arguments *arguments)
{
    struct url url;
    cJSON *page = NULL;
    const cJSON *row;
    url_init(&url, "/v1/audit");
    url_query(&url, "limit", argument(arguments, "limit"));
    url_query(&url, "before", argument(arguments, "before"));
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &page);
    cJSON_ArrayForEach(row, cJSON_GetObjectItemCaseSensitive(page, "audit")) { print_audit(ctl, row); }
    if (!ctl->json && api_number(page, "next", 0) > 0)
        fprintf(stderr, "there is more: groomctl audit --before %.0f\n", api_number(page, "next", 0));
    cJSON_Delete(page);
    return status;
}
