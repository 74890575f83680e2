/* Curvature space: strands as super-helices, chains of helical elements.
 *
 * Shi et al. 2026, "Curvature Space Editing of Highly-Coiled Hair". A super-helix is a root point,
 * a root material frame [t u v] and, for each element, a length l and a constant local Darboux
 * vector q = (twist, curvature 1, curvature 2) in the material frame. The frame turns with
 * Omega = F q, so that curvature q_1 turns about u and q_2 about v; |(q_1, q_2)| is the curve's
 * curvature and the twist is its torsion. q does not change when the strand is moved or turned.
 *
 * Lengths are metres (q: 1/metre), double precision throughout: there is no single-precision solver and so no
 * single-precision gradient; float32 is what vertices are read and written as. tests/unit/test_sculpt.c holds
 * the gradient of Eq. 15 against finite differences and the vectors. Every function gives the same bits for any
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
    uint32_t n_roads;        /* for strands that took more than a third of them: 0 leave them; 1 go on, up to ten
                                times as many; 2 come again from the start by smaller turns; 3 and again by falling
                                stiffness; the best is kept */
    uint32_t max_tail;       /* of a plain L-BFGS, for what still goes downhill after all that */
    double tolerance;        /* stop where a step promises less than this share of the energy */
    double most_turning;     /* radians that one step may turn a strand, over its length */
};

/* 30 iterations, 3 roads, a tail of 200, 1e-8, 1.5 rad (a drag in progress can do with 0 roads and 1e-5); stiffness of the paper's c = 10 at 45 elements. */
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

/* --- armatures (Section 5.3) --------------------------------------------------------------- */

#define GROOM_CLUSTERS_MOST 1024
#define GROOM_CLUSTER_FRAMES_MOST 64 /* of each cluster */

/* Strands by cluster: those of cluster k are strands[first[k]] .. strands[first[k+1] - 1], rising. */
struct groom_clusters {
    uint32_t n_clusters, n_strands;
    uint32_t *of_strand; /* [n_strands] */
    uint32_t *first;     /* [n_clusters + 1] */
    uint32_t *strands;   /* [n_strands] */
    const struct groom_allocator *allocator;
};

/* K-means over root and tip. Exactly `count` clusters; some are empty only where strands begin and end
 * at fewer than `count` places. Of the polylines alone, so that they do not depend on how these are
 * converted.
 * returns  GROOM_OK, GROOM_EINVAL (diag points to /clusters/count: 1..GROOM_CLUSTERS_MOST, and no more than
 *          strands; a strand without vertices or a root or tip that is not finite), GROOM_ENOMEM, GROOM_ECANCELLED
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_strands_cluster(const struct groom_strands *strands, uint32_t count, uint64_t seed,
                                                    const struct groom_context *context,
                                                    struct groom_clusters **clusters, struct groom_diag *diag);
void groom_clusters_destroy(struct groom_clusters *clusters); /* takes NULL */

/* A joint of a cluster's armature: where its strands are at one fraction of their arc length. */
struct groom_cluster_frame {
    double at;         /* 0..1 */
    double origin[3];  /* the mean of the cluster's points there, metres */
    double axes[3][3]; /* rows, right-handed: along the mean strand; then the principal directions of the points across
                          it, turned as little as may be from joint to joint */
    double extent[3];  /* standard deviation of the points along each axis, metres */
};

/* The frames of every cluster, for drawing and for moving. An empty cluster's are at the origin with
 * the world's axes and no extent. Points are those of the polylines: what a client does with a frame
 * reaches the solver as an affine map (below), which does not depend on them.
 * at       [n_frames] 0..1, rising; at most GROOM_CLUSTER_FRAMES_MOST
 * frames   [n_clusters][n_frames], the caller's
 * returns  GROOM_OK, GROOM_EINVAL (an `at` outside 0..1 or not rising; strands that the clusters are not of), GROOM_ENOMEM
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_clusters_frames(const struct groom_clusters *clusters,
                                                    const struct groom_strands *strands, const double *at,
                                                    uint32_t n_frames, const struct groom_context *context,
                                                    struct groom_cluster_frame *frames, struct groom_diag *diag);

/* The affine map that takes one oriented frame to another: what a client that moves frames computes. */
void groom_frame_map(const struct groom_cluster_frame *from, const struct groom_cluster_frame *to, double map[3][4]);

/* One frame that was moved: the control points of its cluster at that arc length go where the map takes them. */
struct groom_frame_move {
    uint32_t cluster;
    double at;        /* 0..1 of each strand's arc length */
    double map[3][4]; /* x' = map[.][0..2] x + map[.][3]; metres */
};

struct groom_anchors {
    size_t n;
    struct groom_anchor *anchor; /* [n], by move, then by strand */
    const struct groom_allocator *allocator;
};

/* Anchors for groom_superhelices_sculpt. Strands of no length cannot follow and get none.
 * helices  the shapes that the maps apply to: at rest, not the last result of a drag
 * returns  GROOM_OK, GROOM_EINVAL (diag points to /frames/i/cluster: there is no such cluster, or it is empty;
 *          /frames/i/at; /frames/i/transform: a number that is not finite, or one that takes a point beyond what
 *          can be counted; helices that the clusters are not of), GROOM_ENOMEM
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_clusters_move(const struct groom_clusters *clusters,
                                                  const struct groom_superhelices *helices,
                                                  const struct groom_frame_move *moves, size_t n_moves,
                                                  const struct groom_context *context,
                                                  struct groom_anchors **anchors, struct groom_diag *diag);
void groom_anchors_destroy(struct groom_anchors *anchors); /* takes NULL */

/* --- analysis (Section 4) --------------------------------------------------------- */

struct groom_analysis_options {
    uint32_t n_samples;     /* of each centre curve, uniform in arc length; 3 or more */
    uint32_t n_bins;        /* Fourier bins of the segment vectors that it keeps, the constant one counted; 1..8 */
    double straight_below;  /* turns per metre of arc under which hair is straight */
    double wavy_below;      /* |beta| under which it winds in a plane, not round an axis */
    double switchback_turn; /* radians of winding on either side that make a change of handedness one */
};

/* 65 samples, 3 bins, 5 turns per metre, |beta| 0.5, half a turn. */
struct groom_analysis_options groom_analysis_options_default(void);

typedef enum groom_hair_kind { GROOM_HAIR_STRAIGHT = 0, GROOM_HAIR_WAVY, GROOM_HAIR_COILED } groom_hair_kind;

/* One element as a helix (Eqs. 12-14; the paper's omega is radians per metre of axis). */
struct groom_element_shape {
    float radius_m;    /* kappa / |Omega|^2; 0 where straight */
    float step_m;      /* rise of a turn, signed: 2 pi tau / |Omega|^2; 0 where |Omega| is 0 */
    float frequency;   /* turns per metre of arc: |Omega| / 2 pi */
    float omega;       /* |Omega|^2 / tau, signed; INFINITY where there is no torsion */
    float beta;        /* at the element's middle: c'/|c'| . Omega/|Omega|; 0 where |Omega| is 0 */
    int8_t hand;       /* sign of the torsion: 1 right, -1 left, 0 none */
    uint8_t kind;      /* groom_hair_kind */
};

/* Where a strand changes handedness: winding goes on by switchback_turn on both sides. */
struct groom_switchback {
    uint32_t strand, element; /* the first element of the new hand */
    float at;                 /* 0..1 of the strand's arc length, where that element begins */
};

#define GROOM_HISTOGRAM_BINS 32
struct groom_histogram {
    double low, high;                    /* 98 % of all weight lie below high; what lies above is in the last bin */
    double weight[GROOM_HISTOGRAM_BINS]; /* metres of hair, or strands; see below */
};

struct groom_analysis {
    uint32_t n_strands, n_elements, n_samples, n_switchbacks;
    uint32_t *first;                      /* [n_strands + 1] as in the super-helices */
    struct groom_element_shape *elements; /* [n_elements] */
    float (*centre)[3];                   /* [n_strands][n_samples] centre curves */
    float *turns;                         /* [n_strands] sum of |Omega| l / 2 pi */
    struct groom_switchback *switchbacks; /* [n_switchbacks], strand by strand */
    struct {
        double length_m;                  /* of all strands */
        double share[3];                  /* of that length, by groom_hair_kind */
        double share_hand[3];             /* of coiled and wavy length: left, none, right */
        double radius_mean_m;             /* over coiled and wavy length */
        double frequency_mean;            /* turns per metre, over coiled and wavy length */
        double turns_mean;                /* of a strand */
        struct groom_histogram radius;    /* metres; weight: coiled and wavy length */
        struct groom_histogram frequency; /* turns per metre; weight: coiled and wavy length */
        struct groom_histogram turns;     /* turns of a strand; weight: strands */
    } summary;
    const struct groom_allocator *allocator;
};

/* returns  GROOM_OK, GROOM_EINVAL (options), GROOM_ENOMEM
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_superhelices_analyze(const struct groom_superhelices *helices,
                                                         const struct groom_analysis_options *options,
                                                         const struct groom_context *context,
                                                         struct groom_analysis **analysis,
                                                         struct groom_diag *diag);
void groom_analysis_destroy(struct groom_analysis *analysis); /* takes NULL */

/* The element under each of a strand's stations, for colouring vertices: element indices into
 * analysis->elements.
 * first, at, out  as in groom_superhelices_sample_at */
void groom_superhelices_elements_at(const struct groom_superhelices *helices, const uint32_t *first,
                                    const float *at, uint32_t *out, const struct groom_context *context);

/* --- edits (Section 4.3) -------------------------------------------------------------- */

/* Another k in Eq. 9 turns (kappa_1, kappa_2) of a whole strand without changing its curve. Before
 * strands are mixed their gauges must agree: the angle by which b's curvatures must be turned to lie
 * nearest a's (least squares over both lengths). */
double groom_superhelix_gauge(const struct groom_superhelices *a, uint32_t strand_a,
                              const struct groom_superhelices *b, uint32_t strand_b);
/* Turn a strand's gauge: frame and curvatures, not the curve. */
void groom_superhelix_turn_gauge(struct groom_superhelices *helices, uint32_t strand, double angle);

struct groom_ruffle_options {
    double rho;              /* 0..1: chance of an element to be replaced */
    uint32_t match_elements; /* so many from the root stay: what is changed there swings the whole strand */
    double blend;            /* 0..1: how far from the strand's own to the replaced curvature */
    uint64_t seed;
    uint32_t stream;         /* the use: another operator of the chain draws other numbers */
    const uint32_t *group;   /* [n_strands] below n_groups: elements come from the same group; NULL: all are one */
    uint32_t n_groups;
};

/* Ruffling (4.3.1): each element past the first few is replaced, with chance rho, by the element of the
 * same index of a strand drawn from its group (its length with it), gauges aligned. What a strand draws
 * depends on seed, stream and its index alone.
 * returns  GROOM_OK, GROOM_EINVAL (diag points to /rho, /blend or /groups), GROOM_ENOMEM
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_superhelices_ruffle(const struct groom_superhelices *helices,
                                                        const struct groom_ruffle_options *options,
                                                        const struct groom_context *context,
                                                        struct groom_superhelices **ruffled,
                                                        struct groom_diag *diag);

/* For each strand of a, the strand of b whose root is nearest (ties: the lower index).
 * partner  [a->n_strands], the caller's
 * returns  GROOM_OK, GROOM_EEMPTY (b has no strands), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_superhelices_match_roots(const struct groom_superhelices *a,
                                                             const struct groom_superhelices *b,
                                                             const struct groom_context *context,
                                                             uint32_t *partner, struct groom_diag *diag);

/* Strands between those of a (t = 0) and their partners in b (t = 1): roots on a line, frames by the
 * shortest turn, lengths and curvatures linearly, gauges aligned. Where the two divide a strand
 * differently, the result has the breaks of both, so that either end is exact.
 * partner  [a->n_strands] strands of b; NULL: the same index
 * returns  GROOM_OK, GROOM_EINVAL (t outside 0..1 or a partner that is not there), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_superhelices_interpolate(const struct groom_superhelices *a,
                                                             const struct groom_superhelices *b,
                                                             const uint32_t *partner, double t,
                                                             const struct groom_context *context,
                                                             struct groom_superhelices **between,
                                                             struct groom_diag *diag);

typedef enum groom_curl_keep {
    GROOM_CURL_KEEP_LENGTH = 0, /* the number of turns changes */
    GROOM_CURL_KEEP_TURNS       /* the length changes */
} groom_curl_keep;

struct groom_curl_scale_options {
    double radius, step;     /* factors, above 0: of each helix's radius and of its rise a turn */
    groom_curl_keep keep;
    double ramp[2];          /* 0..1 how much of the change at root and tip: {1, 1} is all of it everywhere */
    const float *weight;     /* [n_strands] 0..1 of each strand's share of the change, or NULL: all of it */
    double largest_radius_m; /* bends wider than this are not curls and stay; 0: all are */
    int hold_direction;      /* turn each strand about its root so that its tip lies where it lay, as seen from there */
};

/* Factors of 1, length kept, no ramp, direction held. */
struct groom_curl_scale_options groom_curl_scale_options_default(void);

/* Expand or shrink curls in place.
 * returns  GROOM_OK, GROOM_EINVAL (diag points to /radius, /step, /ramp or /weight); untouched on error
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_superhelices_scale_curls(struct groom_superhelices *helices,
                                                             const struct groom_curl_scale_options *options,
                                                             const struct groom_context *context,
                                                             struct groom_diag *diag);

/* --- contact --------------------------------------------------------------------------- */

struct groom_bvh;

struct groom_contact_options {
    uint32_t n_samples;  /* stations a strand, from root_share of its length to the tip */
    uint32_t max_rounds; /* of pushing and solving again; 0: only report */
    double root_share;   /* the part next to the root that may touch */
    double margin_m;     /* how far outside a pushed station should come to lie */
};

/* 32 stations, 8 rounds, the first 5 % spared, 1 mm. */
struct groom_contact_options groom_contact_options_default(void);

#define GROOM_CONTACT_MOST_HELD 6

struct groom_contact_report {
    uint32_t checked;                    /* 1: this strand had anchors */
    float depth_before_m, depth_after_m; /* how far below the surface at most, beyond where it lay at rest */
    uint32_t n_held;                     /* the further anchors that this strand got */
    struct {
        float at;                        /* 0..1 of its arc length */
        float position[3];
    } held[GROOM_CONTACT_MOST_HELD];
};

/* After a sculpt: strands with anchors that went into the head (a mesh with outward normals) get further
 * anchors that hold their deepest stations outside, and are solved again with the caller's, up to
 * max_rounds times, each time from rest: the result depends on the anchors alone, and the best of all rounds
 * is kept. What lay below the surface at rest may stay as deep. What could not be brought out
 * is told by depth_after_m.
 * helices   the sculpt's result; q changes, lengths, roots and frames do not; untouched on error
 * rest_q    [n_elements][3] the shape before the sculpt
 * anchors   the sculpt's
 * reports   [n_strands], the caller's
 * returns   GROOM_OK, GROOM_EINVAL, GROOM_ENOMEM, GROOM_ECANCELLED
 * threads   deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_superhelices_push_out(struct groom_superhelices *helices,
                                                          const double (*rest_q)[3],
                                                          const struct groom_anchor *anchors, size_t n_anchors,
                                                          const struct groom_bvh *bvh,
                                                          const struct groom_contact_options *options,
                                                          const struct groom_sculpt_options *sculpt,
                                                          const struct groom_context *context,
                                                          struct groom_contact_report *reports,
                                                          struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
