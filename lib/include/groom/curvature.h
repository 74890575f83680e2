/* Curvature space: strands as super-helices, chains of helical elements.
 *
 * Shi et al. 2026, "Curvature Space Editing of Highly-Coiled Hair". A super-helix is a root point,
 * a root material frame [t u v] and, for each element, a length l and a constant local Darboux
 * vector q = (twist, curvature 1, curvature 2) in the material frame. The frame turns with
 * Omega = F q, so that curvature q_1 turns about u and q_2 about v; |(q_1, q_2)| is the curve's
 * curvature and the twist is its torsion. q does not change when the strand is moved or turned.
 *
 * Lengths are metres (q: 1/metre), double precision. Every function gives the same bits for any
 * pool. Numbers that are not finite are refused with GROOM_EINVAL before anything is written. */
#ifndef GROOM_CURVATURE_H
#define GROOM_CURVATURE_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/strands.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- the representation --------------------------------------------------- */

/* Strands one after the other: the elements of strand i are first[i] .. first[i+1] - 1. */
struct groom_superhelices {
    uint32_t n_strands;
    uint32_t n_elements;  /* of all strands together */
    uint32_t *first;      /* [n_strands + 1]; first[0] = 0, first[n_strands] = n_elements */
    double (*root)[3];    /* [n_strands] */
    double (*frame)[3][3];/* [n_strands]; frame[i][0] is the tangent t, then u, v: orthonormal, right-handed */
    double *length;       /* [n_elements], 0 or more */
    double (*q)[3];       /* [n_elements] twist, curvatures: 1/metre */
    const struct groom_allocator *allocator; /* owns the arrays */
};

/* Room for so many; the counts are set, first[0] = 0, the rest is uninitialised. Owned by the caller.
 * returns  GROOM_OK, GROOM_ETOOBIG (more than 2^32-1 elements), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_superhelices_create(uint64_t n_strands, uint64_t n_elements,
                                                        const struct groom_context *context,
                                                        struct groom_superhelices **helices,
                                                        struct groom_diag *diag);
void groom_superhelices_destroy(struct groom_superhelices *helices); /* takes NULL */

/* A copy of its own. returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_superhelices_copy(const struct groom_superhelices *helices,
                                                      const struct groom_context *context,
                                                      struct groom_superhelices **copy,
                                                      struct groom_diag *diag);

/* Is it what it says? Offsets rise, every strand has an element, every number is finite, lengths are
 * not negative, frames are orthonormal to 1e-6. All functions below rely on it; call it on what
 * came from outside.
 * returns  GROOM_OK, GROOM_EINVAL with the strand in diag */
GROOM_MUST_CHECK groom_status groom_superhelices_check(const struct groom_superhelices *helices,
                                                       struct groom_diag *diag);

/* The arc length of one strand. */
double groom_superhelix_length(const struct groom_superhelices *helices, uint32_t strand);

/* --- back to points (Eqs. 2-8) --------------------------------------------- */

/* Points of one strand at n arc lengths, in any order; rising is fastest. Outside 0..length they
 * are clamped. A station on a junction belongs to the next element.
 * frames   [n][3][3] as in the struct, or NULL */
void groom_superhelix_sample(const struct groom_superhelices *helices, uint32_t strand,
                             const double *arc, uint32_t n, double (*points)[3],
                             double (*frames)[3][3]);

/* Every strand at n_vertices points, uniform in arc length, root and tip among them.
 * out      [n_strands][n_vertices][3], allocated by the caller
 * returns  GROOM_OK, GROOM_EINVAL (n_vertices < 2) */
GROOM_MUST_CHECK groom_status groom_superhelices_sample(const struct groom_superhelices *helices,
                                                        uint32_t n_vertices, float (*out)[3],
                                                        const struct groom_context *context,
                                                        struct groom_diag *diag);

/* Every strand at stations of its own.
 * first    [n_strands + 1] where each strand's stations begin
 * at       [first[n_strands]] fractions 0..1 of the strand's arc length
 * out      [first[n_strands]][3] */
GROOM_MUST_CHECK groom_status groom_superhelices_sample_at(const struct groom_superhelices *helices,
                                                           const uint32_t *first, const float *at,
                                                           float (*out)[3],
                                                           const struct groom_context *context,
                                                           struct groom_diag *diag);

/* --- from points (Section 3.5) ----------------------------------------------- */

struct groom_conversion_options {
    uint32_t n_elements;   /* of every strand; 0: as few as reach the tolerance */
    uint32_t min_elements; /* where they are chosen */
    uint32_t max_elements; /* where they are chosen; 0: two to a segment */
    double tolerance_m;    /* distance of the curve from a vertex, at most; 0: 1 % of the strand's mean segment */
    uint32_t refinements;  /* least-squares steps where the closed form misses the tolerance; 0: none */
};

/* Elements chosen (at least 6, and 3.5 a turn of the polyline), 1 % of a segment, up to 12 steps. */
struct groom_conversion_options groom_conversion_options_default(void);

/* How well one strand was met. */
struct groom_conversion_report {
    float error_max_m, error_rms_m; /* distance of each vertex from its place on the curve */
    float length_change;            /* of the polyline through those places, as a fraction */
    uint32_t n_elements;
    uint32_t n_flips;               /* changes of handedness, where elements were made to begin */
    uint32_t degenerate;            /* 1: no length; one straight element of length 0 stands for it */
};

/* Super-helices and the way back: the station of each vertex along its strand. */
struct groom_conversion {
    struct groom_superhelices *helices;
    uint32_t n_strands, n_vertices;
    uint32_t *first;  /* [n_strands + 1] of the strands that were converted */
    float *at;        /* [n_vertices] 0..1: groom_superhelices_sample_at(helices, first, at, ...) gives the strands again */
    struct groom_conversion_report *reports; /* [n_strands] */
    const struct groom_allocator *allocator;
};

/* Polylines to super-helices: a C2 spline, point-tangents at the element breaks moved until every pair
 * is co-helical (Derouet-Jourdan et al. 2013a), one closed-form helix a pair; where that misses the
 * tolerance, least squares on all vertices (curvatures, lengths and root frame; the root stays), which
 * is also what makes noise harmless: ask for fewer elements than vertices, or a tolerance above the
 * noise. Breaks are uniform in arc length, and moved to where handedness flips; as soon as there would
 * be as many elements as segments, they are the vertices.
 * The root frame is Eq. 9's with k the axis farthest from the tangent.
 * strands  borrowed; vertices finite
 * returns  GROOM_OK, GROOM_EINVAL (a vertex is not finite; a strand has no vertex; options), GROOM_ENOMEM
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_strands_convert(const struct groom_strands *strands,
                                                    const struct groom_conversion_options *options,
                                                    const struct groom_context *context,
                                                    struct groom_conversion **conversion,
                                                    struct groom_diag *diag);
void groom_conversion_destroy(struct groom_conversion *conversion); /* takes NULL */

/* --- sculpt (Section 5) --------------------------------------------------------- */

/* A control point and where it should go. */
struct groom_anchor {
    uint32_t strand;
    double at;          /* 0..1 of the strand's arc length */
    double position[3]; /* metres */
};

struct groom_sculpt_options {
    double stiffness;        /* N c of Eq. 15 (metre^4, N the strand's elements): how little curvature may change */
    uint32_t max_iterations; /* of the first attempt */
    uint32_t n_roads;        /* for strands that are not done then: 0 leave them; 1 go on, up to ten times as
                                many; 2, 3 come again from the start by smaller turns, and keep the best */
    uint32_t max_tail;       /* of a plain L-BFGS, for what still goes downhill after all that */
    double tolerance;        /* stop where a step promises less than this share of the energy */
    double most_turning;     /* radians that one step may turn a strand, over its length */
};

/* 30 iterations, 3 roads (a drag in progress can do with 0), a tail of 200, 1e-8, 1.5 rad; stiffness of the paper's c = 10 at 45 elements. */
struct groom_sculpt_options groom_sculpt_options_default(void);

/* The paper's c is in cm^4 and grows with the count of elements; the stiffness here is c N, so that a
 * slider means the same at any count. groom_sculpt_stiffness(10, 45) is the paper's c = 10 with 45. */
double groom_sculpt_stiffness(double c_cm4, uint32_t n_elements);

typedef enum groom_sculpt_end {
    GROOM_SCULPT_UNTOUCHED = 0, /* no anchor on this strand */
    GROOM_SCULPT_CONVERGED,
    GROOM_SCULPT_STOPPED        /* the iterations ran out while it still went downhill */
} groom_sculpt_end;

struct groom_sculpt_outcome {
    groom_sculpt_end end;
    uint32_t iterations;                 /* tail included */
    double energy_before, energy_after;  /* Eq. 15, metre^2; after is never more than before */
    double anchor_error_max_m, anchor_error_mean_m; /* what the anchors still miss by */
};

/* Change curvatures so that control points go to their anchors while the rest keeps its shape (Eq. 15);
 * lengths, roots and root frames stay exactly. Strands without anchors are left alone.
 * helices   q is where the solver starts, and the result; untouched on error
 * rest_q    [n_elements][3] the shape to keep (q_0); NULL: helices->q as it is at the call. With it a
 *           drag starts each time from the last result.
 * outcomes  [n_strands], or NULL
 * returns   GROOM_OK, GROOM_EINVAL (an anchor off its strand or not finite: diag points to /anchors/i/...;
 *           options), GROOM_ENOMEM, GROOM_ECANCELLED
 * threads   deterministic for any pool and any instruction set */
GROOM_MUST_CHECK groom_status groom_superhelices_sculpt(struct groom_superhelices *helices,
                                                        const double (*rest_q)[3],
                                                        const struct groom_anchor *anchors, size_t n_anchors,
                                                        const struct groom_sculpt_options *options,
                                                        const struct groom_context *context,
                                                        struct groom_sculpt_outcome *outcomes,
                                                        struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
