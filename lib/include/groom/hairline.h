/* The hairline and its edit: roots move within the head's surface (Yu et al., Section 6.1).
 *
 *     groom_scalp_region_create(mesh, roots, ...)      where hair grows: triangles, boundary, ears
 *     groom_hairline_parse(json, ...)                  what the artist draws
 *     groom_hairline_relocate(region, hairline, ...)   new places of the roots, and a report
 *
 * The region deforms as a neo-Hookean membrane that stays in the surface of the head, its boundary
 * carried from today's hairline to the drawn one. */
#ifndef GROOM_HAIRLINE_H
#define GROOM_HAIRLINE_H

#include <stddef.h>
#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"
#include "groom/skeleton.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- the scalp --------------------------------------------------------------------------- */

struct groom_scalp_region;

struct groom_scalp_region_options {
    float closing_m; /* gaps between roots up to twice this wide are scalp; 0: three times the roots' median spacing */
    float reach_m;   /* the edit may move the hairline this far over the head, metres; 0: 0.08 */
};

struct groom_scalp_region_report {
    uint32_t n_triangles, n_vertices, n_boundary; /* of the region; vertices of its boundary loop */
    uint32_t n_roots_outside;  /* beyond the region's one piece (a beard, strays): these do not move */
    float closing_m;           /* as taken */
    float ears[2][3];          /* left (+x) and right: the widest points of the head */
    double area;               /* square metres */
};

/* Find the scalp: triangles with a root in them, gaps closed, holes filled, the piece with the most
 * roots, without places where it hangs by one vertex.
 *
 * The boundary parts into front and back at the ears: the head's widest points to either side in the
 * upper two thirds of the head's bone.
 * mesh      borrowed until destroyed; right side out (groom/body.h), upright, the face towards +z
 * roots     [n] metres, on or near the surface; copied
 * skeleton  of the mesh: its bone "head", else the highest, tells where ears are; NULL: groom_skeleton_make
 * options   NULL: defaults
 * report    may be NULL
 * returns   GROOM_OK; GROOM_EINVAL (a root not finite, an option out of range); GROOM_EEMPTY (no root);
 *           GROOM_EDEGENERATE (the scalp has no boundary, or no room around it); GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_scalp_region_create(const struct groom_mesh *mesh, const float (*roots)[3], uint32_t n,
                                                        const struct groom_skeleton *skeleton,
                                                        const struct groom_scalp_region_options *options,
                                                        const struct groom_context *context,
                                                        struct groom_scalp_region **region,
                                                        struct groom_scalp_region_report *report, struct groom_diag *diag);
void groom_scalp_region_destroy(struct groom_scalp_region *region); /* takes NULL */

uint32_t groom_scalp_region_triangles(const struct groom_scalp_region *region, const uint32_t **triangles); /* of the mesh, ascending */
/* Today's front hairline, from the left ear to the right one, smoothed: what a studio shows to be dragged.
 * points    [n] n of them evenly spread over its length, n >= 2, on the surface */
void groom_scalp_region_front(const struct groom_scalp_region *region, uint32_t n, float (*points)[3]);

/* --- the edit ------------------------------------------------------------------------------- */

/* X(constant, name): which stretch of the boundary a curve takes the place of; the rest is held. */
#define GROOM_HAIRLINE_KIND_LIST(X)                                                                  \
    X(GROOM_HAIRLINE_FRONT,     "front")     /* from ear to ear over the forehead */                  \
    X(GROOM_HAIRLINE_SIDEBURNS, "sideburns") /* between the boundary points nearest to its ends, the shorter way */ \
    X(GROOM_HAIRLINE_BALDING,   "balding")   /* as front, and hair in front of the curve is not pushed together: see relocate */ \
    X(GROOM_HAIRLINE_CROWN,     "crown")     /* closed curves anywhere on the scalp, within which hair is given up */

typedef enum groom_hairline_kind {
#define GROOM_HAIRLINE_ENUM(constant, name) constant,
    GROOM_HAIRLINE_KIND_LIST(GROOM_HAIRLINE_ENUM)
#undef GROOM_HAIRLINE_ENUM
    GROOM_HAIRLINE_KIND_COUNT
} groom_hairline_kind;

/* How the displacement of the boundary spreads; all but the first are there for comparison (Table III).
 * X(constant, name) */
#define GROOM_RELOCATE_LIST(X)                                                                       \
    X(GROOM_RELOCATE_MEMBRANE,   "membrane")   /* Eqs. 15-19 */                                       \
    X(GROOM_RELOCATE_HARMONIC,   "harmonic")   /* a harmonic displacement in the head's parameters */ \
    X(GROOM_RELOCATE_THIN_PLATE, "thin_plate") /* a thin-plate spline there */

typedef enum groom_relocate_method {
#define GROOM_HAIRLINE_ENUM(constant, name) constant,
    GROOM_RELOCATE_LIST(GROOM_HAIRLINE_ENUM)
#undef GROOM_HAIRLINE_ENUM
    GROOM_RELOCATE_COUNT
} groom_relocate_method;

const char *groom_hairline_kind_name(groom_hairline_kind kind);
const char *groom_relocate_method_name(groom_relocate_method method);

#define GROOM_HAIRLINE_MAX_CURVES 4
#define GROOM_HAIRLINE_MAX_POINTS 512
#define GROOM_HAIRLINE_MAX_TURNS 16

struct groom_hairline_turn {
    double from, to; /* 0..1 of arc length along today's line and along the curve, from the curve's first point */
};

struct groom_hairline_curve {
    uint32_t n_points;                        /* 3.. : a smooth curve through them, on the surface */
    float points[GROOM_HAIRLINE_MAX_POINTS][3]; /* metres, within 3 cm of the surface */
    uint32_t n_turns;                         /* 0: turning points are found on both and matched */
    struct groom_hairline_turn turns[GROOM_HAIRLINE_MAX_TURNS]; /* ascending in both */
};

struct groom_hairline {
    groom_hairline_kind kind;
    groom_relocate_method method;
    uint32_t n_curves; /* 1; sideburns and crown: 1..GROOM_HAIRLINE_MAX_CURVES */
    struct groom_hairline_curve curves[GROOM_HAIRLINE_MAX_CURVES];
};

/* {"kind":"front","method":"membrane","points":[[x,y,z],...],"turns":[{"from":f,"to":t},...]}
 * with "curves":[{"points":...,"turns":...},...] in place of "points" and "turns" for several;
 * kind, method and turns may be left out.
 * returns  GROOM_OK, GROOM_EINVAL with a JSON pointer, GROOM_ENOMEM; *out is set only on success */
GROOM_MUST_CHECK groom_status groom_hairline_parse(const char *json, size_t n_bytes, struct groom_hairline *out,
                                                   struct groom_diag *diag);
/* The same form with everything filled in; malloc'd and ended by 0, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_hairline_print(const struct groom_hairline *hairline, char **json, struct groom_diag *diag);

struct groom_relocation_report {
    uint32_t load_steps, newton_iterations;
    double energy;        /* of the membrane at the end, over shear modulus times area; 0 for the other methods */
    /* Relative changes of density: roots per area of each of the region's triangles, which take their
     * roots along, so area before over area after, less 1. l1 is their mean, linf the largest (Table III). */
    double density_l1, density_linf;
    uint32_t n_flipped;   /* triangles turned over in the head's parameters; 0 for the membrane */
    double mean_move, max_move; /* of roots, metres */
    double boundary_error;      /* metres, at most, by which boundary vertices lie nearer to or farther from the
                                   curve than they did from today's line */
    uint32_t n_bald;      /* roots that balding gives up */
};

/* Move the roots.
 *
 * The boundary vertices of the stretch keep their place relative to today's smoothed line while that
 * goes over into the curve, turning point by turning point, evenly in arc length between. Roots keep
 * their barycentric coordinates in the deformed region, are projected on the head, and keep the
 * height above it that they had.
 * Balding: a receding line would push the hair behind it together; density is kept instead, by
 * leaving roots where they are and giving up those that the curve leaves outside (bald[i] = 1).
 *
 * Crown: likewise for the hair within closed curves; the last point leads back to the first, the boundary stays.
 *
 * roots_out  [n] of the roots that the region was made from, the caller's
 * bald       [n] 0 or 1, or NULL
 * density    [region triangles] relative change, for colouring, or NULL
 * report     may be NULL
 * returns    GROOM_OK; GROOM_EINVAL with a pointer: a curve that crosses itself or the boundary that
 *            is held, a point that leaves the head, a closed curve with no hair in it, ends that are not near the ears or the boundary,
 *            too few points; GROOM_EDEGENERATE where the scalp would fold; GROOM_ENOMEM, GROOM_ECANCELLED
 * threads    same bits for any pool */
GROOM_MUST_CHECK groom_status groom_hairline_relocate(const struct groom_scalp_region *region,
                                                      const struct groom_hairline *hairline,
                                                      const struct groom_context *context, float (*roots_out)[3],
                                                      unsigned char *bald, float *density,
                                                      struct groom_relocation_report *report, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
