/* Jobs of kind "retarget": strands, or a groom, and the bodies from which and to which they are carried.
 *
 *   {"strands":"str_…" | "groom":"grm_…", "revision":N, "dense":true,
 *    "source":{"head":"head_…","skeleton":{…}},
 *    "target":{"head":"head_…","skeleton":{…},"landmarks":[…],"hairline":{…}}, "hairline":{…}
 *    or "targets":[{…},…]}
 *
 * The store keeps "targets" alone, each with its own hairline, and a groom with its revision. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/correspondence.h"
#include "groom/hairline.h"
#include "groom/retarget.h"
#include "groom/skeleton.h"
#include "server/grooms/retargeted.h"
#include "server/http/submission.h"


static const cJSON *member(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNull(item) ? NULL : item;
}

static bool refuse_memory(struct request *request)
{
    respond_failure(request, GROOM_ENOMEM, NULL);
    return false;
}

/* --- what is carried ------------------------------------------------------------------------ */

static bool take_revision(struct request *request, const cJSON *body, uint32_t *revision)
{
    const cJSON *item = member(body, "revision");
    double value = item ? item->valuedouble : 0;
    if (item && (!cJSON_IsNumber(item) || value < 1 || value > UINT32_MAX || value > (double)(uint32_t)value)) {
        respond_bad_field(request, 400, "/revision", "revision must be a whole number from 1");
        return false;
    }
    *revision = (uint32_t)value;
    return true;
}

/* The groom as it is now: a job that waits carries what its client has seen. head: the one that it was made with. */
static bool take_groom(struct request *request, const cJSON *body, cJSON *inputs, char head[STORE_ID_SIZE])
{
    char project[STORE_PROJECT_SIZE];
    struct groom_diag diag = {0};
    uint32_t revision;
    const char *id = cJSON_GetStringValue(member(body, "groom"));
    const cJSON *dense = member(body, "dense");
    if (!id) {
        respond_bad_field(request, 400, "/groom", "\"groom\" must be the id of a groom");
        return false;
    }
    if (dense && !cJSON_IsBool(dense)) {
        respond_bad_field(request, 400, "/dense", "\"dense\" must be true or false");
        return false;
    }
    if (!take_revision(request, body, &revision))
        return false;
    groom_status status = store_project_of(request->service->store, id, project, &diag);
    if (status == GROOM_OK && strcmp(project, request->actor.project) != 0)
        status = GROOM_ENOTFOUND;
    if (status == GROOM_OK)
        status = grooms_head_of(request->service->grooms, id, &revision, head, &diag);
    if (status == GROOM_ENOTFOUND)
        respond_bad_field(request, 422, revision ? "/revision" : "/groom", "there is no groom \"%.40s\" with this revision", id);
    else if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    if (status != GROOM_OK)
        return false;
    return (cJSON_AddStringToObject(inputs, "groom", id) && cJSON_AddNumberToObject(inputs, "revision", revision) &&
            cJSON_AddBoolToObject(inputs, "dense", cJSON_IsTrue(dense))) || refuse_memory(request);
}

static bool take_subject(struct request *request, const cJSON *body, cJSON *inputs, char head[STORE_ID_SIZE])
{
    head[0] = 0;
    if (member(body, "groom") && member(body, "strands")) {
        respond_bad_field(request, 400, "/groom", "give \"strands\" or \"groom\", not both");
        return false;
    }
    if (member(body, "groom"))
        return take_groom(request, body, inputs, head);
    if (member(body, "dense") || member(body, "revision")) {
        respond_bad_field(request, 400, member(body, "dense") ? "/dense" : "/revision", "this goes with \"groom\"");
        return false;
    }
    return submission_take_upload(request, body, "strands", "/strands", STORE_STRANDS, true, inputs);
}

/* --- bodies --------------------------------------------------------------------------------- */

static bool is_skeleton(const char *json, size_t n, struct groom_diag *diag, groom_status *status)
{
    struct groom_skeleton *skeleton = malloc(sizeof *skeleton);
    *status = skeleton ? groom_skeleton_parse(json, n, skeleton, diag) : GROOM_ENOMEM;
    free(skeleton);
    return *status == GROOM_OK;
}

static bool is_hairline(const char *json, size_t n, struct groom_diag *diag, groom_status *status)
{
    struct groom_hairline *hairline = malloc(sizeof *hairline);
    *status = hairline ? groom_hairline_parse(json, n, hairline, diag) : GROOM_ENOMEM;
    free(hairline);
    return *status == GROOM_OK;
}

/* A list here, a member of that name in the library's form. */
static bool are_landmarks(const char *json, size_t n, struct groom_diag *diag, groom_status *status)
{
    struct groom_landmarks *landmarks = malloc(sizeof *landmarks);
    char *object = NULL;
    int length = asprintf(&object, "{\"landmarks\":%s}", json);
    *status = landmarks && length > 0 ? groom_landmarks_parse(object, (size_t)length, landmarks, diag) : GROOM_ENOMEM;
    if (*status == GROOM_EINVAL && strncmp(diag->pointer, "/landmarks", 10) == 0)
        memmove(diag->pointer, diag->pointer + 10, strlen(diag->pointer + 10) + 1);
    free(object);
    free(landmarks);
    return *status == GROOM_OK;
}

/* What a body may have beside its head, and the library that says whether it is one. */
static const struct part {
    const char *name;
    bool of_target_alone;
    bool (*is_one)(const char *json, size_t n, struct groom_diag *diag, groom_status *status);
} parts[] = {{"skeleton", false, is_skeleton}, {"landmarks", true, are_landmarks}, {"hairline", true, is_hairline}};
#define N_PARTS (sizeof parts / sizeof parts[0])

static bool take_part(struct request *request, const struct part *part, const cJSON *value, const char *pointer,
                      cJSON *input)
{
    struct groom_diag diag = {0};
    groom_status status = GROOM_ENOMEM;
    char *text = cJSON_PrintUnformatted(value), at[200];
    bool fine = text && part->is_one(text, strlen(text), &diag, &status);
    cJSON_free(text);
    if (!fine && status != GROOM_EINVAL) {
        respond_failure(request, status, &diag);
        return false;
    }
    if (!fine) {
        snprintf(at, sizeof at, "%.80s/%s%.80s", pointer, part->name, diag.pointer);
        respond_bad_field(request, 400, at, "%s", diag.detail);
        return false;
    }
    cJSON *copy = cJSON_Duplicate(value, true);
    if (copy && cJSON_AddItemToObject(input, part->name, copy))
        return true;
    cJSON_Delete(copy);
    return refuse_memory(request);
}

static bool only_known(struct request *request, const cJSON *body, bool target, const char *pointer)
{
    const char *members = target ? "head skeleton landmarks hairline" : "head skeleton";
    const cJSON *item;
    char at[200];
    cJSON_ArrayForEach(item, body)
    {
        if (item->string && router_knows(members, item->string))
            continue;
        snprintf(at, sizeof at, "%.80s/%.80s", pointer, item->string ? item->string : "");
        respond_bad_field(request, 400, at, "this is not a member of a body; it takes: %s", members);
        return false;
    }
    return true;
}

/* pointer  of the body: "/source", "/targets/0"; head: where it names none, or NULL */
static bool take_body(struct request *request, const cJSON *body, bool target, const char *pointer, const char *head,
                      cJSON *input)
{
    char at[100];
    if (body && !cJSON_IsObject(body)) {
        respond_bad_field(request, 400, pointer, "a body is an object with a \"head\"");
        return false;
    }
    if (!only_known(request, body, target, pointer))
        return false;
    snprintf(at, sizeof at, "%.80s/head", pointer);
    if (!member(body, "head") && head && head[0]) {
        if (!cJSON_AddStringToObject(input, "head", head))
            return refuse_memory(request);
    } else if (!submission_take_upload(request, body, "head", at, STORE_HEAD, true, input)) {
        return false;
    }
    for (size_t i = 0; i < N_PARTS; i++) {
        const cJSON *value = member(body, parts[i].name);
        if (value && (target || !parts[i].of_target_alone) && !take_part(request, &parts[i], value, pointer, input))
            return false;
    }
    return true;
}

static bool take_target(struct request *request, const cJSON *target, const char *pointer, cJSON *targets)
{
    cJSON *input = cJSON_CreateObject();
    if (!input || !cJSON_AddItemToArray(targets, input)) {
        cJSON_Delete(input);
        return refuse_memory(request);
    }
    return take_body(request, target, true, pointer, NULL, input);
}

/* "hairline" beside "target" is the contract's; it is the one target's. */
static bool take_single(struct request *request, const cJSON *body, cJSON *targets)
{
    const cJSON *hairline = member(body, "hairline"), *target = member(body, "target");
    if (!take_target(request, target, "/target", targets))
        return false;
    if (!hairline)
        return true;
    if (member(target, "hairline")) {
        respond_bad_field(request, 400, "/hairline", "the target has a hairline of its own: give one of the two");
        return false;
    }
    return take_part(request, &parts[N_PARTS - 1], hairline, "", cJSON_GetArrayItem(targets, 0));
}

static bool take_many(struct request *request, const cJSON *body, cJSON *targets)
{
    const cJSON *list = member(body, "targets"), *target;
    char pointer[32];
    int n = 0;
    if (member(body, "target") || member(body, "hairline")) {
        respond_bad_field(request, 400, "/targets", "give \"target\" (and \"hairline\"), or \"targets\" with a hairline each");
        return false;
    }
    if (!cJSON_IsArray(list) || cJSON_GetArraySize(list) < 1 || cJSON_GetArraySize(list) > GROOMS_MOST_TARGETS) {
        respond_bad_field(request, 400, "/targets", "\"targets\" is a list of 1 to %d bodies", GROOMS_MOST_TARGETS);
        return false;
    }
    cJSON_ArrayForEach(target, list)
    {
        snprintf(pointer, sizeof pointer, "/targets/%d", n++);
        if (!take_target(request, target, pointer, targets))
            return false;
    }
    return true;
}

static bool take_inputs(struct request *request, const cJSON *body, cJSON *inputs)
{
    char head[STORE_ID_SIZE];
    if (!take_subject(request, body, inputs, head))
        return false;
    cJSON *source = cJSON_AddObjectToObject(inputs, "source"), *targets = cJSON_AddArrayToObject(inputs, "targets");
    if (!source || !targets)
        return refuse_memory(request);
    return take_body(request, member(body, "source"), false, "/source", head, source) &&
           (member(body, "targets") ? take_many(request, body, targets)
                                      : take_single(request, body, targets));
}

static groom_status complete_options(const char *json, size_t n, char **complete, struct groom_diag *diag)
{
    struct groom_retarget_options options;
    groom_status status = groom_retarget_options_parse(json, n, &options, diag);
    return status == GROOM_OK ? groom_retarget_options_print(&options, complete, diag) : status;
}

const struct job_kind job_kind_retarget = {
    "retarget", "strands groom revision dense source target targets hairline", take_inputs, complete_options};
