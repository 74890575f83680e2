/* Jobs as the contract names them. */
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "groom/document.h"
#include "server/jobs/queue.h"

static void add_time(cJSON *object, const char *name, int64_t time_ms)
{
    char text[32];
    if (time_ms == 0) {
        cJSON_AddNullToObject(object, name);
        return;
    }
    store_time_text(time_ms, text);
    cJSON_AddStringToObject(object, name, text);
}

/* JSON that the store keeps as text; null where there is none. */
static void add_text(cJSON *object, const char *name, const char *text)
{
    cJSON *item = text ? cJSON_Parse(text) : NULL;
    cJSON_AddItemToObject(object, name, item ? item : cJSON_CreateNull());
}

/* An edit's options are its body, whose arrays may be megabytes: what they are is told, not what is in them. */
static void add_options(cJSON *object, const char *options)
{
    char *text = NULL;
    size_t n_bytes;
    if (strstr(options, "\"dtype\"") && groom_document_outline(options, strlen(options), &text, &n_bytes, NULL) == GROOM_OK)
        add_text(object, "options", text);
    else
        add_text(object, "options", options);
    free(text);
}

/* The ids that the job was made with stand beside its own: "strands", "head". */
static void add_inputs(cJSON *object, const char *request)
{
    cJSON *inputs = cJSON_Parse(request);
    while (inputs && inputs->child) {
        cJSON *input = cJSON_DetachItemViaPointer(inputs, inputs->child);
        if (cJSON_GetObjectItemCaseSensitive(object, input->string))
            cJSON_Delete(input);
        else
            cJSON_AddItemToObject(object, input->string, input);
    }
    cJSON_Delete(inputs);
}

static void add_stage(cJSON *object, const struct store_job *job)
{
    if (!job->stage[0]) {
        cJSON_AddNullToObject(object, "stage");
        return;
    }
    cJSON *stage = cJSON_AddObjectToObject(object, "stage");
    cJSON_AddStringToObject(stage, "name", job->stage);
    cJSON_AddNumberToObject(stage, "index", job->stage_index);
    cJSON_AddNumberToObject(stage, "count", job->stage_count);
}

static void add_number_or_null(cJSON *object, const char *name, double value)
{
    if (value < 0)
        cJSON_AddNullToObject(object, name);
    else
        cJSON_AddNumberToObject(object, name, value);
}

cJSON *jobs_json(const struct store_job *job)
{
    cJSON *object = cJSON_CreateObject();
    if (!object)
        return NULL;
    cJSON_AddStringToObject(object, "id", job->id);
    cJSON_AddStringToObject(object, "kind", job->kind);
    cJSON_AddStringToObject(object, "state", store_job_state_name(job->state));
    add_number_or_null(object, "queue_position", (double)job->queue_position);
    add_stage(object, job);
    cJSON_AddNumberToObject(object, "progress", job->progress);
    add_number_or_null(object, "eta_s", job->eta_s);
    cJSON_AddNumberToObject(object, "attempt", job->attempt);
    cJSON_AddBoolToObject(object, "cancel_requested", job->cancel_requested);
    add_text(object, "loss", job->loss);
    add_options(object, job->options);
    add_text(object, "result", job->result);
    add_text(object, "error", job->error);
    add_time(object, "created_at", job->created_ms);
    add_time(object, "started_at", job->started_ms);
    add_time(object, "finished_at", job->finished_ms);
    add_inputs(object, job->request);
    return object;
}

static void add_loss(cJSON *stages, const struct store_loss_row *loss)
{
    cJSON *curve = cJSON_GetObjectItemCaseSensitive(stages, loss->stage);
    if (!curve)
        curve = cJSON_AddArrayToObject(stages, loss->stage);
    cJSON *point = cJSON_CreateObject();
    cJSON_AddNumberToObject(point, "iteration", (double)loss->iteration);
    cJSON_AddStringToObject(point, "name", loss->name);
    cJSON_AddNumberToObject(point, "value", loss->value);
    cJSON_AddItemToArray(curve, point);
}

groom_status jobs_losses_json(struct jobs *jobs, const char *id, char **text, struct groom_diag *diag)
{
    struct store_loss_list losses = {0};
    groom_status status = store_losses_list(jobs->store, id, &losses, diag);
    if (status != GROOM_OK)
        return status;
    cJSON *stages = cJSON_CreateObject();
    for (size_t i = 0; stages && i < losses.n; i++)
        add_loss(stages, &losses.items[i]);
    char *printed = stages ? cJSON_PrintUnformatted(stages) : NULL;
    cJSON_Delete(stages);
    store_loss_list_finish(&losses);
    if (!printed)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the loss curves");
    *text = printed;
    return GROOM_OK;
}
