#include "fit/frame.h"

#include <math.h>
#include <string.h>

void frame_of(struct vec x, struct vec y, double frame[3][3])
{
    const struct vec row[3] = {x, y, vec_cross(x, y)};
    for (int c = 0; c < 3; c++) {
        frame[c][0] = row[c].x;
        frame[c][1] = row[c].y;
        frame[c][2] = row[c].z;
    }
}

void frame_multiply(const double a[3][3], const double b[3][3], double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            out[i][j] = 0;
            for (int k = 0; k < 3; k++)
                out[i][j] += a[i][k] * b[k][j];
        }
}

/* Rodrigues' formula, row by row: each is a unit vector turned back. */
void frame_rotation(const double vector[3], double turn[3][3])
{
    struct vec v = {vector[0], vector[1], vector[2]};
    double angle = vec_length(v), cosine = cos(angle), sine = sin(angle);
    struct vec axis = angle > 0 ? vec_scale(v, 1 / angle) : (struct vec){1, 0, 0};
    struct vec row[2];
    for (int c = 0; c < 2; c++) {
        struct vec unit = {c == 0, c == 1, 0};
        row[c] = vec_add(vec_add(vec_scale(unit, cosine), vec_scale(vec_cross(unit, axis), sine)),
                         vec_scale(axis, vec_dot(axis, unit) * (1 - cosine)));
    }
    frame_of(row[0], row[1], turn);
}

void frame_turned(const double frame[3][3], const float vector[3], double out[3][3])
{
    double turn[3][3], turned[3][3];
    if (vector[0] == 0 && vector[1] == 0 && vector[2] == 0) {
        memcpy(out, frame, sizeof turn);
        return;
    }
    frame_rotation((const double[3]){vector[0], vector[1], vector[2]}, turn);
    frame_multiply((const double (*)[3])turn, frame, turned);
    frame_of(vec_unit((struct vec){turned[0][0], turned[0][1], turned[0][2]}),
             vec_unit((struct vec){turned[1][0], turned[1][1], turned[1][2]}), out);
}

void frame_store(const double frame[3][3], float axes[3][3])
{
    int space = 1;
    for (int k = 0; k < 9; k++)
        space &= frame[k / 3][k % 3] == (k / 3 == k % 3);
    for (int k = 0; k < 9; k++)
        axes[k / 3][k % 3] = space ? 0 : (float)frame[k / 3][k % 3];
}
