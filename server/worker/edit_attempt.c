#include "server/worker/edit_attempt.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

#include "groom/document.h"
#include "groom/layers.h"
#include "groom/spatial.h"
#include "proto/strand_stream.h"
#include "proto/work.h"
#include "server/worker/clock.h"
#include "server/worker/receive.h"
#include "server/worker/worker.h"

struct edit {
    struct work_link *link;
    const struct groom_context *context;
    struct progress_report *progress;
    struct groom_diag *diag;
    struct groom_strands *strands;
    struct groom *groom;             /* of the strands, with the layer alone */
    struct groom_bvh *head;
    struct groom_layer_report report;
    double started_s;
};

/* --- what is needed ------------------------------------------------------------------------ */

static groom_status take_strands(struct edit *e)
{
    groom_status st = receive_strands(e->link, e->context, &e->strands, e->diag);
    return st == GROOM_OK ? groom_create_of_strands(e->strands, e->context, &e->groom, e->diag) : st;
}

static groom_status take_layer(struct edit *e)
{
    struct http_response response;
    groom_status st = work_link_call(e->link, &(struct http_request){.method = "GET", .path = WORK_PATH_LAYER}, &response,
                                     e->diag);
    if (st == GROOM_OK)
        st = groom_document_operator_read(response.body, response.n_body, NULL, e->groom, 0, e->diag);
    http_response_finish(&response);
    return st;
}

/* --- the work ---------------------------------------------------------------------------------- */

/* In place: what came in is what goes out. */
static groom_status solve(struct edit *e)
{
    progress_report_stage(e->progress, groom_operator_name(e->groom->operators[0].type), 0, 1, 0.0, 1.0);
    groom_status st = progress_report_send(e->progress, 1);
    return st == GROOM_OK ? groom_layer_change(e->groom, 0, e->strands, e->head, e->context, &e->report, e->diag) : st;
}

/* --- the result ----------------------------------------------------------------------------------- */

static cJSON *describe(const struct edit *e)
{
    const struct groom_layer_report *r = &e->report;
    const struct {
        const char *name;
        double value;
    } rows[] = {{"strands", r->n_strands}, {"changed", r->n_changed}, {"conversion_error", (double)r->conversion_error_m},
                {"seconds", clock_s() - e->started_s}, {"energy_before", r->sculpt.energy_before},
                {"energy_after", r->sculpt.energy_after}, {"anchors", r->sculpt.n_anchors},
                {"anchor_error_mean", r->sculpt.anchor_error_mean_m}, {"anchor_error_max", r->sculpt.anchor_error_max_m},
                {"iterations_median", r->sculpt.iterations_median}, {"iterations_max", r->sculpt.iterations_max},
                {"unfinished", r->sculpt.n_stopped}, {"contact_checked", r->contact.n_checked},
                {"contact_entered", r->contact.n_entered}, {"contact_inside", r->contact.n_inside},
                {"contact_depth_before", (double)r->contact.depth_before_m},
                {"contact_depth_after", (double)r->contact.depth_after_m}};
    cJSON *root = cJSON_CreateObject(), *report = cJSON_AddObjectToObject(root, "report");
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        cJSON_AddNumberToObject(report, rows[i].name, rows[i].value);
    return root;
}

/* What was found of contact stands in the layer now, as the document will have it. */
static groom_status add_contact(const struct edit *e, cJSON *root)
{
    char *text = NULL;
    size_t n_bytes;
    groom_status st = groom_document_operator_write(e->groom, 0, NULL, &text, &n_bytes, e->diag);
    if (st != GROOM_OK)
        return st;
    cJSON *layer = cJSON_ParseWithLength(text, n_bytes);
    cJSON *contact = cJSON_DetachItemFromObjectCaseSensitive(layer, "contact");
    if (contact)
        cJSON_AddItemToObject(root, "contact", contact);
    cJSON_Delete(layer);
    free(text);
    return GROOM_OK;
}

/* {"report":...} and what was found of contact: a line. malloc'ed by cJSON. */
static groom_status tell(const struct edit *e, char **line)
{
    cJSON *root = describe(e);
    groom_status st = e->groom->operators[0].layer->contact.n ? add_contact(e, root) : GROOM_OK;
    *line = st == GROOM_OK ? cJSON_PrintUnformatted(root) : NULL;
    cJSON_Delete(root);
    return st == GROOM_OK && !*line ? groom_fail(e->diag, GROOM_ENOMEM, "no memory for the result") : st;
}

static groom_status deliver(struct edit *e)
{
    const struct groom_strands *strands = e->strands;
    char *line, head[1 + STRAND_STREAM_HEAD] = "\n";
    groom_status st = tell(e, &line);
    if (st != GROOM_OK)
        return st;
    strand_stream_head(strands->n_strands, strands->n_vertices, head + 1);
    struct http_request request = {
        .method = "POST", .path = WORK_PATH_RESULT, .content_type = STRAND_STREAM_TYPE,
        .n_body = strlen(line) + 1 + strand_stream_bytes(strands->n_strands, strands->n_vertices),
        .parts = {{line, strlen(line)},
                  {head, sizeof head},
                  {strands->first, ((size_t)strands->n_strands + 1) * sizeof *strands->first},
                  {strands->points, strands->n_vertices * sizeof *strands->points}},
        .n_parts = 4};
    st = work_link_call(e->link, &request, NULL, e->diag);
    cJSON_free(line);
    return st;
}

groom_status edit_attempt(struct work_link *link, const struct groom_mesh *head, const struct groom_context *context,
                          struct progress_report *report, struct groom_diag *diag)
{
    struct edit e = {.link = link, .context = context, .progress = report, .diag = diag, .started_s = clock_s()};
    groom_status st = take_strands(&e);
    if (st == GROOM_OK)
        st = take_layer(&e);
    if (st == GROOM_OK && head)
        st = groom_bvh_create(head, context, &e.head, diag);
    if (st == GROOM_OK)
        st = solve(&e);
    if (st == GROOM_OK)
        st = deliver(&e);
    groom_bvh_destroy(e.head);
    groom_destroy(e.groom);
    groom_strands_destroy(e.strands);
    return st;
}
