/* The drawn curve on the head, and where it sends the boundary: h(X) of Eq. 15. */
#ifndef RETARGET_HAIRLINE_CURVE_H
#define RETARGET_HAIRLINE_CURVE_H

#include "retarget/region.h"

/* A smooth curve through the drawn points, in the surface. */
struct curve {
    uint32_t n;
    struct vec *point, *normal; /* [n] */
    double (*u)[2];             /* [n] parameters in the patch */
    double *arc;                /* [n] 0..1 */
    double length;              /* metres */
    int reversed;               /* by curve_fasten: the drawn points run the other way */
    uint32_t capacity;
    const struct groom_allocator *allocator;
};

/* Centripetal Catmull-Rom through the points, every two millimetres brought to the surface; closed where the last
 * point is the first again.
 * pointer  of the curve in the hairline's JSON, "" or "/curves/1"
 * returns  GROOM_OK; GROOM_EINVAL: a point that leaves the head, a curve of no length, one that crosses
 *          itself; GROOM_ENOMEM; finish it in any case */
GROOM_MUST_CHECK groom_status curve_init(struct curve *curve, const struct groom_scalp_region *region,
                                         const struct groom_hairline_curve *drawn, const char *pointer, struct groom_diag *diag);
void curve_finish(struct curve *curve); /* takes what is zeroed */

/* Draw the curve's ends to those of the stretch, the pull fading over a sixth of it, and run it the same way.
 * returns  GROOM_OK, or GROOM_EINVAL where an end is farther than `most` metres from it */
GROOM_MUST_CHECK groom_status curve_fasten(struct curve *curve, const struct groom_scalp_region *region,
                                           const struct stretch *stretch, double most, const char *pointer, struct groom_diag *diag);

/* Turning points of both lines that are each other's: those of the drawing, or found and matched. */
struct turns {
    uint32_t n;
    struct groom_hairline_turn at[GROOM_HAIRLINE_MAX_TURNS];
};
void turns_match(const struct stretch *stretch, const struct curve *curve, struct turns *turns);

/* Where the stretch's vertices go: on to the curve, evenly between turns, each keeping `keep` of its place beside the line.
 * u        [stretch->n] parameters
 * returns  GROOM_OK, or GROOM_EINVAL where a vertex leaves the patch */
GROOM_MUST_CHECK groom_status curve_targets(const struct curve *curve, const struct groom_scalp_region *region,
                                            const struct stretch *stretch, const struct turns *turns, double keep, double (*u)[2],
                                            const char *pointer, struct groom_diag *diag);

/* Whether segments p..p+1 of an open or closed line in the plane cross. first, second: two that do
 * returns  1 or 0 */
int line_crosses_itself(const double (*u)[2], uint32_t n, int closed, uint32_t *first, uint32_t *second);
/* Whether p is within a closed line, by the even-odd rule. */
int line_surrounds(const double (*line)[2], uint32_t n, const double p[2]);
int segments_cross(const double a[2], const double b[2], const double c[2], const double d[2]);

#endif
