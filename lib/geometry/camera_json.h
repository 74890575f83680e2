/* A camera as cJSON, in the form that groom/camera.h gives. */
#ifndef GEOMETRY_CAMERA_JSON_H
#define GEOMETRY_CAMERA_JSON_H

#include <cjson/cJSON.h>

#include "groom/camera.h"
#include "groom/diag.h"

/* NULL where memory is out; the caller's to cJSON_Delete. */
cJSON *camera_to_json(const struct groom_camera *camera);

/* returns  GROOM_OK, or GROOM_EINVAL with `pointer` and the culprit's name below it in the diag */
GROOM_MUST_CHECK groom_status camera_from_json(const cJSON *json, const char *pointer,
                                               struct groom_camera *camera, struct groom_diag *diag);

#endif
