/* An attempt's progress message: checked, then written with its events in one transaction. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "proto/json_text.h"
#include "server/jobs/queue.h"
#include "server/jobs/work.h"

#define MAX_LOSSES 10000
#define MAX_NAME 64

/* --- checking ------------------------------------------------------------------------- */

static bool is_name(const cJSON *item)
{
    return cJSON_IsString(item) && item->valuestring[0] && strlen(item->valuestring) <= MAX_NAME;
}

static bool is_number(const cJSON *item, double minimum, double maximum)
{
    return cJSON_IsNumber(item) && item->valuedouble >= minimum && item->valuedouble <= maximum;
}

static groom_status check_stage(const cJSON *stage, struct groom_diag *diag)
{
    if (!is_name(cJSON_GetObjectItemCaseSensitive(stage, "name")))
        return groom_fail_field(diag, GROOM_EINVAL, "/stage/name", "a stage has a name of 1 to %d bytes", MAX_NAME);
    if (!is_number(cJSON_GetObjectItemCaseSensitive(stage, "index"), 0, 1000))
        return groom_fail_field(diag, GROOM_EINVAL, "/stage/index", "a stage has an index from 0");
    if (!is_number(cJSON_GetObjectItemCaseSensitive(stage, "count"), 1, 1000))
        return groom_fail_field(diag, GROOM_EINVAL, "/stage/count", "a stage says how many there are");
    return GROOM_OK;
}

static groom_status check_losses(const cJSON *losses, struct groom_diag *diag)
{
    const cJSON *loss;
    int n = 0;
    if (!cJSON_IsArray(losses))
        return groom_fail_field(diag, GROOM_EINVAL, "/losses", "losses are an array");
    cJSON_ArrayForEach(loss, losses)
    {
        const cJSON *stage = cJSON_GetObjectItemCaseSensitive(loss, "stage");
        const cJSON *value = cJSON_GetObjectItemCaseSensitive(loss, "value");
        if (n++ == MAX_LOSSES)
            return groom_fail_field(diag, GROOM_EINVAL, "/losses", "at most %d losses at a time", MAX_LOSSES);
        if (!is_name(cJSON_GetObjectItemCaseSensitive(loss, "name")) ||
            !is_number(cJSON_GetObjectItemCaseSensitive(loss, "iteration"), 0, 1e15) || !cJSON_IsNumber(value) ||
            !isfinite(value->valuedouble) || (stage && !is_name(stage)))
            return groom_fail_field(diag, GROOM_EINVAL, "/losses",
                                    "a loss has an iteration from 0, a name and a finite value");
    }
    return GROOM_OK;
}

static groom_status check_message(const cJSON *message, struct groom_diag *diag)
{
    const cJSON *stage = cJSON_GetObjectItemCaseSensitive(message, "stage");
    const cJSON *progress = cJSON_GetObjectItemCaseSensitive(message, "progress");
    const cJSON *eta = cJSON_GetObjectItemCaseSensitive(message, "eta_s");
    const cJSON *losses = cJSON_GetObjectItemCaseSensitive(message, "losses");
    groom_status status;
    if (!cJSON_IsObject(message))
        return groom_fail(diag, GROOM_EINVAL, "a progress message is a JSON object");
    if (stage && (status = check_stage(stage, diag)) != GROOM_OK)
        return status;
    if (progress && !is_number(progress, 0, 1))
        return groom_fail_field(diag, GROOM_EINVAL, "/progress", "progress is a number from 0 to 1");
    if (eta && !cJSON_IsNull(eta) && !is_number(eta, 0, 1e9))
        return groom_fail_field(diag, GROOM_EINVAL, "/eta_s", "eta_s is a number of seconds or null");
    return losses ? check_losses(losses, diag) : GROOM_OK;
}

/* --- what becomes of it ------------------------------------------------------------------- */

struct message {
    const struct store_job *job; /* as it was before */
    const char *stage;           /* the present one's name */
    struct store_progress row;
    struct store_loss *losses;
    struct store_event_new events[3];
    char *text[3];               /* of the events; cJSON's */
    char *loss;                  /* the last value of each; cJSON's */
};

static void message_finish(struct message *m)
{
    free(m->losses);
    for (int i = 0; i < 3; i++)
        cJSON_free(m->text[i]);
    cJSON_free(m->loss);
}

/* Takes `data`. returns false: no memory */
static bool add_event(struct message *m, const char *type, cJSON *data)
{
    size_t i = m->row.n_events++;
    m->text[i] = cJSON_PrintUnformatted(data);
    m->events[i] = (struct store_event_new){type, m->text[i]};
    cJSON_Delete(data);
    return m->text[i] != NULL;
}

/* An event only where it is another stage than before. */
static bool take_stage(struct message *m, const cJSON *stage)
{
    if (!stage)
        return true;
    m->stage = cJSON_GetObjectItemCaseSensitive(stage, "name")->valuestring;
    m->row.stage = m->stage;
    m->row.stage_index = (uint32_t)cJSON_GetObjectItemCaseSensitive(stage, "index")->valuedouble;
    m->row.stage_count = (uint32_t)cJSON_GetObjectItemCaseSensitive(stage, "count")->valuedouble;
    if (strcmp(m->stage, m->job->stage) == 0 && m->row.stage_index == m->job->stage_index)
        return true;
    return add_event(m, "stage", cJSON_Duplicate(stage, 1));
}

static bool take_progress(struct message *m, const cJSON *progress, const cJSON *eta)
{
    m->row.progress = progress ? progress->valuedouble : -1;
    m->row.eta_s = cJSON_IsNumber(eta) ? eta->valuedouble : -1;
    if (!progress)
        return true;
    cJSON *data = cJSON_CreateObject();
    cJSON_AddStringToObject(data, "stage", m->stage);
    cJSON_AddNumberToObject(data, "progress", m->row.progress);
    if (m->row.eta_s >= 0)
        cJSON_AddNumberToObject(data, "eta_s", m->row.eta_s);
    return add_event(m, "progress", data);
}

static void take_loss(struct message *m, const cJSON *loss, cJSON *last)
{
    const cJSON *stage = cJSON_GetObjectItemCaseSensitive(loss, "stage");
    struct store_loss *row = &m->losses[m->row.n_losses++];
    row->stage = stage ? stage->valuestring : m->stage;
    row->iteration = (int64_t)cJSON_GetObjectItemCaseSensitive(loss, "iteration")->valuedouble;
    row->name = cJSON_GetObjectItemCaseSensitive(loss, "name")->valuestring;
    row->value = cJSON_GetObjectItemCaseSensitive(loss, "value")->valuedouble;
    cJSON_DeleteItemFromObjectCaseSensitive(last, row->name);
    cJSON_AddNumberToObject(last, row->name, row->value);
}

static bool take_losses(struct message *m, const cJSON *losses)
{
    const cJSON *loss;
    int n = losses ? cJSON_GetArraySize(losses) : 0;
    if (n == 0)
        return true;
    if (!(m->losses = calloc((size_t)n, sizeof *m->losses)))
        return false;
    cJSON *last = cJSON_Parse(m->job->loss);
    cJSON_ArrayForEach(loss, losses)
    {
        take_loss(m, loss, last);
    }
    m->row.losses = m->losses;
    m->loss = cJSON_PrintUnformatted(last);
    m->row.loss = m->loss;
    cJSON_Delete(last);
    cJSON *data = cJSON_CreateObject();
    cJSON_AddStringToObject(data, "stage", m->stage);
    cJSON_AddItemToObject(data, "losses", cJSON_Duplicate(losses, 1));
    return add_event(m, "loss", data) && m->loss;
}

static groom_status write_message(struct jobs *jobs, const struct store_attempt_ref *ref, const cJSON *message,
                                  const struct store_job *job, bool *cancel, struct groom_diag *diag)
{
    struct message m = {.job = job, .stage = job->stage};
    groom_status status;
    m.row.events = m.events;
    if (take_stage(&m, cJSON_GetObjectItemCaseSensitive(message, "stage")) &&
        take_progress(&m, cJSON_GetObjectItemCaseSensitive(message, "progress"),
                      cJSON_GetObjectItemCaseSensitive(message, "eta_s")) &&
        take_losses(&m, cJSON_GetObjectItemCaseSensitive(message, "losses")))
        status = store_attempt_progress(jobs->store, ref, &m.row, cancel, diag);
    else
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a progress message");
    bool seen = status == GROOM_OK && m.row.n_events > 0;
    if (status == GROOM_OK && m.stage[0])
        stage_clock_enter(jobs->clock, ref, job->kind, m.stage);
    message_finish(&m);
    if (seen)
        jobs_notify(jobs, ref->job_id);
    return status;
}

groom_status work_progress(struct jobs *jobs, const struct store_attempt_ref *ref, const char *body, size_t n_body,
                           bool *cancel, struct groom_diag *diag)
{
    struct store_job job = {0};
    cJSON *message = json_text_parse(body, n_body, NULL);
    groom_status status = check_message(message, diag);
    if (status == GROOM_OK)
        status = store_job_get(jobs->store, ref->job_id, &job, diag);
    if (status == GROOM_OK)
        status = write_message(jobs, ref, message, &job, cancel, diag);
    store_job_finish(&job);
    cJSON_Delete(message);
    return status;
}
