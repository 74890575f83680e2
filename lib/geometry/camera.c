#include "groom/camera.h"

#include <math.h>
#include <string.h>

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* a / |a|, or `otherwise` where a has no direction */
static void normalize(double a[3], const double otherwise[3])
{
    double length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (int c = 0; c < 3; c++)
        a[c] = length > 0 ? a[c] / length : otherwise[c];
}

void groom_camera_look_at(const double eye[3], const double target[3], double fov_y, uint32_t width,
                          uint32_t height, struct groom_camera *camera)
{
    double forward[3], right[3], down[3], up[3] = {0, 1, 0};
    for (int c = 0; c < 3; c++)
        forward[c] = target[c] - eye[c];
    normalize(forward, (double[3]){0, 0, -1});
    if (fabs(forward[1]) > 0.999999) {
        up[1] = 0;
        up[2] = -1;
    }
    cross(forward, up, right);
    normalize(right, (double[3]){1, 0, 0});
    cross(forward, right, down);

    memset(camera, 0, sizeof *camera);
    camera->width = width;
    camera->height = height;
    camera->fx = camera->fy = 0.5 * height / tan(0.5 * fov_y);
    camera->cx = 0.5 * width;
    camera->cy = 0.5 * height;
    for (int c = 0; c < 3; c++) {
        camera->rotation[c] = right[c];
        camera->rotation[3 + c] = down[c];
        camera->rotation[6 + c] = forward[c];
    }
    for (int row = 0; row < 3; row++)
        for (int c = 0; c < 3; c++)
            camera->translation[row] -= camera->rotation[3 * row + c] * eye[c];
}

int groom_camera_project(const struct groom_camera *camera, const float p[3], double pixel[2], double *depth)
{
    double q[3];
    for (int row = 0; row < 3; row++) {
        const double *r = camera->rotation + 3 * row;
        q[row] = r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + camera->translation[row];
    }
    *depth = q[2];
    if (!(q[2] > 0))
        return 0;
    pixel[0] = camera->fx * q[0] / q[2] + camera->cx;
    pixel[1] = camera->fy * q[1] / q[2] + camera->cy;
    return 1;
}
