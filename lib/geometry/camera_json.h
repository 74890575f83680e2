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

/* Cameras as an options' "cameras" holds them: an array of ours; NeRF's transforms.json as it is, an object with
 * "frames"; or COLMAP's two files as texts, {"cameras_txt":"...","images_txt":"..."}. The two objects may say "unit"
 * and "up" of the capture; metres, y up, where they do not.
 * cameras  [most]; what is in it on error is unspecified
 * returns  GROOM_OK, or GROOM_EINVAL with `pointer`, or what lies below it, in the diag */
GROOM_MUST_CHECK groom_status cameras_from_json(const cJSON *json, const char *pointer, struct groom_camera *cameras,
                                                uint32_t most, uint32_t *n, struct groom_diag *diag);

#endif
