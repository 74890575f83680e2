#include "server/worker/progress_report.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/work.h"
#include "server/worker/clock.h"

#define INTERVAL_S 0.5
/* An estimate from less of the work than this says nothing. */
#define SMALLEST_SHARE 0.01

/* --- the message -------------------------------------------------------------------------- */

/* The quality report is a stage of its own behind those of the fit. */
#define REPORT_STAGE "quality"
#define REPORT_SHARE 0.1

static uint32_t n_fit_stages(void)
{
    uint32_t n = 0;
    while (groom_fit_stage_name(n))
        n++;
    return n;
}

static int stands_somewhere(const struct progress_report *report) { return report->fit || report->plain.stage || report->compared >= 0; }

/* Of all of the job. */
static double fraction_of(const struct progress_report *report)
{
    struct groom_fit_progress progress;
    if (report->plain.stage)
        return report->plain.fraction;
    if (!report->fit)
        return 1 - REPORT_SHARE * (1 - report->compared);
    groom_fit_progress(report->fit, &progress);
    return progress.fraction * (1 - REPORT_SHARE);
}

static void add_stage(cJSON *message, const struct progress_report *report)
{
    struct groom_fit_progress progress = {.stage = REPORT_STAGE, .index = n_fit_stages()};
    if (report->fit)
        groom_fit_progress(report->fit, &progress);
    if (report->plain.stage)
        progress = report->plain;
    cJSON *stage = cJSON_AddObjectToObject(message, "stage");
    cJSON_AddStringToObject(stage, "name", progress.stage);
    cJSON_AddNumberToObject(stage, "index", progress.index);
    cJSON_AddNumberToObject(stage, "count", report->plain.stage ? progress.count : n_fit_stages() + 1);
}

static void add_time_left(cJSON *message, const struct progress_report *report, double fraction, double now_s)
{
    double share = fraction - report->first_fraction;
    if (share >= SMALLEST_SHARE)
        cJSON_AddNumberToObject(message, "eta_s",
                                round(10 * (now_s - report->started_s) * (1 - fraction) / share) / 10);
}

static void add_losses(cJSON *message, const struct progress_report *report)
{
    cJSON *losses = cJSON_AddArrayToObject(message, "losses");
    for (uint32_t i = 0; i < report->n_losses; i++) {
        const struct progress_loss *loss = &report->losses[i];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "stage", loss->stage);
        cJSON_AddNumberToObject(item, "iteration", (double)loss->iteration);
        cJSON_AddStringToObject(item, "name", loss->name);
        cJSON_AddNumberToObject(item, "value", loss->value);
        cJSON_AddItemToArray(losses, item);
    }
}

/* Before there is a fit nothing is said of progress: an earlier attempt may have come far. */
char *progress_report_text(const struct progress_report *report, double now_s)
{
    cJSON *message = cJSON_CreateObject();
    if (stands_somewhere(report)) {
        double fraction = fraction_of(report);
        add_stage(message, report);
        cJSON_AddNumberToObject(message, "progress", fraction);
        add_time_left(message, report, fraction, now_s);
    }
    add_losses(message, report);
    char *text = cJSON_PrintUnformatted(message);
    cJSON_Delete(message);
    return text;
}

/* --- sending -------------------------------------------------------------------------------- */

static int says_cancel(const struct http_response *response)
{
    cJSON *json = response->body ? cJSON_ParseWithLength(response->body, response->n_body) : NULL;
    int cancel = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(json, "cancel"));
    cJSON_Delete(json);
    return cancel;
}

static groom_status post(struct progress_report *report, const char *text)
{
    struct http_response response;
    struct http_request request = {.method = "POST",
                                   .path = WORK_PATH_PROGRESS,
                                   .content_type = "application/json",
                                   .body = text,
                                   .n_body = strlen(text)};
    groom_status st = work_link_mention(report->link, &request, &response, NULL);
    /* a message that was not taken is sent again, with what has come since */
    if (response.status == 200)
        report->n_losses = 0;
    if (st == GROOM_OK && says_cancel(&response)) {
        snprintf(report->link->why, sizeof report->link->why, "the job is cancelled");
        report->cancelled = 1;
        st = GROOM_ECANCELLED;
    }
    http_response_finish(&response);
    return st == GROOM_ECANCELLED ? st : GROOM_OK;
}

groom_status progress_report_send(struct progress_report *report, int now)
{
    double now_s = clock_s();
    if (report->halted || *report->link->stop)
        return GROOM_ECANCELLED;
    if (!now && now_s - report->sent_s < INTERVAL_S)
        return GROOM_OK;
    report->sent_s = now_s;
    char *text = progress_report_text(report, now_s);
    groom_status st = text ? post(report, text) : GROOM_OK;
    free(text);
    report->halted = st != GROOM_OK;
    return st;
}

/* --- the library's callbacks ------------------------------------------------------------------ */

/* Losses come thousands a second; where the buffer is full every second one is let go, so that the
 * curve stays whole. */
static void thin_losses(struct progress_report *report)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < report->n_losses; i += 2)
        report->losses[kept++] = report->losses[i];
    report->n_losses = kept;
}

static void on_loss(void *user, const char *name, uint64_t iteration, double value)
{
    struct progress_report *report = user;
    struct groom_fit_progress progress = {.stage = ""};
    if (!isfinite(value))
        return;
    if (report->fit)
        groom_fit_progress(report->fit, &progress);
    if (report->n_losses == PROGRESS_MAX_LOSSES)
        thin_losses(report);
    struct progress_loss *loss = &report->losses[report->n_losses++];
    snprintf(loss->stage, sizeof loss->stage, "%s", progress.stage);
    snprintf(loss->name, sizeof loss->name, "%s", name);
    loss->iteration = iteration;
    loss->value = value;
}

static void on_report(void *user, double fraction)
{
    struct progress_report *report = user;
    if (report->plain.stage)
        report->plain.fraction = report->plain_begin + fraction * (report->plain_end - report->plain_begin);
    if (report->compared < 0)
        return;
    report->compared = fmin(fmax(report->compared, (report->n_compared + fraction) / 2), 1);
    report->n_compared += fraction >= 1;
}

void progress_report_stage(struct progress_report *report, const char *stage, uint32_t index, uint32_t count, double begin,
                           double end)
{
    if (!report->plain.stage)
        report->started_s = clock_s();
    report->plain.stage = stage;
    report->plain.index = index;
    report->plain.count = count;
    report->plain.fraction = report->plain_begin = begin;
    report->plain_end = end;
}

static int on_cancelled(void *user) { return progress_report_send(user, 0) != GROOM_OK; }

void progress_report_init(struct progress_report *report, struct work_link *link)
{
    memset(report, 0, sizeof *report);
    report->link = link;
    report->compared = -1;
    report->callbacks = (struct groom_progress){.report = on_report, .loss = on_loss, .cancelled = on_cancelled, .user = report};
}

void progress_report_follow(struct progress_report *report, const struct groom_fit *fit)
{
    report->fit = fit;
    report->first_fraction = fraction_of(report);
    report->started_s = clock_s();
}

void progress_report_compare(struct progress_report *report)
{
    report->fit = NULL;
    report->compared = 0;
}
