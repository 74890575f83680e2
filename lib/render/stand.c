/* Which way a camera looks: the four views, and cameras that stand anywhere. */
#include <math.h>

#include "render/scene.h"

#define WIDEST_FOV 2.8 /* radians */

static const struct render_axes axes_of[GROOM_VIEW_COUNT] = {
    [GROOM_VIEW_FRONT] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
    [GROOM_VIEW_SIDE] = {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}},
    [GROOM_VIEW_BACK] = {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
    [GROOM_VIEW_TOP] = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
};

void render_axes_of_view(groom_view view, struct render_axes *axes) { *axes = axes_of[view]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* Where it stands, seen from what it looks at; straight above or below, the azimuth is that of the face. */
static void direction_of(const struct groom_render_camera *camera, double *azimuth, double *elevation)
{
    double d[3];
    *azimuth = camera->azimuth;
    *elevation = camera->elevation;
    if (!camera->is_placed)
        return;
    for (int k = 0; k < 3; k++)
        d[k] = camera->eye[k] - camera->target[k];
    double across = hypot(d[0], d[2]);
    *elevation = atan2(d[1], across);
    *azimuth = across > 1e-9 * fabs(d[1]) ? atan2(d[0], d[2]) : 0;
}

void render_axes_of_camera(const struct groom_render_camera *camera, struct render_axes *axes)
{
    double azimuth, elevation;
    direction_of(camera, &azimuth, &elevation);
    double s = sin(azimuth), c = cos(azimuth), up = sin(elevation), out = cos(elevation);
    *axes = (struct render_axes){.right = {c, 0, -s}, .back = {s * out, up, c * out}};
    cross(axes->back, axes->right, axes->up);
}

static int are_finite(const double v[3]) { return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]); }

groom_status render_camera_check(const struct groom_render_camera *camera, struct groom_diag *diag)
{
    double apart = 0;
    for (int k = 0; k < 3; k++)
        apart += fabs(camera->eye[k] - camera->target[k]);
    if (!isfinite(camera->azimuth) || !(fabs(camera->elevation) <= 0.5 * M_PI + 1e-5))
        return groom_fail(diag, GROOM_EINVAL, "the camera's elevation is %g; it must be -pi/2 (from below) to pi/2 (from above)", camera->elevation);
    if (!(camera->distance >= 0 && camera->distance <= 1e6))
        return groom_fail(diag, GROOM_EINVAL, "the camera's distance is %g; it must be metres, or 0 for far enough", camera->distance);
    if (!(camera->fov_y >= 0 && camera->fov_y <= WIDEST_FOV))
        return groom_fail(diag, GROOM_EINVAL, "the camera's field of view is %g; it must be radians, up to %g", camera->fov_y, WIDEST_FOV);
    if ((camera->has_target || camera->is_placed) && !are_finite(camera->target))
        return groom_fail(diag, GROOM_EINVAL, "the camera's target must be three numbers");
    if (camera->is_placed && (!are_finite(camera->eye) || !(apart > 1e-9)))
        return groom_fail(diag, GROOM_EINVAL, "the camera's eye must be three numbers, away from its target");
    return GROOM_OK;
}
