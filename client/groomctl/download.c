/* export, and what else ends in a file. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "client/groomctl/output_file.h"
#include "client/groomctl/sending.h"
#include "client/groomctl/transfer.h"
#include "groom/format.h"
#include "proto/url.h"

struct downloading {
    struct output_file file;
    struct http_response response;
    struct sending bar;
    int draws;
};

static size_t take(void *user, const char *bytes, size_t n)
{
    struct downloading *d = user;
    if (!output_file_write(&d->file, bytes, n))
        return 0;
    if (d->draws && d->response.content_length > 0) {
        d->bar.n_total = (uint64_t)d->response.content_length;
        sending_draw(&d->bar, d->file.n_bytes, d->bar.n_total);
    }
    return n;
}

static void begin(void *user) { output_file_restart(&((struct downloading *)user)->file); }

static int complain(struct groomctl *ctl, const struct downloading *d, http_outcome outcome)
{
    if (d->file.failure[0]) {
        fprintf(stderr, "groomctl: %s cannot be written: %s\n", d->file.path, d->file.failure);
        return REFUSED;
    }
    if (outcome == HTTP_INTERRUPTED)
        fprintf(stderr, "groomctl: interrupted; %s\n", d->file.is_stdout ? "what was printed is not all of it" : "no file was written");
    return api_complain(ctl, outcome, &d->response);
}

int download_file(struct groomctl *ctl, const char *url_path, const char *path)
{
    struct downloading d = {.draws = ctl->is_terminal && !ctl->json};
    if (!output_file_open(&d.file, path))
        return REFUSED;
    sending_init(&d.bar, path, 0, 0);
    d.draws = d.draws && !d.file.is_stdout;
    struct http_request request = {.method = "GET",
                                   .path = url_path,
                                   .sink = take,
                                   .begin = begin,
                                   .user = &d,
                                   .idle_timeout_s = 300};
    http_outcome outcome = http_perform(ctl->client, &request, &d.response);
    sending_clear(&d.bar);
    int status = outcome == HTTP_ANSWERED && d.response.status == 200 && !d.file.failure[0] ? DONE : complain(ctl, &d, outcome);
    http_response_finish(&d.response);
    if (status == DONE)
        return output_file_commit(&d.file) ? DONE : REFUSED;
    output_file_abort(&d.file);
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

/* The file of an upload as it came. */
static int export_head(struct groomctl *ctl, const char *id, const char *path)
{
    struct url url;
    url_init(&url, "/v1/heads");
    url_segment(&url, id);
    url_segment(&url, "data");
    return download_said(ctl, path, download_file(ctl, url.text, path));
}

int command_export(struct groomctl *ctl, const struct arguments *arguments)
{
    static const char *const passed_on[] = {"unit", "up", "count", "vertices", "revision"};
    const char *id = arguments->operands[0], *path = argument(arguments, "output"),
               *format = argument(arguments, "format");
    int is_groom = strncmp(id, "str_", 4) != 0;
    struct url url;
    if (!path)
        return groomctl_usage_error("export", "-o FILE is needed (\"-\" for standard output)");
    if (!strncmp(id, "head_", 5))
        return export_head(ctl, id, path);
    if (!format)
        format = format_of_path(path);
    if (!format)
        return groomctl_usage_error("export", "--format is needed: %s has no extension that names one", path);
    url_init(&url, is_groom ? "/v1/grooms" : "/v1/strands");
    url_segment(&url, id);
    url_segment(&url, !is_groom ? "data" : argument(arguments, "guides") ? "guides" : "strands");
    url_query(&url, "format", format);
    for (size_t i = 0; i < sizeof passed_on / sizeof passed_on[0]; i++)
        url_query(&url, passed_on[i], argument(arguments, passed_on[i]));
    return download_said(ctl, path, download_file(ctl, url.text, path));
}
