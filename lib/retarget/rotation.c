#include "retarget/rotation.h"

#include <math.h>
#include <string.h>

/* One Jacobi rotation that takes away a[p][q]; v gathers the eigenvectors as columns. */
static void rotate(double a[4][4], double v[4][4], int p, int q)
{
    if (a[p][q] == 0)
        return;
    double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
    for (int i = 0; i < 4; i++) {
        double ip = a[i][p], iq = a[i][q];
        a[i][p] = c * ip - s * iq;
        a[i][q] = s * ip + c * iq;
    }
    for (int i = 0; i < 4; i++) {
        double pi = a[p][i], qi = a[q][i], vp = v[i][p], vq = v[i][q];
        a[p][i] = c * pi - s * qi;
        a[q][i] = s * pi + c * qi;
        v[i][p] = c * vp - s * vq;
        v[i][q] = s * vp + c * vq;
    }
}

/* The quaternion is the eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix of s. */
void rotation_fit(const double s[3][3], double r[3][3])
{
    double xx = s[0][0], yy = s[1][1], zz = s[2][2];
    double yz = s[2][1] - s[1][2], zx = s[0][2] - s[2][0], xy = s[1][0] - s[0][1];
    double a[4][4] = {{xx + yy + zz, yz, zx, xy},
                      {yz, xx - yy - zz, s[0][1] + s[1][0], s[2][0] + s[0][2]},
                      {zx, s[0][1] + s[1][0], yy - xx - zz, s[1][2] + s[2][1]},
                      {xy, s[2][0] + s[0][2], s[1][2] + s[2][1], zz - xx - yy}};
    double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    int best = 0;
    for (int sweep = 0; sweep < 12; sweep++) {
        double off = 0, on = 0;
        for (int p = 0; p < 4; p++)
            for (int q = 0; q < 4; q++)
                *(p == q ? &on : &off) += a[p][q] * a[p][q];
        if (off <= 1e-26 * on)
            break;
        for (int p = 0; p < 3; p++)
            for (int q = p + 1; q < 4; q++)
                rotate(a, v, p, q);
    }
    for (int i = 1; i < 4; i++)
        if (a[i][i] > a[best][best])
            best = i;
    double w = v[0][best], x = v[1][best], y = v[2][best], z = v[3][best];
    const double out[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
                              {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
                              {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
    memcpy(r, out, sizeof out);
}
