/* An edit of many strands: the daemon hands out the layer and the strands that come into it, a worker
 * solves, the daemon writes the revision. */
#include <stdlib.h>
#include <string.h>

#include "groom/format.h"
#include "proto/json_text.h"
#include "server/grooms/layer_edit.h"

/* The job as the edit that it was. */
struct reopened {
    cJSON *inputs;
    struct grooms_layer_edit edit;
    struct trial trial;
};

static groom_status reopen(struct grooms *grooms, const struct grooms_layer_job *job, struct groom_diag *diag,
                           struct reopened *r, const cJSON *contact)
{
    const cJSON *revision;
    r->inputs = json_text_parse(job->inputs, strlen(job->inputs), NULL);
    r->edit.groom_id = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(r->inputs, "groom"));
    r->edit.strands_id = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(r->inputs, "strands"));
    revision = cJSON_GetObjectItemCaseSensitive(r->inputs, "revision");
    r->edit.expected = cJSON_IsNumber(revision) ? (uint32_t)revision->valuedouble : 0;
    r->edit.project = job->project;
    r->edit.body = job->options;
    r->edit.n_body = strlen(job->options);
    r->trial = (struct trial){.grooms = grooms, .edit = &r->edit, .diag = diag, .contact = contact};
    if (!r->edit.groom_id && !r->edit.strands_id)
        return groom_fail(diag, GROOM_EINVAL, "the job does not say what is edited");
    groom_status status = groom_operator_parse(job->kind, &r->edit.type, diag);
    if (status == GROOM_OK)
        status = trial_begin(&r->trial);
    if (status == GROOM_ECONFLICT) /* to a worker that word means that another has taken its place */
        return groom_fail(diag, GROOM_EINVAL, "the groom was changed while its edit waited: repeat the edit");
    return status;
}

static void close_again(struct reopened *r)
{
    trial_end(&r->trial);
    cJSON_Delete(r->inputs);
}

/* --- what the worker is given ---------------------------------------------------------------- */

/* A groom of strands alone has no operator guides: who belongs to which is told. */
static groom_status tell_groups(struct trial *trial)
{
    const struct groom *groom = &trial->work;
    struct groom_grouping *grouping = &groom->operators[trial->index].layer->grouping;
    if (grouping->kind != GROOM_GROUPING_OPERATOR_GUIDES)
        return GROOM_OK;
    grouping->of_strand = groom->allocator->allocate(groom->allocator->user, groom->n_strands * sizeof *grouping->of_strand);
    if (!grouping->of_strand)
        return groom_fail(trial->diag, GROOM_ENOMEM, "no memory for groups");
    memcpy(grouping->of_strand, groom->operator_guide_of, groom->n_strands * sizeof *grouping->of_strand);
    grouping->kind = GROOM_GROUPING_GIVEN;
    grouping->count = groom->n_operator_guides;
    return GROOM_OK;
}

groom_status grooms_job_layer(struct grooms *grooms, const struct grooms_layer_job *job, char **json,
                              struct groom_diag *diag)
{
    struct reopened r = {0};
    size_t n_bytes;
    groom_status status = reopen(grooms, job, diag, &r, NULL);
    if (status == GROOM_OK)
        status = tell_groups(&r.trial);
    if (status == GROOM_OK)
        status = groom_document_operator_write(&r.trial.work, r.trial.index, NULL, json, &n_bytes, diag);
    close_again(&r);
    return status;
}

groom_status grooms_job_strands(struct grooms *grooms, const struct grooms_layer_job *job, struct groom_sink sink,
                                struct groom_diag *diag)
{
    struct reopened r = {0};
    const struct groom_write_options options = {.format = GROOM_FORMAT_HAIR};
    groom_status status = reopen(grooms, job, diag, &r, NULL);
    if (status == GROOM_OK)
        status = groom_strands_write(r.trial.before->strands, &options, sink, &grooms->context, diag);
    close_again(&r);
    return status;
}

/* --- what it hands in ---------------------------------------------------------------------------- */

static double number(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : 0.0;
}

static uint32_t count(const cJSON *object, const char *name)
{
    double value = number(object, name);
    return value >= 0 && value <= UINT32_MAX ? (uint32_t)value : 0;
}

/* The names are proto/work.h's. */
static void read_report(const cJSON *json, struct groom_layer_report *r)
{
    r->n_strands = count(json, "strands");
    r->n_changed = count(json, "changed");
    r->conversion_error_m = (float)number(json, "conversion_error");
    r->sculpt.energy_before = number(json, "energy_before");
    r->sculpt.energy_after = number(json, "energy_after");
    r->sculpt.anchor_error_mean_m = number(json, "anchor_error_mean");
    r->sculpt.anchor_error_max_m = number(json, "anchor_error_max");
    r->sculpt.n_anchors = count(json, "anchors");
    r->sculpt.iterations_median = count(json, "iterations_median");
    r->sculpt.iterations_max = count(json, "iterations_max");
    r->sculpt.n_stopped = count(json, "unfinished");
    r->contact.n_checked = count(json, "contact_checked");
    r->contact.n_entered = count(json, "contact_entered");
    r->contact.n_inside = count(json, "contact_inside");
    r->contact.depth_before_m = (float)number(json, "contact_depth_before");
    r->contact.depth_after_m = (float)number(json, "contact_depth_after");
}

static groom_status read_strands(struct trial *trial, const char *bytes, size_t n_bytes)
{
    struct groom_memory_source memory;
    struct groom_source source = groom_source_from_memory(&memory, bytes, n_bytes);
    const struct groom_read_options options = {.format = GROOM_FORMAT_HAIR};
    const struct groom_strands *before = trial->before->strands;
    groom_status status = groom_strands_read(&source, &options, &trial->grooms->context, &trial->after, NULL, trial->diag);
    if (status == GROOM_OK &&
        (trial->after->n_strands != before->n_strands ||
         memcmp(trial->after->first, before->first, ((size_t)before->n_strands + 1) * sizeof *before->first) != 0))
        status = groom_fail(trial->diag, GROOM_EINVAL, "the worker handed in other strands than it was given");
    return status;
}

groom_status grooms_job_result(struct grooms *grooms, const struct grooms_layer_job *job, const char *bytes,
                               size_t n_bytes,
                               groom_status (*store)(void *user, const struct store_revision_new *next, uint32_t expected,
                                                     const char *answer, struct groom_diag *diag),
                               void *user, struct groom_diag *diag)
{
    struct reopened r = {0};
    struct grooms_layer_edited edited = {0};
    const char *end = memchr(bytes, '\n', n_bytes);
    cJSON *line = end ? json_text_parse(bytes, (size_t)(end - bytes), NULL) : NULL;
    if (!line)
        return groom_fail(diag, GROOM_EINVAL, "a result is a line of JSON and a HAIR file");
    groom_status status = reopen(grooms, job, diag, &r, cJSON_GetObjectItemCaseSensitive(line, "contact"));
    if (status == GROOM_OK)
        status = read_strands(&r.trial, end + 1, n_bytes - (size_t)(end + 1 - bytes));
    if (status == GROOM_OK) {
        const cJSON *report = cJSON_GetObjectItemCaseSensitive(line, "report");
        read_report(report, &r.trial.report);
        r.trial.wish.points = false;
        r.trial.started_s -= number(report, "seconds");
        status = trial_finish(&r.trial, store, user, &edited);
    }
    grooms_layer_edited_finish(&edited);
    close_again(&r);
    cJSON_Delete(line);
    return status;
}
