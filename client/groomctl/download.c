/* export, and what else ends in a file. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "client/groomctl/output_file.h"
#include "client/groomctl/transfer.h"
#include "groom/format.h"
#include "proto/url.h"

static size_t take(void *user, const char *bytes, size_t n)
{
    return output_file_write(user, bytes, n) ? n : 0;
}

static void begin(void *user) { output_file_restart(user); }

int download_file(struct groomctl *ctl, const char *url_path, const char *path)
{
    struct output_file file;
    struct http_response response;
    if (!output_file_open(&file, path))
        return REFUSED;
    struct http_request request = {.method = "GET",
                                   .path = url_path,
                                   .sink = take,
                                   .begin = begin,
                                   .user = &file,
                                   .idle_timeout_s = 300};
    http_outcome outcome = http_perform(ctl->client, &request, &response);
    int status = outcome == HTTP_ANSWERED && response.status == 200 ? DONE : REFUSED;
    if (file.failure[0])
        fprintf(stderr, "groomctl: %s cannot be written: %s\n", path, file.failure);
    else if (status != DONE)
        status = api_complain(ctl, outcome, &response);
    http_response_finish(&response);
    if (status == DONE)
        return output_file_commit(&file) ? DONE : REFUSED;
    output_file_abort(&file);
    return status;
}

const char *format_of_path(const char *path)
{
    const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
    if (!dot || (slash && slash > dot))
        return NULL;
    if (!strcasecmp(dot + 1, "usd"))
        return "usda";
    for (int f = GROOM_FORMAT_AUTO + 1; f < GROOM_FORMAT_COUNT; f++)
        if (groom_format_writable((groom_format)f) &&
            !strcasecmp(dot + 1, groom_format_extension((groom_format)f)))
            return groom_format_name((groom_format)f);
    return NULL;
}

int download_said(const struct groomctl *ctl, const char *path, int status)
{
    if (status != DONE || !strcmp(path, "-"))
        return status;
    if (ctl->json) {
        cJSON *object = cJSON_CreateObject();
        cJSON_AddStringToObject(object, "file", path);
        api_print(ctl, object);
        cJSON_Delete(object);
    } else {
        printf("%s\n", path);
    }
    return DONE;
}

int command_export(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *id = arguments->operands[0], *path = argument(arguments, "output"),
               *format = argument(arguments, "format");
    int is_groom = strncmp(id, "str_", 4) != 0;
    struct url url;
    if (!path)
        return groomctl_usage_error("export", "-o FILE is needed (\"-\" for standard output)");
    if (!format)
        format = format_of_path(path);
    if (!format)
        return groomctl_usage_error("export", "--format is needed: %s has no extension that names one", path);
    url_init(&url, is_groom ? "/v1/grooms" : "/v1/strands");
    url_segment(&url, id);
    url_segment(&url, !is_groom ? "data" : argument(arguments, "guides") ? "guides" : "strands");
    url_query(&url, "format", format);
    url_query(&url, "unit", argument(arguments, "unit"));
    url_query(&url, "up", argument(arguments, "up"));
    url_query(&url, "count", argument(arguments, "count"));
    url_query(&url, "revision", argument(arguments, "revision"));
    return download_said(ctl, path, download_file(ctl, url.text, path));
}
