/* A mesh that is deformed on to another: as rigid as possible, pulled by anchors and nearest points. */
#ifndef RETARGET_REGISTRATION_H
#define RETARGET_REGISTRATION_H

#include "groom/correspondence.h"
#include "groom/spatial.h"
#include "retarget/surface.h"

struct cholesky;

/* A point of the source's surface that is pulled to a place. */
struct anchor {
    uint32_t vertex[3]; /* of the sheet */
    double barycentric[3];
    struct vec target;
};

struct registration {
    struct surface surface;       /* of the source */
    struct sheet sheet;           /* all of it */
    const struct groom_mesh *target;
    struct groom_bvh *bvh;        /* of the target */
    unsigned char *edge;          /* [target vertices] on a boundary of it */
    uint32_t n_anchors;
    struct anchor *anchors;       /* [n_anchors], the caller's */
    double *laplacian;            /* [row_first[n]] cotangent weights of sides, positive; 0 on the diagonal */
    double *area;                 /* [n] of each vertex over the mean */
    double side;                  /* mean length of sides at the start, metres */
    struct vec *rest, *position;  /* [n] */
    struct vec *goal;             /* [n] nearest point, or where the vertex is */
    unsigned char *matched;       /* [n] whether goal is a point of the target */
    double (*rotation)[3][3];     /* [n] */
    double *value, *x;            /* [row_first[n]], [3 n] */
    float (*query)[3];            /* [n] */
    struct groom_surface_point *nearest; /* [n] */
    struct vec *normal;           /* [n] */
    struct cholesky *factor;
    uint32_t iterations;
    const struct groom_allocator *allocator;
};

/* position = map of the source's vertices (3 x 4, rows) as the shape at rest.
 * returns  GROOM_OK, GROOM_ENOMEM and what groom_bvh_create answers; finish it in any case */
GROOM_MUST_CHECK groom_status registration_init(struct registration *registration, const struct groom_mesh *source,
                                                const struct groom_mesh *target, const struct groom_context *context,
                                                struct groom_diag *diag);
void registration_finish(struct registration *registration); /* takes what is zeroed */
void registration_map(struct registration *registration, const double map[3][4]);

/* Iterations with one stiffness: `length` (metres) is what stays rigid, anchors pull `pull` times as hard as that
 * resists; nearest points within `reach` pull. Then the shape at rest follows.
 * returns  GROOM_OK, GROOM_EDEGENERATE, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status registration_step(struct registration *registration, double length, double pull, double reach,
                                                uint32_t iterations, const struct groom_context *context,
                                                struct groom_diag *diag);

/* Put vertices on to the nearest points of the target within `reach`, but for those whose triangles that would fold. */
void registration_project(struct registration *registration, double reach, const struct groom_context *context);

/* Vertices of folded sides are eased to the mean of their neighbours, until none folds or 30 rounds are over. */
void registration_unfold(struct registration *registration);

/* A triangle's unit normal with the vertices at `points` [n]. */
struct vec registration_normal(const struct registration *registration, const struct vec *points, uint32_t triangle);
/* Whether two triangles meet at the side opposite to a corner at less than 60 degrees, and do not in the source. */
int registration_folds(const struct registration *registration, uint32_t triangle, int corner);

/* Whom each vertex meets now: goal and matched, of nearest points within reach. */
void registration_match(struct registration *registration, double reach, const struct groom_context *context);

#endif
