#include "retarget/membrane.h"

#include <math.h>
#include <string.h>

/* Eq. 16: the triangle in a plane of its own, its first side along the first axis. */
int membrane_rest(struct membrane_triangle *rest, const struct vec corner[3])
{
    struct vec a = vec_sub(corner[1], corner[0]), b = vec_sub(corner[2], corner[0]);
    double length = vec_length(a), twice = vec_length(vec_cross(a, b));
    if (!(twice > 0))
        return 0;
    double along = vec_dot(b, a) / length, height = twice / length;
    const double inverse[2][2] = {{1 / length, -along / (length * height)}, {0, 1 / height}};
    for (int k = 0; k < 2; k++) {
        rest->gradient[1][k] = inverse[0][k];
        rest->gradient[2][k] = inverse[1][k];
        rest->gradient[0][k] = -inverse[0][k] - inverse[1][k];
    }
    rest->area = 0.5 * twice;
    return 1;
}

/* The columns of F = d D^-1. */
static void deformation(const struct membrane_triangle *rest, const struct vec x[3], struct vec column[2])
{
    for (int k = 0; k < 2; k++) {
        column[k] = (struct vec){0, 0, 0};
        for (int i = 0; i < 3; i++)
            column[k] = vec_add(column[k], vec_scale(x[i], rest->gradient[i][k]));
    }
}

double membrane_energy(const struct membrane_triangle *rest, struct membrane_material material, const struct vec x[3])
{
    struct vec f[2];
    deformation(rest, x, f);
    double stretch = vec_length(vec_cross(f[0], f[1]));
    if (!(stretch > 0))
        return INFINITY;
    double log_stretch = log(stretch);
    return rest->area * (0.5 * material.mu * (vec_dot(f[0], f[0]) + vec_dot(f[1], f[1]) - 2 - 2 * log_stretch) +
                         0.5 * material.lambda * log_stretch * log_stretch);
}

/* --- singular values and the energy's eigenvectors ------------------------------------------------ */

struct singular {
    double s[2];
    double right[2][2]; /* right[i]: the direction at rest that is stretched by s[i] */
    struct vec left[3]; /* where it goes; the last: the triangle's normal */
};

static void singular_values(const struct vec f[2], struct singular *out)
{
    double a = vec_dot(f[0], f[0]), b = vec_dot(f[0], f[1]), c = vec_dot(f[1], f[1]);
    double angle = 0.5 * atan2(2 * b, a - c);
    double ca = cos(angle), sa = sin(angle);
    const double right[2][2] = {{ca, sa}, {-sa, ca}};
    memcpy(out->right, right, sizeof right);
    for (int i = 0; i < 2; i++) {
        struct vec w = vec_add(vec_scale(f[0], right[i][0]), vec_scale(f[1], right[i][1]));
        out->s[i] = fmax(vec_length(w), 1e-12);
        out->left[i] = vec_scale(w, 1 / out->s[i]);
    }
    out->left[2] = vec_cross(out->left[0], out->left[1]);
}

/* A direction in the space of F: sum over left[i] right[j]^T, and the energy's curvature along it. */
struct mode {
    double along[3][2]; /* [left][right] */
    double curvature;
};

/* Both eigenvectors of the 2 x 2 block of pure stretches. */
static void stretch_modes(double p, double q, double r, struct mode mode[2])
{
    double angle = 0.5 * atan2(2 * q, p - r), c = cos(angle), s = sin(angle);
    mode[0] = (struct mode){.along = {{c, 0}, {0, s}}, .curvature = p * c * c + 2 * q * c * s + r * s * s};
    mode[1] = (struct mode){.along = {{-s, 0}, {0, c}}, .curvature = p * s * s - 2 * q * c * s + r * c * c};
}

static void find_modes(const struct singular *f, struct membrane_material m, double slope[2], struct mode mode[6])
{
    const double half = sqrt(0.5), *s = f->s, j = s[0] * s[1], log_j = log(j);
    double second[2];
    for (int i = 0; i < 2; i++) {
        slope[i] = m.mu * (s[i] - 1 / s[i]) + m.lambda * log_j / s[i];
        second[i] = m.mu * (1 + 1 / (s[i] * s[i])) + m.lambda * (1 - log_j) / (s[i] * s[i]);
    }
    stretch_modes(second[0], m.lambda / j, second[1], mode);
    mode[2] = (struct mode){.along = {{0, half}, {-half, 0}}, .curvature = (slope[0] + slope[1]) / (s[0] + s[1])};
    mode[3] = (struct mode){.along = {{0, half}, {half, 0}}, .curvature = m.mu * (1 + 1 / j) - m.lambda * log_j / j};
    mode[4] = (struct mode){.along = {{0, 0}, {0, 0}, {1, 0}}, .curvature = slope[0] / s[0]};
    mode[5] = (struct mode){.along = {{0, 0}, {0, 0}, {0, 1}}, .curvature = slope[1] / s[1]};
}

/* How F's part along a mode changes with each of the six parameters. */
static void pull_back(const struct membrane_triangle *rest, const struct singular *f, const double along[3][2],
                      const double jacobian[3][3][2], double out[6])
{
    for (int i = 0; i < 3; i++) {
        struct vec direction = {0, 0, 0};
        for (int r = 0; r < 2; r++) {
            double g = rest->gradient[i][0] * f->right[r][0] + rest->gradient[i][1] * f->right[r][1];
            for (int l = 0; l < 3; l++)
                direction = vec_add(direction, vec_scale(f->left[l], along[l][r] * g));
        }
        for (int k = 0; k < 2; k++)
            out[2 * i + k] = direction.x * jacobian[i][0][k] + direction.y * jacobian[i][1][k] + direction.z * jacobian[i][2][k];
    }
}

void membrane_derivatives(const struct membrane_triangle *rest, struct membrane_material material, const struct vec x[3],
                          const double jacobian[3][3][2], double gradient[6], double hessian[6][6], int project)
{
    struct vec column[2];
    struct singular f;
    struct mode mode[6];
    double slope[2];
    deformation(rest, x, column);
    singular_values(column, &f);
    find_modes(&f, material, slope, mode);
    const double stress[3][2] = {{slope[0], 0}, {0, slope[1]}, {0, 0}};
    pull_back(rest, &f, stress, jacobian, gradient);
    for (int i = 0; i < 6; i++)
        gradient[i] *= rest->area;
    if (!hessian)
        return;
    memset(hessian, 0, 6 * sizeof *hessian);
    for (int m = 0; m < 6; m++) {
        double a[6], curvature = rest->area * (project ? fmax(mode[m].curvature, 0) : mode[m].curvature);
        pull_back(rest, &f, mode[m].along, jacobian, a);
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++)
                hessian[i][j] += curvature * a[i] * a[j];
    }
}
