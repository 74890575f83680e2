#include "server/worker/retarget_body.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/body.h"
#include "groom/correspondence.h"
#include "server/worker/blob.h"

groom_status retarget_complain(groom_status st, const char *place, struct groom_diag *diag)
{
    struct groom_diag of_library = *diag;
    char pointer[sizeof of_library.pointer];
    if (st == GROOM_OK || st == GROOM_ENOMEM || st == GROOM_ECANCELLED || st == GROOM_EIO)
        return st;
    snprintf(pointer, sizeof pointer, "%.60s%.60s", place, of_library.pointer);
    return groom_fail_field(diag, st, pointer, "%s", of_library.detail);
}

static groom_status read_mesh(struct work_link *link, const struct order_input *input, const struct groom_context *context,
                              struct groom_mesh **mesh, struct groom_diag *diag)
{
    struct groom_mesh_read_options options = {.frame = input->frame, .by_faces_alone = 1};
    struct groom_memory_source memory;
    struct blob blob;
    groom_status st = blob_fetch(link, &input->blob, &blob, diag);
    if (st != GROOM_OK)
        return st;
    struct groom_source source = groom_source_from_memory(&memory, blob.bytes, blob.n_bytes);
    if (input->format[0])
        st = groom_mesh_format_parse(input->format, &options.format, diag);
    if (st == GROOM_OK)
        st = groom_mesh_read(&source, &options, context, mesh, NULL, diag);
    blob_release(&blob);
    return st;
}

/* What was mended or let pass stands in the attempt's log. */
static groom_status make_ready(struct groom_mesh *mesh, const char *place, const struct groom_context *context,
                               struct groom_diag *diag)
{
    struct groom_body_report report = {0};
    groom_status st = groom_body_check(mesh, context, &report, diag);
    for (uint32_t i = 0; i < report.n_warnings; i++)
        fprintf(stderr, "groom-worker: %s/head: %s\n", place, report.warnings[i]);
    return st;
}

static groom_status parse_skeleton(const cJSON *asked, struct groom_skeleton *skeleton, struct groom_diag *diag)
{
    char *text = cJSON_PrintUnformatted(asked);
    groom_status st = text ? groom_skeleton_parse(text, strlen(text), skeleton, diag)
                           : groom_fail(diag, GROOM_ENOMEM, "no memory for a skeleton");
    cJSON_free(text);
    return st;
}

groom_status retarget_body_open_source(const cJSON *asked, const struct groom_context *context, struct retarget_body *body,
                                       struct groom_diag *diag)
{
    const cJSON *skeleton = cJSON_GetObjectItemCaseSensitive(asked, "skeleton");
    groom_status st = retarget_complain(make_ready(body->mesh, "/source", context, diag), "/source/head", diag);
    if (st != GROOM_OK)
        return st;
    st = skeleton ? parse_skeleton(skeleton, &body->skeleton, diag)
                  : groom_skeleton_make(body->mesh, context, &body->skeleton, diag);
    return retarget_complain(st, "/source/skeleton", diag);
}

groom_status retarget_body_source(struct work_link *link, const struct order_input *input, const cJSON *asked,
                                  const struct groom_context *context, struct retarget_body *body, struct groom_diag *diag)
{
    groom_status st = retarget_complain(read_mesh(link, input, context, &body->mesh, diag), "/source/head", diag);
    return st == GROOM_OK ? retarget_body_open_source(asked, context, body, diag) : st;
}

/* --- targets --------------------------------------------------------------------------------- */

static groom_status parse_landmarks(const cJSON *asked, struct groom_landmarks *landmarks, struct groom_diag *diag)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddItemReferenceToObject(object, "landmarks", (cJSON *)asked);
    char *text = cJSON_PrintUnformatted(object);
    groom_status st = text ? groom_landmarks_parse(text, strlen(text), landmarks, diag)
                           : groom_fail(diag, GROOM_ENOMEM, "no memory for landmarks");
    cJSON_free(text);
    cJSON_Delete(object);
    return st;
}

/* The source's triangles laid over the mesh, in its place. What became of it stands in the attempt's log. */
static groom_status register_mesh(const struct retarget_body *source, const cJSON *asked, const char *place,
                                  const struct groom_context *context, struct groom_mesh **mesh, struct groom_diag *diag)
{
    struct groom_correspondence_report report = {0};
    struct groom_landmarks *landmarks = asked ? malloc(sizeof *landmarks) : NULL;
    struct groom_mesh *registered = NULL;
    groom_status st = asked && !landmarks ? GROOM_ENOMEM : GROOM_OK;
    if (st == GROOM_OK && asked)
        st = parse_landmarks(asked, landmarks, diag);
    if (st == GROOM_OK)
        st = groom_correspondence_create(source->mesh, *mesh, landmarks, context, &registered, &report, diag);
    free(landmarks);
    if (st != GROOM_OK)
        return st;
    fprintf(stderr, "groom-worker: %s/head: registered, %.1f %% of the source covered, %.2f mm off on average, %.2f mm at most\n",
            place, 100 * report.covered, 1000 * report.mean_distance, 1000 * report.max_distance);
    groom_mesh_destroy(*mesh);
    *mesh = registered;
    return GROOM_OK;
}

/* Landmarks are followed also where the triangles are the same: they may be another head's in another order. */
static groom_status match_topology(const struct retarget_body *source, const cJSON *landmarks, const char *place,
                                   const struct groom_context *context, struct groom_mesh **mesh, struct groom_diag *diag)
{
    return !landmarks && groom_topology_same(source->mesh, *mesh, NULL)
               ? GROOM_OK
               : register_mesh(source, landmarks, place, context, mesh, diag);
}

static groom_status find_skeleton(const struct retarget_body *source, const cJSON *asked, struct retarget_body *body,
                                  struct groom_diag *diag)
{
    if (!asked)
        return groom_skeleton_carry(&source->skeleton, source->mesh, body->mesh, &body->skeleton, diag);
    groom_status st = parse_skeleton(asked, &body->skeleton, diag);
    return st == GROOM_OK ? groom_skeleton_match(&source->skeleton, &body->skeleton, diag) : st;
}

groom_status retarget_body_open_target(const cJSON *asked, const char *place, const struct retarget_body *source,
                                       const struct groom_context *context, struct retarget_body *body,
                                       struct groom_diag *diag)
{
    const cJSON *landmarks = cJSON_GetObjectItemCaseSensitive(asked, "landmarks");
    char at[64];
    snprintf(at, sizeof at, "%.40s/head", place);
    groom_status st = retarget_complain(make_ready(body->mesh, place, context, diag), at, diag);
    if (st == GROOM_OK)
        st = retarget_complain(match_topology(source, landmarks, place, context, &body->mesh, diag), place, diag);
    snprintf(at, sizeof at, "%.40s/skeleton", place);
    if (st == GROOM_OK)
        st = retarget_complain(find_skeleton(source, cJSON_GetObjectItemCaseSensitive(asked, "skeleton"), body, diag), at, diag);
    return st;
}

groom_status retarget_body_target(struct work_link *link, const struct order_input *input, const cJSON *asked,
                                  unsigned index, const struct retarget_body *source, const struct groom_context *context,
                                  struct retarget_body *body, struct groom_diag *diag)
{
    char place[32], at[64];
    snprintf(place, sizeof place, "/targets/%u", index);
    snprintf(at, sizeof at, "%s/head", place);
    groom_status st = retarget_complain(read_mesh(link, input, context, &body->mesh, diag), at, diag);
    return st == GROOM_OK ? retarget_body_open_target(asked, place, source, context, body, diag) : st;
}

void retarget_body_finish(struct retarget_body *body)
{
    groom_mesh_destroy(body->mesh);
    *body = (struct retarget_body){0};
}
