#include "retarget/hairline_curve.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"

#define STEP 0.002         /* metres between the curve's points */
#define MOST_OFF 0.03      /* of a drawn point from the surface */
#define MOST_POINTS 2048
#define FASTEN_OVER (1.0 / 6)

/* Turning points: where a line turns by more than a quarter of a right angle within a twelfth of it. */
#define TURN_WINDOW (1.0 / 24)
#define LEAST_TURN 0.39
#define TURN_APART (1.0 / 10)
#define TURN_SHIFT 0.12    /* of arc between two that are taken for the same */

static groom_status no_memory(struct groom_diag *diag) { return groom_fail(diag, GROOM_ENOMEM, "no memory for the hairline's curve"); }

/* --- points on the surface -------------------------------------------------------------------- */

/* returns 0 where the nearest point of the surface is not in the patch */
static int put_on_surface(const struct groom_scalp_region *region, struct vec p, struct vec *point, struct vec *normal, double u[2],
                          double *off)
{
    struct groom_surface_point at;
    float q[3];
    vec_store(p, q);
    if (!groom_bvh_closest(region->bvh, q, INFINITY, &at))
        return 0;
    *point = vec_of(at.position);
    *normal = vec_of(at.normal);
    *off = at.distance;
    return flat_parameters(&region->flat, at.triangle, at.barycentric, u);
}

/* The place at parameter t of the centripetal Catmull-Rom piece between p[1] and p[2] (Barry and Goldman 1988). */
static struct vec catmull_rom(const struct vec p[4], double t)
{
    double knot[4] = {0};
    struct vec a[3], b[2];
    for (int i = 1; i < 4; i++)
        knot[i] = knot[i - 1] + fmax(sqrt(vec_length(vec_sub(p[i], p[i - 1]))), 1e-6);
    double at = knot[1] + t * (knot[2] - knot[1]);
    for (int i = 0; i < 3; i++) {
        double s = (at - knot[i]) / (knot[i + 1] - knot[i]);
        a[i] = vec_add(vec_scale(p[i], 1 - s), vec_scale(p[i + 1], s));
    }
    for (int i = 0; i < 2; i++) {
        double s = (at - knot[i]) / (knot[i + 2] - knot[i]);
        b[i] = vec_add(vec_scale(a[i], 1 - s), vec_scale(a[i + 1], s));
    }
    double s = (at - knot[1]) / (knot[2] - knot[1]);
    return vec_add(vec_scale(b[0], 1 - s), vec_scale(b[1], s));
}

/* The point beyond an end: the end's neighbour mirrored in it. */
static struct vec drawn_point(const struct groom_hairline_curve *drawn, int64_t i)
{
    int64_t last = (int64_t)drawn->n_points - 1;
    if (i < 0)
        return vec_sub(vec_scale(vec_of(drawn->points[0]), 2), vec_of(drawn->points[1]));
    if (i > last)
        return vec_sub(vec_scale(vec_of(drawn->points[last]), 2), vec_of(drawn->points[last - 1]));
    return vec_of(drawn->points[i]);
}

static groom_status check_points(const struct groom_scalp_region *region, const struct groom_hairline_curve *drawn,
                                 const char *pointer, struct groom_diag *diag)
{
    for (uint32_t i = 0; i < drawn->n_points; i++) {
        struct vec point, normal;
        double u[2], off = INFINITY;
        char field[64];
        snprintf(field, sizeof field, "%s/points/%u", pointer, i);
        int near = put_on_surface(region, vec_of(drawn->points[i]), &point, &normal, u, &off);
        if (!(off <= MOST_OFF))
            return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline leaves the head: this point is %.1f cm from its surface; "
                                    "at most %.0f cm are", 100 * off, 100 * MOST_OFF);
        if (!near)
            return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline leaves the head: this point is too far from where hair "
                                    "grows now");
    }
    return GROOM_OK;
}

static void measure(struct curve *curve)
{
    curve->length = 0;
    for (uint32_t i = 0; i < curve->n; i++) {
        curve->length += i ? vec_length(vec_sub(curve->point[i], curve->point[i - 1])) : 0;
        curve->arc[i] = curve->length;
    }
    for (uint32_t i = 0; i < curve->n; i++)
        curve->arc[i] /= curve->length > 0 ? curve->length : 1;
}

static groom_status sample(struct curve *curve, const struct groom_scalp_region *region, const struct groom_hairline_curve *drawn,
                           const char *pointer, struct groom_diag *diag)
{
    for (uint32_t i = 0; i + 1 < drawn->n_points; i++) {
        const struct vec p[4] = {drawn_point(drawn, (int64_t)i - 1), drawn_point(drawn, i), drawn_point(drawn, i + 1), drawn_point(drawn, (int64_t)i + 2)};
        uint32_t most = (MOST_POINTS - 2) / drawn->n_points, n = (uint32_t)fmin(ceil(vec_length(vec_sub(p[2], p[1])) / STEP), most);
        for (uint32_t k = 0; k < n || (k == n && i + 2 == drawn->n_points); k++) {
            double off;
            if (!put_on_surface(region, catmull_rom(p, n ? (double)k / n : 1), &curve->point[curve->n], &curve->normal[curve->n],
                                curve->u[curve->n], &off)) {
                char field[64];
                snprintf(field, sizeof field, "%s/points/%u", pointer, i);
                return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline leaves the head after this point");
            }
            curve->n++;
        }
    }
    measure(curve);
    return GROOM_OK;
}

/* The drawn point before a place along the curve, for messages. */
static uint32_t drawn_before(const struct curve *curve, const struct groom_hairline_curve *drawn, uint32_t at)
{
    uint32_t best = 0;
    double nearest = INFINITY;
    for (uint32_t i = 0; i < drawn->n_points; i++) {
        double d = vec_length(vec_sub(vec_of(drawn->points[i]), curve->point[at]));
        if (d < nearest) {
            nearest = d;
            best = i;
        }
    }
    return best;
}

groom_status curve_init(struct curve *curve, const struct groom_scalp_region *region, const struct groom_hairline_curve *drawn,
                        const char *pointer, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = region->allocator;
    uint32_t first, second;
    char field[64];
    *curve = (struct curve){.allocator = allocator, .capacity = MOST_POINTS};
    snprintf(field, sizeof field, "%s/points", pointer);
    if (drawn->n_points < 3 || drawn->n_points > GROOM_HAIRLINE_MAX_POINTS)
        return groom_fail_field(diag, GROOM_EINVAL, field, "a hairline must have 3 to %d points", GROOM_HAIRLINE_MAX_POINTS);
    curve->point = memory_array(allocator, MOST_POINTS, sizeof *curve->point);
    curve->normal = memory_array(allocator, MOST_POINTS, sizeof *curve->normal);
    curve->u = memory_array(allocator, MOST_POINTS, sizeof *curve->u);
    curve->arc = memory_array(allocator, MOST_POINTS, sizeof *curve->arc);
    if (!curve->point || !curve->normal || !curve->u || !curve->arc)
        return no_memory(diag);
    groom_status st = check_points(region, drawn, pointer, diag);
    if (st == GROOM_OK)
        st = sample(curve, region, drawn, pointer, diag);
    if (st != GROOM_OK)
        return st;
    if (!(curve->length > 2 * STEP))
        return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline has no length");
    int closed = memcmp(drawn->points[0], drawn->points[drawn->n_points - 1], sizeof drawn->points[0]) == 0;
    if (!line_crosses_itself((const double(*)[2])curve->u, curve->n - (uint32_t)closed, closed, &first, &second))
        return GROOM_OK;
    uint32_t at = drawn_before(curve, drawn, first), again = drawn_before(curve, drawn, second);
    snprintf(field, sizeof field, "%s/points/%u", pointer, at);
    if (at == again) /* a loop of the smooth curve, where points come back on themselves */
        return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline crosses itself just behind point %u", at);
    return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline crosses itself between points %u and %u", at, again);
}

void curve_finish(struct curve *curve)
{
    const struct groom_allocator *allocator = curve->allocator;
    if (!allocator)
        return;
    memory_release(allocator, curve->point, curve->capacity, sizeof *curve->point);
    memory_release(allocator, curve->normal, curve->capacity, sizeof *curve->normal);
    memory_release(allocator, curve->u, curve->capacity, sizeof *curve->u);
    memory_release(allocator, curve->arc, curve->capacity, sizeof *curve->arc);
    *curve = (struct curve){0};
}

/* --- fastening -------------------------------------------------------------------------------------- */

static void reverse(struct curve *curve)
{
    for (uint32_t i = 0, j = curve->n - 1; i < j; i++, j--) {
        struct vec p = curve->point[i];
        curve->point[i] = curve->point[j];
        curve->point[j] = p;
    }
}

groom_status curve_fasten(struct curve *curve, const struct groom_scalp_region *region, const struct stretch *stretch, double most,
                          const char *pointer, struct groom_diag *diag)
{
    struct vec ends[2] = {stretch->smooth[0], stretch->smooth[stretch->n - 1]}, pull[2];
    struct vec first = curve->point[0], last = curve->point[curve->n - 1];
    double along = vec_length(vec_sub(first, ends[0])) + vec_length(vec_sub(last, ends[1]));
    double against = vec_length(vec_sub(first, ends[1])) + vec_length(vec_sub(last, ends[0]));
    int reversed = against < along;
    char field[64];
    snprintf(field, sizeof field, "%s/points", pointer);
    curve->reversed = reversed;
    if (reversed)
        reverse(curve);
    for (int end = 0; end < 2; end++) {
        pull[end] = vec_sub(ends[end], curve->point[end ? curve->n - 1 : 0]);
        if (vec_length(pull[end]) > most)
            return groom_fail_field(diag, GROOM_EINVAL, field, "the %s point of the hairline is %.1f cm from %s; at most %.0f cm are",
                                    end == reversed ? "first" : "last", 100 * vec_length(pull[end]),
                                    most > 0.025 ? (end ? "the scalp's edge at the right ear" : "the scalp's edge at the left ear")
                                                 : "the scalp's edge", 100 * most);
    }
    measure(curve);
    for (uint32_t i = 0; i < curve->n; i++) {
        double near = fmax(0, 1 - curve->arc[i] / FASTEN_OVER), far = fmax(0, 1 - (1 - curve->arc[i]) / FASTEN_OVER), off;
        struct vec p = vec_add(curve->point[i], vec_add(vec_scale(pull[0], near), vec_scale(pull[1], far)));
        if (!put_on_surface(region, p, &curve->point[i], &curve->normal[i], curve->u[i], &off))
            return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline leaves the head near its ends");
    }
    measure(curve);
    return GROOM_OK;
}

/* --- turning points ------------------------------------------------------------------------------------- */

/* A line by arc length, whether of the stretch or the curve. */
struct line {
    uint32_t n;
    const struct vec *point, *normal;
    const double *arc;
};

/* The place before `arc` and the fraction to the next. */
static uint32_t find_arc(const struct line *line, double arc, double *t)
{
    uint32_t low = 0, high = line->n - 1;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (line->arc[middle] <= arc)
            low = middle;
        else
            high = middle;
    }
    double span = line->arc[low + 1] - line->arc[low];
    *t = span > 0 ? fmin(fmax((arc - line->arc[low]) / span, 0), 1) : 0;
    return low;
}

static struct vec point_at(const struct line *line, double arc)
{
    double t;
    uint32_t i = find_arc(line, arc, &t);
    return vec_add(vec_scale(line->point[i], 1 - t), vec_scale(line->point[i + 1], t));
}

static struct vec normal_at(const struct line *line, double arc)
{
    double t;
    uint32_t i = find_arc(line, arc, &t);
    return vec_unit(vec_add(vec_scale(line->normal[i], 1 - t), vec_scale(line->normal[i + 1], t)));
}

/* The signed angle in the surface between the ways to and from the place at arc. */
static double turn_at(const struct line *line, double arc)
{
    struct vec p = point_at(line, arc), n = normal_at(line, arc);
    struct vec a = vec_sub(p, point_at(line, arc - TURN_WINDOW)), b = vec_sub(point_at(line, arc + TURN_WINDOW), p);
    a = vec_sub(a, vec_scale(n, vec_dot(a, n)));
    b = vec_sub(b, vec_scale(n, vec_dot(b, n)));
    return atan2(vec_dot(n, vec_cross(a, b)), vec_dot(a, b));
}

struct turn_list {
    uint32_t n;
    double arc[GROOM_HAIRLINE_MAX_TURNS], angle[GROOM_HAIRLINE_MAX_TURNS];
};

enum { TURN_SAMPLES = 240 };

/* The sharpest turns, apart from each other, in order. */
static void find_turns(const struct line *line, struct turn_list *list)
{
    double angle[TURN_SAMPLES + 1];
    int apart = (int)(TURN_APART * TURN_SAMPLES);
    list->n = 0;
    for (int i = 0; i <= TURN_SAMPLES; i++) {
        double arc = (double)i / TURN_SAMPLES;
        angle[i] = arc > 1.5 * TURN_WINDOW && arc < 1 - 1.5 * TURN_WINDOW ? turn_at(line, arc) : 0;
    }
    for (int i = 0; i <= TURN_SAMPLES && list->n < GROOM_HAIRLINE_MAX_TURNS; i++) {
        int sharpest = fabs(angle[i]) > LEAST_TURN;
        for (int j = i - apart < 0 ? 0 : i - apart; sharpest && j <= i + apart && j <= TURN_SAMPLES; j++)
            sharpest = j == i || (j < i ? fabs(angle[j]) < fabs(angle[i]) : fabs(angle[j]) <= fabs(angle[i]));
        if (!sharpest)
            continue;
        list->arc[list->n] = (double)i / TURN_SAMPLES;
        list->angle[list->n++] = angle[i];
    }
}

void turns_match(const struct stretch *stretch, const struct curve *curve, struct turns *turns)
{
    const struct line from = {stretch->n, stretch->smooth, stretch->normal, stretch->arc}, to = {curve->n, curve->point, curve->normal, curve->arc};
    struct turn_list a, b;
    uint32_t next = 0;
    find_turns(&from, &a);
    find_turns(&to, &b);
    turns->n = 0;
    for (uint32_t i = 0; i < a.n; i++) {
        uint32_t best = b.n;
        for (uint32_t j = next; j < b.n; j++)
            if (a.angle[i] * b.angle[j] > 0 && fabs(a.arc[i] - b.arc[j]) < TURN_SHIFT &&
                (best == b.n || fabs(a.arc[i] - b.arc[j]) < fabs(a.arc[i] - b.arc[best])))
                best = j;
        if (best == b.n)
            continue;
        turns->at[turns->n++] = (struct groom_hairline_turn){a.arc[i], b.arc[best]};
        next = best + 1;
    }
}

/* --- targets ------------------------------------------------------------------------------------------------ */

static double carry_arc(const struct turns *turns, double arc)
{
    struct groom_hairline_turn low = {0, 0}, high = {1, 1};
    for (uint32_t i = 0; i < turns->n; i++) {
        if (turns->at[i].from <= arc)
            low = turns->at[i];
        else {
            high = turns->at[i];
            break;
        }
    }
    return low.to + (high.to - low.to) * (arc - low.from) / (high.from - low.from);
}

/* The way of a line at arc, in the surface. */
static struct vec tangent_at(const struct line *line, double arc, struct vec normal)
{
    struct vec d = vec_sub(point_at(line, fmin(1, arc + 0.01)), point_at(line, fmax(0, arc - 0.01)));
    return vec_unit(vec_sub(d, vec_scale(normal, vec_dot(d, normal))));
}

groom_status curve_targets(const struct curve *curve, const struct groom_scalp_region *region, const struct stretch *stretch,
                           const struct turns *turns, double keep, double (*u)[2], const char *pointer, struct groom_diag *diag)
{
    const struct line from = {stretch->n, stretch->smooth, stretch->normal, stretch->arc}, to = {curve->n, curve->point, curve->normal, curve->arc};
    for (uint32_t i = 0; i < stretch->n; i++) {
        double arc = carry_arc(turns, stretch->arc[i]), off;
        struct vec n = stretch->normal[i], t = tangent_at(&from, stretch->arc[i], n), beside = vec_sub(stretch->point[i], stretch->smooth[i]);
        struct vec m = normal_at(&to, arc), s = tangent_at(&to, arc, m), p = point_at(&to, arc), point, normal;
        p = vec_add(p, vec_scale(s, keep * vec_dot(beside, t)));
        p = vec_add(p, vec_scale(vec_cross(m, s), keep * vec_dot(beside, vec_cross(n, t))));
        if (!put_on_surface(region, p, &point, &normal, u[i], &off)) {
            char field[64];
            snprintf(field, sizeof field, "%s/points", pointer);
            return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline leaves the head");
        }
    }
    return GROOM_OK;
}

/* --- crossings ------------------------------------------------------------------------------------------------ */

static double side_of(const double a[2], const double b[2], const double p[2])
{
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
}

int segments_cross(const double a[2], const double b[2], const double c[2], const double d[2])
{
    return side_of(a, b, c) * side_of(a, b, d) < 0 && side_of(c, d, a) * side_of(c, d, b) < 0;
}

int line_surrounds(const double (*line)[2], uint32_t n, const double p[2])
{
    int inside = 0;
    for (uint32_t i = 0, j = n - 1; i < n; j = i++)
        if ((line[i][1] > p[1]) != (line[j][1] > p[1]) &&
            p[0] < line[i][0] + (p[1] - line[i][1]) * (line[j][0] - line[i][0]) / (line[j][1] - line[i][1]))
            inside ^= 1;
    return inside;
}

int line_crosses_itself(const double (*u)[2], uint32_t n, int closed, uint32_t *first, uint32_t *second)
{
    uint32_t n_segments = closed ? n : n - 1;
    for (uint32_t i = 0; i < n_segments; i++)
        for (uint32_t j = i + 2; j < n_segments; j++) {
            if (closed && i == 0 && j == n - 1)
                continue;
            if (!segments_cross(u[i], u[(i + 1) % n], u[j], u[(j + 1) % n]))
                continue;
            *first = i;
            *second = j;
            return 1;
        }
    return 0;
}
