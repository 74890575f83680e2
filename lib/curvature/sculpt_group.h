/* Four strands under the sculpting kernel, lane by lane. */
#ifndef CURVATURE_SCULPT_GROUP_H
#define CURVATURE_SCULPT_GROUP_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "curvature/lanes.h"
#include "curvature/sculpt_lanes.h"

#include "curvature/element.h"

struct symmetric {
    real xx, xy, xz, yy, yz, zz;
};

/* What is known before an element, from the root on. Reals only. */
struct sculpt_passing {
    vec3 p;
    mat3 F;
    vec3 q;
    real ll, llpp;        /* sums over the elements before: l^2, l^2 |p|^2 */
    vec3 llp;             /* ... and l^2 p */
};

struct sculpt_anchor {
    real s;               /* along its element */
    lane_mask element;
    vec3 target;          /* relative to the root */
    struct sculpt_passing passing;
    vec3 x, r;            /* where it is, what it misses by */
    mat3 own;             /* derivative with respect to its own element's q */
};

/* Anchor `anchor` of lane `lane` lies on `element`; sorted by element. */
struct sculpt_event {
    uint32_t element, anchor, lane;
};

struct sculpt_group {
    uint32_t n, m;        /* the most elements and anchors in the queue; shorter strands are padded with
                             elements of no length and anchors at the root */
    mat3 root;            /* frames; root points are the origins */
    real c, least_energy; /* of each strand */
    real n_coordinates;   /* of each strand's own anchors: 3 each */
    real *length;         /* [n] */
    vec3 *q, *rest, *step, *trial, *own_step; /* [n] */
    mat3 *A, *U;          /* [n] */
    mat3 *gain_v, *gain_w;/* [n] how an element answers to what the elements before it move */
    struct sculpt_anchor *anchor; /* [m] */
    struct sculpt_event *event;   /* [4 m] */
    uint32_t n_events;
    /* how each lane stands */
    lane_mask active;     /* holds a strand that is not done */
    lane_mask fresh;      /* whose energy is not known yet */
    lane_mask converged;
    lane_mask curved;     /* takes second derivatives of the anchors into its next step */
    real energy, energy_before, iterations, mu, grow;
    /* the queue */
    const struct lane_input *in;
    struct lane_output *out;
    double (*const *result)[3];
    uint32_t n_in, next, strand[LANES]; /* UINT32_MAX: an empty lane */
    uint32_t max_elements, max_anchors;
    const struct groom_allocator *allocator;
};

/* Results of lanes that are not active go out, and the next strands come in. */
void sculpt_group_exchange(struct sculpt_group *group);

void sculpt_group_generic(struct sculpt_group *group, const struct sculpt_settings *settings);
#if defined(__x86_64__) && defined(__GNUC__)
void sculpt_group_avx2(struct sculpt_group *group, const struct sculpt_settings *settings);
#endif

#endif
