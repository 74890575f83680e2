/* What happened on the way: notes and losses. */
#include <cjson/cJSON.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/progress.h"
#include "fit/state.h"

void report_note(struct groom_fit_report *report, const char *format, ...)
{
    va_list arguments;
    if (report->n_notes == GROOM_FIT_MAX_NOTES)
        return;
    va_start(arguments, format);
    vsnprintf(report->notes[report->n_notes++], sizeof report->notes[0], format, arguments);
    va_end(arguments);
}

void report_loss(struct groom_fit_report *report, const char *stage, const char *name, double before, double after)
{
    if (report->n_losses == GROOM_FIT_MAX_LOSSES)
        return;
    struct groom_fit_loss *loss = &report->losses[report->n_losses++];
    snprintf(loss->stage, sizeof loss->stage, "%s", stage);
    snprintf(loss->name, sizeof loss->name, "%s", name);
    loss->before = before;
    loss->after = after;
}

void report_progress(struct groom_fit_report *report, const char *stage, const char *name, double value,
                     uint64_t iteration, const struct groom_context *context)
{
    progress_loss(context, name, iteration, value);
    for (uint32_t i = 0; i < report->n_losses; i++)
        if (strcmp(report->losses[i].stage, stage) == 0 && strcmp(report->losses[i].name, name) == 0) {
            report->losses[i].after = value;
            return;
        }
    report_loss(report, stage, name, value, value);
}

const struct groom_fit_report *groom_fit_get_report(const struct groom_fit *fit) { return &fit->report; }

static int put_losses(cJSON *json, const struct groom_fit_report *report)
{
    cJSON *losses = cJSON_AddArrayToObject(json, "losses");
    for (uint32_t i = 0; losses && i < report->n_losses; i++) {
        const struct groom_fit_loss *loss = &report->losses[i];
        cJSON *item = cJSON_CreateObject();
        if (!cJSON_AddItemToArray(losses, item) || !cJSON_AddStringToObject(item, "stage", loss->stage) ||
            !cJSON_AddStringToObject(item, "name", loss->name) ||
            !cJSON_AddNumberToObject(item, "before", loss->before) ||
            !cJSON_AddNumberToObject(item, "after", loss->after))
            return 0;
    }
    return losses != NULL;
}

static int put_notes(cJSON *json, const struct groom_fit_report *report)
{
    cJSON *notes = cJSON_AddArrayToObject(json, "notes");
    for (uint32_t i = 0; notes && i < report->n_notes; i++)
        if (!cJSON_AddItemToArray(notes, cJSON_CreateString(report->notes[i])))
            return 0;
    return notes != NULL;
}

groom_status groom_fit_report_print(const struct groom_fit *fit, char **out, struct groom_diag *diag)
{
    const struct groom_fit_report *report = &fit->report;
    cJSON *json = cJSON_CreateObject();
    char *text = NULL;
    if (json && cJSON_AddNumberToObject(json, "guides", report->n_guides) &&
        cJSON_AddNumberToObject(json, "operator_guides", report->n_operator_guides) &&
        cJSON_AddStringToObject(json, "scalp", groom_scalp_source_name(report->scalp)) &&
        cJSON_AddNumberToObject(json, "joined", report->n_joined) &&
        cJSON_AddNumberToObject(json, "detached", report->n_detached) &&
        cJSON_AddNumberToObject(json, "outliers", report->n_outliers) &&
        cJSON_AddNumberToObject(json, "unseen", report->n_unseen) &&
        cJSON_AddNumberToObject(json, "reassigned", report->n_reassigned) &&
        cJSON_AddNumberToObject(json, "penetrating", report->n_penetrating) &&
        cJSON_AddNumberToObject(json, "in_head", report->n_in_head) &&
        cJSON_AddNumberToObject(json, "beyond_target", report->n_beyond_target) && put_losses(json, report) &&
        put_notes(json, report))
        text = cJSON_Print(json);
    cJSON_Delete(json);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the report of a fit");
    *out = text;
    return GROOM_OK;
}
