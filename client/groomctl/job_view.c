#include <math.h>
#include <stdio.h>
#include <string.h>

#include "client/groomctl/jobs.h"

void job_view_init(struct job_view *view, const char *id)
{
    memset(view, 0, sizeof *view);
    snprintf(view->id, sizeof view->id, "%s", id);
    view->state = JOB_STATE_QUEUED;
    view->eta_s = -1;
    view->queue_position = -1;
}

static void take_stage(struct job_view *view, const cJSON *stage)
{
    if (!cJSON_IsObject(stage))
        return;
    snprintf(view->stage, sizeof view->stage, "%.31s", api_text(stage, "name"));
    view->stage_index = (unsigned)api_number(stage, "index", 0);
    view->stage_count = (unsigned)api_number(stage, "count", 0);
}

static void take_error(struct job_view *view, const cJSON *error)
{
    const char *title = api_text(error, "title"), *detail = api_text(error, "detail");
    if (!cJSON_IsObject(error))
        return;
    snprintf(view->problem, sizeof view->problem, "%.120s%s%.380s", title, title[0] && detail[0] ? ": " : "",
             detail);
}

static void take_progress(struct job_view *view, const cJSON *object)
{
    view->progress = api_number(object, "progress", view->progress);
    view->eta_s = api_number(object, "eta_s", -1);
}

static void take_end(struct job_view *view, const cJSON *object)
{
    job_state state = job_state_parse(api_text(object, "state"));
    const char *groom = api_text(cJSON_GetObjectItemCaseSensitive(object, "result"), "groom");
    if (state != JOB_STATE_COUNT)
        view->state = state;
    if (groom[0])
        snprintf(view->groom, sizeof view->groom, "%.63s", groom);
    take_error(view, cJSON_GetObjectItemCaseSensitive(object, "error"));
}

/* {"total": 0.1} of a resource: the first one is shown. */
static void take_losses(struct job_view *view, const cJSON *losses)
{
    const cJSON *first = cJSON_IsObject(losses) ? losses->child : NULL;
    if (!cJSON_IsNumber(first))
        return;
    snprintf(view->loss_name, sizeof view->loss_name, "%.31s", first->string);
    view->loss = first->valuedouble;
    view->has_loss = 1;
}

void job_view_resource(struct job_view *view, const cJSON *job)
{
    take_end(view, job);
    take_stage(view, cJSON_GetObjectItemCaseSensitive(job, "stage"));
    take_progress(view, job);
    take_losses(view, cJSON_GetObjectItemCaseSensitive(job, "loss"));
    view->queue_position = (int)api_number(job, "queue_position", -1);
}

/* Of the curves that a loss event brings the first one's latest value is shown. */
static void take_loss(struct job_view *view, const cJSON *data)
{
    const cJSON *losses = cJSON_GetObjectItemCaseSensitive(data, "losses"), *loss;
    const char *name = api_text(cJSON_GetArrayItem(losses, 0), "name");
    if (!name[0])
        return;
    snprintf(view->loss_name, sizeof view->loss_name, "%.31s", name);
    view->has_loss = 1;
    cJSON_ArrayForEach(loss, losses)
    {
        if (!strcmp(api_text(loss, "name"), name))
            view->loss = api_number(loss, "value", view->loss);
    }
}

int job_view_event(struct job_view *view, const char *event, const cJSON *data)
{
    struct job_view before = *view;
    if (!strcmp(event, JOB_EVENT_LOSS)) {
        take_loss(view, data);
        return 0;
    }
    if (!strcmp(event, JOB_EVENT_STAGE))
        take_stage(view, data);
    if (!strcmp(event, JOB_EVENT_STATE))
        take_end(view, data);
    if (!strcmp(event, JOB_EVENT_PROGRESS)) {
        take_stage(view, cJSON_GetObjectItemCaseSensitive(data, "stage"));
        take_progress(view, data);
    }
    return before.state != view->state || strcmp(before.stage, view->stage) ||
           floor(10 * before.progress) < floor(10 * view->progress);
}

static const char *note_of(const struct job_view *view, char note[64])
{
    if (view->state == JOB_STATE_RUNNING)
        return view->stage[0] ? NULL : "starting";
    if (view->state == JOB_STATE_QUEUED && view->queue_position > 0) {
        snprintf(note, 64, "queued, %d before it", view->queue_position);
        return note;
    }
    return job_state_name(view->state);
}

void job_view_line(const struct job_view *view, int with_id, char note[64], struct progress_line *line)
{
    int ended = job_state_is_end(view->state);
    *line = (struct progress_line){
        .label = with_id ? view->id : NULL,
        .stage = view->stage[0] && !ended ? view->stage : NULL,
        .stage_index = view->stage_index,
        .stage_count = view->stage_count,
        .fraction = view->state == JOB_STATE_SUCCEEDED ? 1 : view->progress,
        .loss_name = view->has_loss ? view->loss_name : NULL,
        .loss = view->loss,
        .eta_s = view->state == JOB_STATE_RUNNING && view->progress < 1 ? view->eta_s : -1,
        .note = note_of(view, note)};
}

void job_view_print_end(const struct job_view *view)
{
    if (view->state == JOB_STATE_SUCCEEDED) {
        printf("%s succeeded: %s\n", view->id, view->groom);
        fflush(stdout);
    } else if (view->state == JOB_STATE_FAILED) {
        fprintf(stderr, "groomctl: %s failed: %s\n", view->id,
                view->problem[0] ? view->problem : "no reason was given");
    } else {
        fprintf(stderr, "groomctl: %s was cancelled\n", view->id);
    }
}
