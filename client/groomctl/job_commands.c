/* status, cancel, losses, deliveries. */
#include <stdio.h>
#include <string.h>

#include "client/groomctl/jobs.h"
#include "proto/url.h"

static void print_status(const struct job_view *view, const cJSON *job)
{
    char text[256], note[64];
    struct progress_line line;
    job_view_line(view, 1, note, &line);
    progress_plain_text(&line, text, sizeof text);
    printf("%s%s", text, view->state == JOB_STATE_RUNNING ? "  running" : "");
    if (api_number(job, "attempt", 0) > 1) printf("  attempt %.0f", api_number(job, "attempt", 0));
    if (view->groom[0]) printf("  %s", view->groom);
    printf("\n");
    if (view->state == JOB_STATE_FAILED) printf("  %s\n", view->problem);
}

int command_status(struct groomctl *ctl, const struct arguments *arguments)
{
    for (size_t i = 0; i < arguments->n_operands; i++) {
        struct job_view view;
        cJSON *job = NULL;
        job_view_init(&view, arguments->operands[i]);
        int status = jobs_look(ctl, &view, &job);
        if (status != DONE) return status;
        if (ctl->json) api_print(ctl, job);
        else print_status(&view, job);
        cJSON_Delete(job);
    }
    return DONE;
}

/* A running job is cancelled when its worker has stopped: wait for that, as long as it takes. */
static int cancel_one(struct groomctl *ctl, const char *id)
{
    struct job_view view;
    struct url url;
    cJSON *job = NULL;
    job_view_init(&view, id);
    url_init(&url, "/v1/jobs");
    url_segment(&url, id);
    int status = api_json(ctl, "DELETE", url.text, NULL, NULL, NULL);
    if (status == DONE) status = api_json(ctl, "GET", url.text, NULL, "Prefer: wait=10", &job);
    if (status != DONE) return status;
    job_view_resource(&view, job);
    if (ctl->json) api_print(ctl, job);
    else printf("%s %s\n", id, job_state_name(view.state));
    cJSON_Delete(job);
    return view.state == JOB_STATE_CANCELLED ? DONE : REFUSED;
}

int command_cancel(struct groomctl *ctl, const struct arguments *arguments)
{
    int worst = DONE;
    for (size_t i = 0; i < arguments->n_operands; i++) {
        int status = cancel_one(ctl, arguments->operands[i]);
        if (status != DONE) worst = status;
    }
    return worst;
}

int command_losses(struct groomctl *ctl, const struct arguments *arguments)
{
    struct url url;
    cJSON *losses = NULL;
    const cJSON *stage, *loss;
    url_init(&url, "/v1/jobs");
    url_segment(&url, arguments->operands[0]);
    url_segment(&url, "losses");
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &losses);
    if (status != DONE) return status;
    if (ctl->json) {
        api_print(ctl, losses);
    } else {
        cJSON_ArrayForEach(stage, losses) {
            cJSON_ArrayForEach(loss, stage) {
                printf("%-18s %8.0f  %-20s %.6g\n", stage->string, api_number(loss, "iteration", 0), api_text(loss, "name"),
                       api_number(loss, "value", 0));
            }
        }
    }
    cJSON_Delete(losses);
    return DONE;
}

int command_deliveries(struct groomctl *ctl, const struct arguments *arguments)
{
    struct url url;
    cJSON *answer = NULL;
    const cJSON *row;
    url_init(&url, "/v1/jobs");
    url_segment(&url, arguments->operands[0]);
    url_segment(&url, "deliveries");
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &answer);
    cJSON_ArrayForEach(row, cJSON_GetObjectItemCaseSensitive(answer, "deliveries")) { api_print(ctl, row); }
    cJSON_Delete(answer);
    return status;
}
