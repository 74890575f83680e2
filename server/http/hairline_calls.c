/* POST /v1/heads/{id}/hairline: today's front hairline of strands or a groom, carried to a head: for an artist to drag. */
#include <cjson/cJSON.h>
#include <stdlib.h>

#include "server/grooms/hairline.h"
#include "server/http/handlers.h"
#include "server/http/submission.h"

#define USUAL_POINTS 33
#define MOST_POINTS  256

static bool take_points(struct request *request, cJSON *body, uint32_t *points)
{
    cJSON *item = cJSON_DetachItemFromObjectCaseSensitive(body, "points");
    double value = item ? item->valuedouble : USUAL_POINTS;
    bool fine = !item || (cJSON_IsNumber(item) && value >= 2 && value <= MOST_POINTS && !(value > (double)(uint32_t)value));
    cJSON_Delete(item);
    *points = fine ? (uint32_t)value : 0;
    if (!fine)
        respond_bad_field(request, 400, "/points", "points must be a whole number from 2 to %d", MOST_POINTS);
    return fine;
}

/* The body as a retargeting to the head of the path. */
static bool complete(struct request *request, cJSON *body)
{
    cJSON *target = cJSON_GetObjectItemCaseSensitive(body, "target");
    if (!target)
        target = cJSON_AddObjectToObject(body, "target");
    if (cJSON_GetObjectItemCaseSensitive(target, "head") || cJSON_GetObjectItemCaseSensitive(target, "hairline")) {
        respond_bad_field(request, 400, "/target", "the head is that of the path, and its line is what is asked for");
        return false;
    }
    if (cJSON_GetObjectItemCaseSensitive(body, "groom") && !cJSON_GetObjectItemCaseSensitive(body, "dense"))
        cJSON_AddTrueToObject(body, "dense"); /* its strands, as they are evaluated */
    return cJSON_IsObject(target) ? cJSON_AddStringToObject(target, "head", request->parameter[0]) != NULL : true;
}

static void answer(struct request *request, const cJSON *inputs, uint32_t points)
{
    const struct grooms_hairline_wish wish = {.project = request->actor.project, .target = request->parameter[0],
                                              .inputs = inputs, .points = points};
    struct groom_diag diag = {0};
    char *json;
    size_t n_bytes;
    groom_status status = grooms_hairline(request->service->grooms, &wish, &json, &n_bytes, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", json, n_bytes);
}

void hairline_call_post(struct request *request)
{
    uint32_t points;
    cJSON *body = request_json(request), *inputs = cJSON_CreateObject();
    if (body && take_points(request, body, &points) && complete(request, body) &&
        submission_only_known(request, body, &job_kind_retarget) && job_kind_retarget.take_inputs(request, body, inputs))
        answer(request, inputs, points);
    cJSON_Delete(inputs);
    cJSON_Delete(body);
}
