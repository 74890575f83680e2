/* An edit of many strands: the daemon hands out the layer and the strands that come into it, a worker
 * solves, the daemon writes the revision. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json_text.h"
#include "proto/strand_stream.h"
#include "server/grooms/layer_edit.h"

/* The job as the edit that it was. */
struct reopened {
    cJSON *inputs;
    struct grooms_layer_edit edit;
    struct layer_trial trial;
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
    r->trial = (struct layer_trial){.grooms = grooms, .edit = &r->edit, .diag = diag, .contact = contact};
    if (!r->edit.groom_id && !r->edit.strands_id)
        return groom_fail(diag, GROOM_EINVAL, "the job does not say what is edited");
    groom_status status = groom_operator_parse(job->kind, &r->edit.type, diag);
    if (status == GROOM_OK)
        status = layer_trial_begin(&r->trial);
    if (status == GROOM_ECONFLICT) /* to a worker that word means that another has taken its place */
        return groom_fail(diag, GROOM_EINVAL, "the groom was changed while its edit waited: repeat the edit");
    return status;
}

static void close_again(struct reopened *r)
{
    layer_trial_end(&r->trial);
    cJSON_Delete(r->inputs);
}

/* --- what the worker is given ---------------------------------------------------------------- */

/* A groom of strands alone has no operator guides: who belongs to which is told. */
static groom_status tell_groups(struct layer_trial *trial)
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

groom_status grooms_job_strands(struct grooms *grooms, const struct grooms_layer_job *job, struct grooms_held *held,
                                struct groom_diag *diag)
{
    struct reopened r = {0};
    groom_status status = reopen(grooms, job, diag, &r, NULL);
    if (status == GROOM_OK) {
        *held = (struct grooms_held){r.trial.before->strands, grooms, r.trial.before};
        r.trial.before = NULL;
    }
    close_again(&r);
    return status;
}

void grooms_release(struct grooms_held *held) { states_release(held->grooms->states, held->state); }

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

static int make_room(void *user, struct strand_stream *stream)
{
    struct layer_trial *trial = user;
    const struct groom_strands *before = trial->before->strands;
    if (stream->n_strands != before->n_strands || stream->n_vertices != before->n_vertices ||
        groom_strands_create(stream->n_strands, stream->n_vertices, &trial->grooms->context, &trial->after, NULL) != GROOM_OK)
        return 0;
    stream->first = trial->after->first;
    stream->points = trial->after->points;
    return 1;
}

static int are_finite(const struct groom_strands *strands)
{
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        if (!isfinite(strands->points[i][0]) || !isfinite(strands->points[i][1]) || !isfinite(strands->points[i][2]))
            return 0;
    return 1;
}

static groom_status read_strands(struct layer_trial *trial, const char *bytes, size_t n_bytes)
{
    struct strand_stream stream = {.room = make_room, .user = trial};
    const struct groom_strands *before = trial->before->strands;
    if (!strand_stream_take(&stream, bytes, n_bytes) || !strand_stream_is_whole(&stream) ||
        memcmp(stream.first, before->first, ((size_t)before->n_strands + 1) * sizeof *before->first) != 0)
        return groom_fail(trial->diag, GROOM_EINVAL, "the worker handed in other strands than it was given");
    if (!are_finite(trial->after))
        return groom_fail(trial->diag, GROOM_EINVAL, "the worker handed in strands that are not finite");
    return GROOM_OK;
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
        return groom_fail(diag, GROOM_EINVAL, "a result is a line of JSON and the strands");
    groom_status status = reopen(grooms, job, diag, &r, cJSON_GetObjectItemCaseSensitive(line, "contact"));
    if (status == GROOM_OK)
        status = read_strands(&r.trial, end + 1, n_bytes - (size_t)(end + 1 - bytes));
    if (status == GROOM_OK) {
        const cJSON *report = cJSON_GetObjectItemCaseSensitive(line, "report");
        read_report(report, &r.trial.report);
        r.trial.wish.points = false;
        r.trial.started_s -= number(report, "seconds");
        status = layer_trial_finish(&r.trial, store, user, &edited);
    }
    grooms_layer_edited_finish(&edited);
    close_again(&r);
    cJSON_Delete(line);
    return status;
}
