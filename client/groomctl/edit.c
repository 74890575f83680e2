/* set, patch, set-guides, revisions, revert, import: grooms and their history. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "client/groomctl/api.h"
#include "client/groomctl/json_path.h"
#include "client/groomctl/read_file.h"
#include "proto/url.h"

static void groom_url(struct url *url, const char *groom, const char *part)
{
    url_init(url, "/v1/grooms");
    url_segment(url, groom);
    if (part)
        url_segment(url, part);
}

/* --if-match N, or the latest revision as it is now. */
static int if_match(struct groomctl *ctl, const struct arguments *arguments, char *header, size_t size)
{
    const char *revision = argument(arguments, "if-match");
    if (!revision)
        return api_if_match(ctl, arguments->operands[0], header, size);
    snprintf(header, size, "If-Match: \"%.40s\"", revision);
    return DONE;
}

static void print_edit(const struct groomctl *ctl, const cJSON *answer)
{
    if (ctl->json)
        api_print(ctl, answer);
    else
        printf("%s revision %.0f\n", api_text(answer, "groom"), api_number(answer, "revision", 0));
}

/* A body of some media type under If-Match. */
static int edit_at(struct groomctl *ctl, const struct arguments *arguments, const char *method, const struct url *url,
                   const char *media_type, const char *body, size_t n_body)
{
    char header[128];
    struct http_response response;
    int status = if_match(ctl, arguments, header, sizeof header);
    if (status != DONE)
        return status;
    struct http_request request = {.method = method,
                                   .path = url->text,
                                   .headers = {header},
                                   .content_type = media_type,
                                   .body = body,
                                   .n_body = n_body};
    status = api_call(ctl, &request, &response);
    cJSON *answer = status == DONE ? cJSON_ParseWithLength(response.body, response.n_body) : NULL;
    if (answer)
        print_edit(ctl, answer);
    cJSON_Delete(answer);
    http_response_finish(&response);
    return status;
}

static int edit(struct groomctl *ctl, const struct arguments *arguments, const char *method, const char *part,
                const char *media_type, const char *body, size_t n_body)
{
    struct url url;
    groom_url(&url, arguments->operands[0], part);
    return edit_at(ctl, arguments, method, &url, media_type, body, n_body);
}

/* --- set and patch -------------------------------------------------------------------------- */

/* "/operators/2/radius=0.01" as an operation of a JSON Patch; "=" with nothing behind it removes. */
static cJSON *operation_of(const char *assignment)
{
    const char *equals = strchr(assignment, '=');
    char pointer[256];
    if (assignment[0] != '/' || !equals || (size_t)(equals - assignment) >= sizeof pointer)
        return NULL;
    snprintf(pointer, sizeof pointer, "%.*s", (int)(equals - assignment), assignment);
    cJSON *operation = cJSON_CreateObject();
    cJSON_AddStringToObject(operation, "op", equals[1] ? "add" : "remove");
    cJSON_AddStringToObject(operation, "path", pointer);
    if (equals[1])
        cJSON_AddItemToObject(operation, "value", json_value(equals + 1));
    return operation;
}

int command_set(struct groomctl *ctl, const struct arguments *arguments)
{
    cJSON *patch = cJSON_CreateArray();
    int status = DONE;
    for (size_t i = 1; i < arguments->n_operands && status == DONE; i++) {
        cJSON *operation = operation_of(arguments->operands[i]);
        if (operation)
            cJSON_AddItemToArray(patch, operation);
        else
            status = groomctl_usage_error("set", "\"%s\" is not /pointer=value (/operators/2/radius=0.01)",
                                          arguments->operands[i]);
    }
    char *text = status == DONE ? cJSON_PrintUnformatted(patch) : NULL;
    if (text)
        status = edit(ctl, arguments, "PATCH", NULL, "application/json-patch+json", text, strlen(text));
    free(text);
    cJSON_Delete(patch);
    return status;
}

int command_patch(struct groomctl *ctl, const struct arguments *arguments)
{
    cJSON *patch = read_json_file(arguments->operands[1]);
    char *text = patch ? cJSON_PrintUnformatted(patch) : NULL;
    const char *type = cJSON_IsArray(patch) ? "application/json-patch+json" : "application/merge-patch+json";
    int status = text ? edit(ctl, arguments, "PATCH", NULL, type, text, strlen(text)) : REFUSED;
    free(text);
    cJSON_Delete(patch);
    return status;
}

int command_set_guides(struct groomctl *ctl, const struct arguments *arguments)
{
    struct url url;
    size_t n = 0;
    char *file = read_whole_file(arguments->operands[1], &n);
    groom_url(&url, arguments->operands[0], "guides");
    url_query(&url, "format", argument(arguments, "format"));
    url_query(&url, "unit", argument(arguments, "unit"));
    url_query(&url, "up", argument(arguments, "up"));
    int status = file ? edit_at(ctl, arguments, "PUT", &url, "application/octet-stream", file, n) : REFUSED;
    free(file);
    return status;
}

/* --- history ---------------------------------------------------------------------------------- */

int command_revisions(struct groomctl *ctl, const struct arguments *arguments)
{
    struct url url;
    cJSON *page = NULL;
    const cJSON *row;
    groom_url(&url, arguments->operands[0], "revisions");
    url_query(&url, "limit", argument(arguments, "limit"));
    url_query(&url, "before", argument(arguments, "before"));
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &page);
    if (status != DONE)
        return status;
    cJSON_ArrayForEach(row, cJSON_GetObjectItemCaseSensitive(page, "revisions"))
    {
        if (ctl->json)
            api_print(ctl, row);
        else
            printf("%4.0f  %s  %-10s  %s\n", api_number(row, "revision", 0), api_text(row, "created_at"),
                   api_text(row, "note"), api_text(row, "name"));
    }
    if (!ctl->json && api_number(page, "next", 0) > 0)
        fprintf(stderr, "there is more: groomctl revisions %s --before %.0f\n", arguments->operands[0], api_number(page, "next", 0));
    cJSON_Delete(page);
    return DONE;
}

int command_revert(struct groomctl *ctl, const struct arguments *arguments)
{
    char body[64], *end;
    unsigned long revision = strtoul(arguments->operands[1], &end, 10);
    if (*end || !revision)
        return groomctl_usage_error("revert", "\"%s\" is not the number of a revision",
                                    arguments->operands[1]);
    snprintf(body, sizeof body, "{\"revision\":%lu}", revision);
    return edit(ctl, arguments, "POST", "revert", "application/json", body, strlen(body));
}

int command_import(struct groomctl *ctl, const struct arguments *arguments)
{
    size_t n = 0;
    char *text = read_whole_file(arguments->operands[0], &n);
    struct http_request request = {.method = "POST",
                                   .path = "/v1/grooms",
                                   .content_type = "application/json",
                                   .body = text,
                                   .n_body = n};
    struct http_response response = {0};
    int status = text ? api_call(ctl, &request, &response) : REFUSED;
    cJSON *answer = status == DONE ? cJSON_ParseWithLength(response.body, response.n_body) : NULL;
    if (answer && ctl->json)
        api_print(ctl, answer);
    else if (answer)
        printf("%s\n", api_text(answer, "groom")[0] ? api_text(answer, "groom") : api_text(answer, "id"));
    cJSON_Delete(answer);
    http_response_finish(&response);
    free(text);
    return status;
}
