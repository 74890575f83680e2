/* Guide strands, grown step by step: out of the scalp, combed, then down under gravity and around
 * the head, never into it. */
#include <math.h>
#include <string.h>

#include "sample/parts.h"

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void normalize(double v[3])
{
    double length = sqrt(dot(v, v));
    for (int c = 0; c < 3 && length > 0; c++)
        v[c] /= length;
}

/* From the middle of the head to p; returns the distance. */
static double direction_of(const double p[3], double direction[3])
{
    for (int c = 0; c < 3; c++)
        direction[c] = p[c] - sample_head_centre[c];
    double distance = sqrt(dot(direction, direction));
    normalize(direction);
    return distance;
}

/* -1 or 1: the side of the parting, which fades out towards the back of the head */
static double side_of(const struct sample_style *style, const double root[3])
{
    double parting = isnan(style->parting) ? 0 : style->parting;
    double side = root[0] > parting ? 1 : -1, behind = root[2] + 0.02;
    return behind < 0 ? side * exp(-behind * behind / (0.05 * 0.05)) : side;
}

static void first_direction(const struct sample_style *style, const double root[3], const double normal[3],
                            const double jitter[3], double direction[3])
{
    double comb[3] = {style->comb_side * side_of(style, root), style->comb_up, style->comb_front};
    if (!isnan(style->parting)) /* on the sides and at the back hair is combed down rather than across */
        comb[1] -= 0.5 * (1 - normal[1]);
    double into = fmin(dot(comb, normal), 0);
    for (int c = 0; c < 3; c++)
        direction[c] = (style->lift - into) * normal[c] + comb[c] + 0.06 * jitter[c];
    normalize(direction);
}

/* Turns direction towards straight down, by `angle` where it is level. */
static void fall(double direction[3], double angle)
{
    double across = sqrt(direction[0] * direction[0] + direction[2] * direction[2]);
    double turn = fmin(angle * across, 1);
    direction[1] -= turn;
    normalize(direction);
}

/* Keeps p at `gap` from the head or further, and the direction out of it. */
static void slide(double p[3], double direction[3], double gap)
{
    double d[3], normal[3], distance = direction_of(p, d), least = sample_head_radius(d) + gap;
    if (distance >= least)
        return;
    sample_head_normal(d, normal);
    double into = fmin(dot(direction, normal), 0);
    for (int c = 0; c < 3; c++) {
        p[c] = sample_head_centre[c] + least * d[c];
        direction[c] -= into * normal[c];
    }
    normalize(direction);
}

static double guide_length(const struct sample_style *style, struct groom_random_key key, uint32_t index,
                           const double root[3])
{
    double d[3], height;
    direction_of(root, d);
    sample_head_is_scalp(d, &height);
    height = height < 0 ? 0 : height * (2 - height);
    double share = style->length_low + (1 - style->length_low) * height;
    return style->length * share * (0.95 + 0.1 * groom_random_uniform(key, index, 0));
}

/* Vertices at equal steps of arc length along n points. */
static void resample(const float (*in)[3], uint32_t n, float (*out)[3], uint32_t m)
{
    double total = groom_polyline_length(in, n), begin = 0, length = groom_polyline_length(in, 2);
    uint32_t at = 0;
    for (uint32_t j = 0; j < m; j++) {
        double wanted = total * j / (m - 1);
        while (at + 2 < n && begin + length < wanted) {
            begin += length;
            at++;
            length = groom_polyline_length(in + at, 2);
        }
        double t = length > 0 ? fmin((wanted - begin) / length, 1) : 0;
        for (int c = 0; c < 3; c++)
            out[j][c] = (float)(in[at][c] + t * ((double)in[at + 1][c] - in[at][c]));
    }
}

void sample_guide_grow(const struct sample_style *style, uint64_t seed, uint32_t index, const float root[3],
                       uint32_t m, float (*fine)[3], float (*points)[3])
{
    struct groom_random_key key = {seed, STREAM_GUIDE};
    double p[3] = {root[0], root[1], root[2]}, d[3], normal[3], direction[3], jitter[3];
    double step = guide_length(style, key, index, p) / SAMPLE_FINE;
    double floor_y = style->cut > 0 ? sample_head_centre[1] - style->cut : -INFINITY;
    uint32_t n = 1;

    for (uint32_t c = 0; c < 3; c++)
        jitter[c] = groom_random_normal(key, index, 1 + c);
    direction_of(p, d);
    sample_head_normal(d, normal);
    first_direction(style, p, normal, jitter, direction);
    memcpy(fine[0], root, sizeof fine[0]);
    while (n <= SAMPLE_FINE && (n < SAMPLE_FINE / 8 || p[1] > floor_y)) {
        for (int c = 0; c < 3; c++)
            p[c] += step * direction[c];
        slide(p, direction, fmin(0.25 * n * step, style->layer * (0.6 + 0.4 * n / SAMPLE_FINE)));
        fall(direction, style->gravity * step);
        for (int c = 0; c < 3; c++)
            fine[n][c] = (float)p[c];
        n++;
    }
    resample((const float (*)[3])fine, n, points, m);
}
