/* The status page: what is queued and what has come of it, without a script and from this host alone. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/embed.h"
#include "proto/json_text.h"
#include "server/http/handlers.h"
#include "server/http/html.h"
#include "server/jobs/jobs.h"

EMBED(status_css, "server/http/status.css");

#define N_SHOWN 24

static void put_groom(FILE *out, const struct store_groom *groom)
{
    char changed[32];
    store_time_text(groom->changed_ms, changed);
    fprintf(out,
            "<figure><a href=\"/v1/grooms/%s/preview.png?size=1024\"><img loading=\"lazy\" width=\"192\" "
            "height=\"192\" alt=\"\" "
            "src=\"/v1/grooms/%s/preview.png?size=192&amp;revision=%u\"></a><figcaption><b>",
            groom->id, groom->id, groom->latest);
    html_escape(out, groom->name && groom->name[0] ? groom->name : groom->id);
    fprintf(out, "</b><br><code>%s</code><br>revision %u, <time>%s</time><br>", groom->id, groom->latest,
            changed);
    static const char *const formats[] = {"hair", "usda", "ply", "obj"};
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++)
        fprintf(out, "<a href=\"/v1/grooms/%s/strands?format=%s\">%s</a> ", groom->id, formats[i],
                formats[i]);
    fprintf(out, "<a href=\"/v1/grooms/%s?arrays=false\">document</a> <a href=\"/grooms/%s/quality\">quality</a>"
                 "</figcaption></figure>\n", groom->id, groom->id);
}

static void put_grooms(FILE *out, struct store *store, const char *project)
{
    struct store_groom_list grooms = {0};
    fputs("<h2>Grooms</h2>\n<div class=\"grooms\">\n", out);
    if (store_grooms_list(store, project, (struct store_page){.limit = N_SHOWN}, &grooms, NULL) != GROOM_OK)
        fputs("<p>The database does not answer.</p>\n", out);
    else if (grooms.n == 0)
        fputs("<p>None yet.</p>\n", out);
    for (size_t i = 0; i < grooms.n; i++)
        put_groom(out, &grooms.items[i]);
    fputs("</div>\n", out);
    store_groom_list_finish(&grooms);
}

static void put_result(FILE *out, const struct store_job *job)
{
    cJSON *result = job->result ? json_text_parse(job->result, strlen(job->result), NULL) : NULL;
    cJSON *error = job->error ? json_text_parse(job->error, strlen(job->error), NULL) : NULL;
    const char *groom = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(result, "groom"));
    const char *detail = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(error, "detail"));
    html_escape(out, groom ? groom : detail ? detail : "");
    cJSON_Delete(result);
    cJSON_Delete(error);
}

static void put_job(FILE *out, const struct store_job *job)
{
    char created[32];
    const char *state = store_job_state_name(job->state);
    store_time_text(job->created_ms, created);
    fprintf(out, "<tr class=\"%s\"><td><a href=\"/v1/jobs/%s\"><code>%s</code></a></td><td>%s</td><td>",
            state, job->id, job->id, state);
    html_escape(out, job->stage ? job->stage : "");
    fprintf(out, "</td><td><progress max=\"1\" value=\"%.3f\"></progress></td><td><time>%s</time></td><td>",
            job->progress, created);
    put_result(out, job);
    fputs("</td></tr>\n", out);
}

static void put_jobs(FILE *out, struct jobs *jobs, const char *project)
{
    struct store_job_list list = {0};
    fputs("<h2>Jobs</h2>\n<table><tr><th>job</th><th>state</th><th>stage</th><th>progress</th><th>created</"
          "th><th>result</th></tr>\n",
          out);
    if (jobs_list(jobs, project, NULL, (struct store_page){.limit = N_SHOWN}, &list, NULL) != GROOM_OK)
        fputs("<tr><td colspan=\"6\">The database does not answer.</td></tr>\n", out);
    for (size_t i = 0; i < list.n; i++)
        put_job(out, &list.items[i]);
    fputs("</table>\n", out);
    store_job_list_finish(&list);
}

void page_index(struct request *request)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) {
        respond_failure(request, GROOM_ENOMEM, NULL);
        return;
    }
    fputs("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" "
          "content=\"5\">"
          "<meta name=\"viewport\" content=\"width=device-width\"><title>groomd</title>"
          "<link rel=\"stylesheet\" href=\"/status.css\"></head>\n<body><h1>groomd</h1>\n<p>Dense hair "
          "strands in, procedural grooms out. "
          "<a href=\"/openapi.json\">API</a> <a href=\"/v1/options\">options</a> <a "
          "href=\"/metrics\">metrics</a></p>\n",
          out);
    if (request->scopes & ACCESS_READ) {
        put_grooms(out, request->service->store, request->actor.project);
        put_jobs(out, request->service->jobs, request->actor.project);
    } else {
        fputs("<p>This service asks for a token, which its keeper makes with <code>groomd token create</code>. A "
              "browser trades it for a session with <code>POST /v1/session</code>.</p>\n",
              out);
    }
    fputs("</body></html>\n", out);
    html_respond(request, out, &text, &size);
}

void page_style(struct request *request)
{
    respond_static(request, 200, "text/css; charset=utf-8", status_css, status_css_size);
}
