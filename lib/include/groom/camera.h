/* A pinhole camera: what a reconstruction was seen by, and what a picture is taken with.
 *
 * The convention is OpenCV's and COLMAP's: x right, y down, z forward, the origin of the picture
 * at its upper left corner. A point p (metres, y up) is seen at
 *
 *     q = R p + t,   u = fx q.x / q.z + cx,   v = fy q.y / q.z + cy      where q.z > 0
 *
 * In JSON: {"name":"front","width":1024,"height":1024,"fx":..,"fy":..,"cx":..,"cy":..,
 *           "rotation":[[3],[3],[3]],"translation":[3]}, rotation in rows. */
#ifndef GROOM_CAMERA_H
#define GROOM_CAMERA_H

#include <stddef.h>
#include <stdint.h>

#include "groom/diag.h"
#include "groom/io.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom_camera {
    char name[32];
    uint32_t width, height;  /* pixels */
    double fx, fy, cx, cy;   /* pixels */
    double rotation[9];      /* R, row-major, world to camera */
    double translation[3];   /* t, metres */
};

/* A camera at `eye` that looks at `target`, upright; square pixels, the principal point in the
 * middle, fov_y radians from the lower to the upper edge. Looking straight up or down, -z is up. */
void groom_camera_look_at(const double eye[3], const double target[3], double fov_y, uint32_t width,
                          uint32_t height, struct groom_camera *camera);

/* Where p is seen, in pixels, and its depth q.z (metres). Returns 0 for a point behind the camera. */
int groom_camera_project(const struct groom_camera *camera, const float p[3], double pixel[2], double *depth);

/* Cameras out of files. Each has passed the checks that a camera of a job's options gets.
 * frame    the unit and up axis of the file, that of the strands reconstructed with it; not for
 *          {"cameras":[...]}, which is in metres, y up
 * cameras  [most], the caller's; what is in it on error is unspecified
 * returns  GROOM_OK, GROOM_EFORMAT, GROOM_EINVAL (a field of ours, with its pointer), GROOM_ETOOBIG (more than `most`) */

/* JSON: {"cameras":[...]} as above, or NeRF's transforms.json: frames with transform_matrix (camera to world,
 * y up, z backward), w, h, fl_x, fl_y, cx, cy or camera_angle_x, for all frames or each. */
GROOM_MUST_CHECK groom_status groom_cameras_read_json(const char *json, size_t n_bytes, struct groom_frame frame,
                                                      struct groom_camera *cameras, uint32_t most, uint32_t *n,
                                                      struct groom_diag *diag);
/* COLMAP's text, cameras.txt and images.txt, each ended by a zero byte behind its n. Lens distortion is left out. */
GROOM_MUST_CHECK groom_status groom_cameras_read_colmap(const char *lenses, size_t n_lenses, const char *images,
                                                        size_t n_images, struct groom_frame frame,
                                                        struct groom_camera *cameras, uint32_t most, uint32_t *n,
                                                        struct groom_diag *diag);
/* {"cameras":[...]}; malloc'd and ended by 0, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_cameras_print(const struct groom_camera *cameras, uint32_t n, char **json,
                                                  struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
