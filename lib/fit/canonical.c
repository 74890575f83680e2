#include "fit/canonical.h"

#include "fit/frame.h"

#define UNDEFINED 1e-3 /* of what the length of a moment could be */

/* Unit x, y or z that is most across `v`. */
static struct vec most_across(struct vec v)
{
    double x = fabs(v.x), y = fabs(v.y), z = fabs(v.z);
    if (y <= x && y <= z)
        return (struct vec){0, 1, 0};
    return z <= x ? (struct vec){0, 0, 1} : (struct vec){1, 0, 0};
}

static struct vec across(struct vec v, struct vec unit) { return vec_sub(v, vec_scale(unit, vec_dot(v, unit))); }

static struct vec vertex(const struct groom_fit *fit, uint32_t i, uint32_t j)
{
    return vec_of(fit->target[(size_t)i * fit->m + j]);
}

/* Against the mean of all ways from roots to vertices. */
static struct vec find_up(const struct groom_fit *fit, const unsigned char *outlier)
{
    struct vec sum = {0, 0, 0};
    double most = 0;
    for (uint32_t i = 0; i < fit->n; i++)
        for (uint32_t j = 1; j < fit->m && !outlier[i]; j++) {
            struct vec way = vec_sub(vertex(fit, i, 0), vertex(fit, i, j));
            sum = vec_add(sum, way);
            most += vec_length(way);
        }
    return vec_length(sum) > UNDEFINED * most ? vec_unit(sum) : (struct vec){0, 1, 0};
}

/* Sum of |d|^2 d across `up`, d from the mean of the roots. */
static struct vec find_front(const struct groom_fit *fit, const unsigned char *outlier, struct vec up)
{
    struct vec mean = {0, 0, 0}, sum = {0, 0, 0};
    double most = 0;
    uint32_t n = 0;
    for (uint32_t i = 0; i < fit->n; i++)
        if (!outlier[i]) {
            mean = vec_add(mean, vertex(fit, i, 0));
            n++;
        }
    mean = vec_scale(mean, 1.0 / n);
    for (uint32_t i = 0; i < fit->n; i++)
        if (!outlier[i]) {
            struct vec d = vec_sub(vertex(fit, i, 0), mean);
            double square = vec_dot(d, d);
            sum = vec_add(sum, vec_scale(d, square));
            most += square * sqrt(square);
        }
    sum = across(sum, up);
    return vec_unit(vec_length(sum) > UNDEFINED * most ? sum : across(most_across(up), up));
}

void canonical_frame(const struct groom_fit *fit, const unsigned char *outlier, double frame[3][3])
{
    struct vec y = find_up(fit, outlier), z = find_front(fit, outlier, y), x = vec_cross(y, z);
    frame_of(x, y, frame);
}
