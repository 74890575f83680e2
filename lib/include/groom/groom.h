/* The procedural groom: guides, instancing and a chain of operators.
 *
 * Chang et al. 2025, "Transforming Unstructured Hair Strands into Procedural
 * Hair Grooms", Eq. 1: x = P_theta(instance(g)). This is the struct behind the
 * groom document (groom/document.h) and all that evaluation needs.
 *
 * Everything is in metres, y up, root first. Every strand and every guide has
 * the same number of vertices m; where a groom is made of uploaded strands (its
 * base), each keeps the vertices that it has. */
#ifndef GROOM_GROOM_H
#define GROOM_GROOM_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/scalp.h"
#include "groom/strands.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- operators ------------------------------------------------------------ */

/* Two kinds stand in one chain: operators proper, which look at one strand at a time, and layers, which
 * look at whole dense strands in curvature space (groom/layers.h evaluates them).
 *
 * Operators follow Appendix A, in these conventions:
 * - lengths in metres throughout; operator guides are the undeformed guides, wherever in the chain;
 * - v_j is arc length over length: bend counts up to and with the segment, the others to the vertex;
 * - curl's phase is in turns; its frequencies are turns a metre of arc (the paper's 3 omega);
 * - clump blends vertex j with the operator guide's vertex j;
 * - frizz: model/noise.h defines the noise, its hash and the offsets of the axes, once and for all;
 * - segments below 1e-12 m have no direction: a guide's is taken as +y there, derivatives as 0.
 * Which random numbers each draws, and for how many:
 * X(constant, name in documents, number of random arrays, drawn for each operator guide (1) or strand (0),
 *   whether it needs operator guides, which a groom made of uploaded strands has not) */
#define GROOM_OPERATOR_LIST(X)                                                                     \
    X(GROOM_OPERATOR_SCALE, "scale", 1, 0, 0)                                                      \
    X(GROOM_OPERATOR_BEND,  "bend",  1, 0, 1)                                                      \
    X(GROOM_OPERATOR_CURL,  "curl",  2, 1, 1)                                                      \
    X(GROOM_OPERATOR_CLUMP, "clump", 0, 0, 1)                                                      \
    X(GROOM_OPERATOR_FRIZZ, "frizz", 1, 0, 0)

/* Shi et al. 2026: elements exchanged between strands (4.3.1), control points moved (5), a blend with other
 * strands, curls made wider or narrower. X(constant, name in documents) */
#define GROOM_LAYER_LIST(X)                                                                        \
    X(GROOM_OPERATOR_RUFFLE,      "ruffle")                                                        \
    X(GROOM_OPERATOR_SCULPT,      "sculpt")                                                        \
    X(GROOM_OPERATOR_INTERPOLATE, "interpolate")                                                   \
    X(GROOM_OPERATOR_CURL_SCALE,  "curl_scale")

typedef enum groom_operator_type {
#define GROOM_OPERATOR_ENUM(name, slug, n_random, per_guide, needs_guides) name,
    GROOM_OPERATOR_LIST(GROOM_OPERATOR_ENUM)
#undef GROOM_OPERATOR_ENUM
    GROOM_OPERATOR_COUNT, /* of operators proper; layers come after them */
    GROOM_LAYER_BEFORE_FIRST = GROOM_OPERATOR_COUNT - 1,
#define GROOM_LAYER_ENUM(name, slug) name,
    GROOM_LAYER_LIST(GROOM_LAYER_ENUM)
#undef GROOM_LAYER_ENUM
    GROOM_OPERATOR_TYPES  /* both kinds */
} groom_operator_type;

#define GROOM_OPERATOR_MAX_PARAMETERS 5
#define GROOM_OPERATOR_MAX_RANDOM 2

struct groom_layer;

/* Parameters sit in one array, in the order of groom_operator_parameters(type):
 *   scale  random_scale (eta)
 *   bend   angle (theta, radians), start (zeta, 0..1)
 *   curl   radius (rho, m), frequency (turns per m), random_frequency (turns per m), start (zeta)
 *   clump  profile (a)
 *   frizz  frequency (omega, per m), amplitude (alpha, m)
 *   ruffle       rho, blend (0..1), match_elements (a count)
 *   sculpt       stiffness (the paper's c, cm^4, at 45 elements a strand; the same pull at any other number)
 *   interpolate  t (0: the groom's own strands, 1: the target's)
 *   curl_scale   radius, step (factors), ramp_root, ramp_tip (0..1), largest_radius (m)
 * so that a fit, a gradient, a slider and a JSON object walk the same list. */
struct groom_operator {
    groom_operator_type type;
    int enabled;                /* 0: skipped by evaluation */
    uint64_t seed;              /* from which its random numbers were drawn */
    uint32_t id;                /* stream of its random numbers: unique in the groom, stays when the chain is reordered */
    float parameter[GROOM_OPERATOR_MAX_PARAMETERS];
    float *random[GROOM_OPERATOR_MAX_RANDOM]; /* [n_strands] or [n_operator_guides]; NULL beyond the type's number */
    struct groom_layer *layer;  /* what a layer has beside its parameters; NULL for an operator proper */
};

struct groom_operator_parameter {
    const char *name;       /* "radius" */
    const char *unit;       /* "m", "rad", "1/m", "cm^4", "count" (whole numbers alone), "" */
    float minimum, maximum; /* what a document may hold */
    float slider_maximum;   /* a sensible range in a user interface */
    float initial;          /* the documented starting value */
    const char *help;       /* one sentence for a groomer */
};

/* One of an operator's arrays of random numbers. */
struct groom_operator_random {
    const char *name;       /* "u", "u1": the key below "random" in a document */
    float minimum, maximum; /* -1..1: N(0,1) truncated (redrawn); 0..1: U(0,1) */
};

const char *groom_operator_name(groom_operator_type type);
/* The parameters of a type, and their number in *n. Static. */
const struct groom_operator_parameter *groom_operator_parameters(groom_operator_type type, uint32_t *n);
/* returns GROOM_OK or GROOM_EINVAL with the list of names in diag */
GROOM_MUST_CHECK groom_status groom_operator_parse(const char *name, groom_operator_type *type,
                                                   struct groom_diag *diag);
/* The random arrays of a type, and their number in *n. Static. */
const struct groom_operator_random *groom_operator_randoms(groom_operator_type type, uint32_t *n);
uint32_t groom_operator_random_arrays(groom_operator_type type);   /* their number alone */
int groom_operator_random_per_guide(groom_operator_type type);     /* 1: one for each operator guide */
int groom_operator_is_layer(groom_operator_type type);
int groom_operator_needs_guides(groom_operator_type type);         /* 1: not for a groom made of strands */

/* --- what a layer holds -------------------------------------------------------- */

/* How strands are grouped. */
typedef enum groom_grouping_kind {
    GROOM_GROUPING_ALL = 0,         /* all strands are one group */
    GROOM_GROUPING_GIVEN,           /* of_strand says */
    GROOM_GROUPING_OPERATOR_GUIDES, /* those of one operator guide */
    GROOM_GROUPING_CLUSTERS         /* k-means over root and tip of the strands that come into the layer */
} groom_grouping_kind;

struct groom_grouping {
    groom_grouping_kind kind;
    uint32_t count;      /* groups: GIVEN, CLUSTERS */
    uint64_t seed;       /* CLUSTERS */
    uint32_t *of_strand; /* GIVEN: [n_strands] below count; else NULL */
};

/* Control points and where they go. */
struct groom_layer_anchors {
    uint32_t n;
    uint32_t *strand;     /* [n] */
    float *at;            /* [n] 0..1 of the strand's arc length */
    float (*position)[3]; /* [n] metres */
};

/* The control points of a cluster at `at` go where the affine map takes them. */
struct groom_layer_frame {
    uint32_t cluster;
    float at;
    float transform[3][4]; /* x' = transform[.][0..2] x + transform[.][3] */
};

struct groom_layer {
    uint32_t n_elements;                  /* of every strand's super-helix; 0: as many as each needs */
    struct groom_grouping grouping;       /* ruffle: who exchanges; sculpt: what frames move; curl_scale: see group */
    struct groom_layer_anchors anchors;   /* sculpt */
    struct groom_layer_anchors contact;   /* sculpt: what holds strands outside the head; found by the edit, kept so
                                             that the same strands come out where there is no head */
    uint32_t n_frames;                    /* sculpt */
    struct groom_layer_frame *frames;
    struct groom_strands *target;         /* interpolate: the other strands, or NULL */
    char target_id[32];                   /* ... and where they came from; "" */
    uint32_t target_revision;
    int by_group;                         /* curl_scale: only `group` is changed */
    uint32_t group;
    int keep_turns;                       /* curl_scale: the number of turns stays, not the length */
    int free_direction;                   /* curl_scale: strands may turn about their roots */
};

/* Room for n control points in place of what was there. returns GROOM_OK, GROOM_ENOMEM (then there are none) */
GROOM_MUST_CHECK groom_status groom_layer_anchors_resize(struct groom_layer_anchors *anchors, uint32_t n,
                                                         const struct groom_allocator *allocator);
/* Room for n frames, likewise. */
GROOM_MUST_CHECK groom_status groom_layer_frames_resize(struct groom_layer *layer, uint32_t n,
                                                        const struct groom_allocator *allocator);

/* --- the groom ------------------------------------------------------------ */

struct groom {
    char name[128];
    uint32_t n_strands;         /* n */
    uint32_t n_vertices;        /* m, of each strand and guide, at least 3 */
    uint32_t n_guides;          /* n_g */
    uint32_t n_operator_guides; /* n_gop */
    uint32_t n_instancing;      /* k, guides that a strand blends */
    groom_scalp_source scalp;
    float axes[3][3];           /* rows: unit vectors, right-handed, that operators lean on: noise shifts strands along them,
                                 * bends and curls begin at directions that are taken off them. So hair that was made
                                 * upright and then turned has the numbers that it was made with. {0}: those of space */

    uint32_t n_base;            /* vertices of the base; 0: strands are instances of guides */
    uint32_t *first;            /* [n + 1] where each strand begins in it; else NULL */
    float (*base)[3];           /* [n_base] dense strands as they are; else NULL */
    char base_strands[32];      /* the upload they came from: "str_…", or "" */

    float (*roots)[3];          /* [n] */
    float (*root_uv)[2];        /* [n] */
    float (*guides)[3];         /* [n_g * m], guide-major; undeformed */
    float (*guide_uv)[2];       /* [n_g] */
    uint32_t *instancing_guide; /* [n * k] guides of a strand */
    float *instancing_weight;   /* [n * k] their weights; each strand's sum to 1 */
    uint32_t *operator_guide;   /* [n_gop] index into guides */
    uint32_t *operator_guide_of;/* [n] index into operator_guide */

    uint32_t n_operators;
    struct groom_operator *operators; /* [n_operators], in the order of the chain */
    const struct groom_allocator *allocator; /* owns the arrays */
};

struct groom_shape {
    uint32_t n_strands, n_vertices, n_guides, n_operator_guides, n_instancing;
};

/* A groom of this shape with zeroed arrays and no operators. Owned by the caller.
 * returns  GROOM_OK, GROOM_EINVAL (a count that is 0, m < 3, k > n_g, n_gop > n_g), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_create(struct groom_shape shape, const struct groom_context *context,
                                           struct groom **groom, struct groom_diag *diag);
/* A groom made of strands: they are its base, vertex for vertex, in place of guides, instancing and
 * operator guides (whose counts are 0); n_vertices is the most that a strand has. root_uv is the strands'
 * own, or zero.
 * strands  copied; each has at least 2 vertices
 * returns  GROOM_OK, GROOM_EINVAL, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_create_of_strands(const struct groom_strands *strands,
                                                      const struct groom_context *context,
                                                      struct groom **groom, struct groom_diag *diag);
void groom_destroy(struct groom *groom); /* takes NULL */
/* Where strand i begins in the dense strands: i m, or first[i]. i may be n_strands. */
size_t groom_first_vertex(const struct groom *groom, uint32_t strand);
/* The rest of a chain: `groom` with these dense strands as its base (as many, in the same order) and
 * the operators from `begin` to `end` - 1. A view: it borrows everything and is not destroyed. */
struct groom groom_with_base(const struct groom *groom, const struct groom_strands *base, uint32_t begin, uint32_t end);
/* A deep copy. */
GROOM_MUST_CHECK groom_status groom_clone(const struct groom *groom, const struct groom_context *context,
                                          struct groom **copy, struct groom_diag *diag);

/* Everything a groom must hold to be evaluated: indices in range, weights finite and summing to 1
 * (within 1e-3), parameters in range, random numbers in range, points finite and within 1 000 km, axes a rotation.
 * returns  GROOM_OK or GROOM_EINVAL with the JSON pointer of the culprit */
GROOM_MUST_CHECK groom_status groom_validate(const struct groom *groom, struct groom_diag *diag);

/* --- the chain ------------------------------------------------------------ */

/* Insert an operator at `index` (0..n_operators), enabled, with its initial parameters, an id of its
 * own, and random numbers drawn from `seed`. These three leave the groom as it was on error.
 * returns  GROOM_OK, GROOM_EINVAL (an index outside the chain, an unknown type, one that needs operator
 *          guides where there are none), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_insert_operator(struct groom *groom, uint32_t index,
                                                    groom_operator_type type, uint64_t seed,
                                                    struct groom_diag *diag);
GROOM_MUST_CHECK groom_status groom_remove_operator(struct groom *groom, uint32_t index, struct groom_diag *diag);
/* Take the operator at `from` out and put it back so that it stands at `to`. */
GROOM_MUST_CHECK groom_status groom_move_operator(struct groom *groom, uint32_t from, uint32_t to,
                                                  struct groom_diag *diag);
/* A groom that borrows all of `groom`, its operators as well, but for the one at `without` (n_operators: none
 * is left out), and to whose chain one operator may be added: what an edit tries before it is taken.
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_borrow(const struct groom *groom, uint32_t without, struct groom *copy,
                                           struct groom_diag *diag);
/* Ends it, with the operator that was added at `added` (n_operators: none was). */
void groom_borrow_end(struct groom *copy, uint32_t added);
/* Draw an operator's random numbers anew and keep the seed: a function of (seed, operator id, strand
 * or operator guide), whatever else is in the chain. `op` belongs to `groom`. */
void groom_draw_random(struct groom *groom, struct groom_operator *op, uint64_t seed);

/* --- instancing ------------------------------------------------------------ */

/* Eq. 3: the k guides nearest to each root in scalp coordinates and their Gaussian weights
 * exp(-d^2 / sigma^2), normalised. Fills instancing_guide and instancing_weight; exact and
 * deterministic (ties by index). sigma <= 0: 1.5 times the median distance of a guide to its
 * nearest guide. */
GROOM_MUST_CHECK groom_status groom_instance_by_distance(struct groom *groom, float sigma,
                                                         const struct groom_context *context,
                                                         struct groom_diag *diag);

/* --- evaluation ------------------------------------------------------------ */

/* Strands first .. first+count-1, dense.
 * groom    borrowed; has passed groom_validate. No layer of it is enabled: groom/layers.h evaluates those
 * out      [count][m][3], or of a base as many vertices as the strands have; the caller's
 * returns  GROOM_OK, GROOM_EINVAL (range; a layer), GROOM_ENOMEM
 * threads  same bits for any pool and any split into ranges */
GROOM_MUST_CHECK groom_status groom_evaluate(const struct groom *groom, uint32_t first, uint32_t count,
                                             float (*out)[3], const struct groom_context *context,
                                             struct groom_diag *diag);

/* The gradient of a scalar with respect to everything that a fit moves (reverse mode, exact).
 * groom_gradient_create allocates all arrays; set one to NULL (and keep it, to put it back before
 * groom_gradient_destroy) where it is not wanted. */
struct groom_gradient {
    float (*guides)[3];        /* [n_g * m], through instancing and through operator guides */
    float *instancing_weight;  /* [n * k], of the weights as stored (no renormalisation) */
    struct groom_operator_gradient {
        double parameter[GROOM_OPERATOR_MAX_PARAMETERS];
        float *random[GROOM_OPERATOR_MAX_RANDOM]; /* like groom_operator.random */
        groom_operator_type type;                 /* whose gradient it is */
    } *operators;              /* [n_operators]; zero for a disabled one */
    const struct groom_allocator *allocator;
    struct groom_shape shape;
    uint32_t n_operators;
};

/* For this groom, until its chain changes. Owned by the caller.
 * returns  GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_gradient_create(const struct groom *groom,
                                                    const struct groom_context *context,
                                                    struct groom_gradient **gradient,
                                                    struct groom_diag *diag);
void groom_gradient_destroy(struct groom_gradient *gradient); /* takes NULL */

/* How many strands an adjoint sees at once. */
#define GROOM_GRADIENT_PIECE 16

/* evaluate  called once for each piece of at most GROOM_GRADIENT_PIECE strands, after their forward
 *           evaluation, from any thread of the pool: reads points [n_piece][m][3] (strands piece_first..
 *           of the visiting order; piece_first is a multiple of GROOM_GRADIENT_PIECE) and writes
 *           d(loss)/d(points) into d_points of the same shape, every element. A loss that is summed
 *           in the same order everywhere keeps one partial sum a piece. */
struct groom_adjoint {
    void (*evaluate)(void *user, uint32_t piece_first, uint32_t n_piece, const float (*points)[3],
                     float (*d_points)[3]);
    void *user;
};

/* Forward and backward in one pass over the strands. Where a derivative does not exist (segments and
 * strands of no length, a curl that stands still at a frequency of 0) it is 0 for that term.
 * groom     borrowed; has passed groom_validate
 * strand    [count] indices of the strands to visit, each at most once, or NULL for all n (then
 *           count = n)
 * gradient  made for this groom and this chain; overwritten
 * returns   GROOM_OK, GROOM_EINVAL (an index or count out of range, another chain, a base or a layer, which
 *           have no gradient), GROOM_ENOMEM
 * threads   same bits for any pool */
GROOM_MUST_CHECK groom_status groom_evaluate_gradient(const struct groom *groom, const uint32_t *strand,
                                                      uint32_t count, struct groom_adjoint adjoint,
                                                      struct groom_gradient *gradient,
                                                      const struct groom_context *context,
                                                      struct groom_diag *diag);

/* --- fair samples ------------------------------------------------------------ */

/* A fixed permutation of 0..n-1 of which every prefix is a fair sample: the order in which a viewer
 * shows strands, and the ones that an export of fewer takes. A function of n alone.
 * order    [n], the caller's */
void groom_fair_order(uint32_t n, uint32_t *order);

/* The groom of these strands alone: the same guides and operators, the strands' own rows and random
 * numbers, so that each evaluates to the same bits as in the whole. Layers, which look at all strands,
 * cannot be had for some: select from what is behind them (groom_with_base).
 * strand   [count] indices, borrowed; may repeat
 * returns  GROOM_OK, GROOM_EINVAL (count is 0, an index out of range, an enabled layer), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_select(const struct groom *groom, const uint32_t *strand, uint32_t count,
                                           const struct groom_context *context, struct groom **selected,
                                           struct groom_diag *diag);

/* --- curvature parameters of guides (Eq. 10; Crane et al. 2013) ------------- */

/* Per guide: root position, root angles (2), m-1 segment lengths, m-2 curvatures of each of the two
 * angles. With phi = (polar, azimuth) and segments and joints counted from 0,
 *   phi_0 = angle, phi_{j+1} = phi_j + (length_j + length_{j+1}) / 2 curvature_j,
 *   d_j = pole^T (sin polar cos azimuth, sin polar sin azimuth, cos polar), x_{j+1} = x_j + length_j d_j.
 * The azimuth is unwrapped along the strand; the pole (the last row of the rotation) is chosen per
 * guide as far from its directions as 128 candidates allow, and stays until from_points is called again. */
struct groom_curvature_guides {
    uint32_t n_guides, n_vertices;
    float (*root)[3];      /* [n_g] metres */
    float (*pole)[9];      /* [n_g] rotation (row-major) into the guide's own spherical frame */
    float (*angle)[2];     /* [n_g] (polar, azimuth) of the first segment, radians */
    float *length;         /* [n_g][m-1] metres */
    float (*curvature)[2]; /* [n_g][m-2] radians per metre */
    const struct groom_allocator *allocator;
};

/* Zeroed. Owned by the caller.
 * returns  GROOM_OK, GROOM_EINVAL (no guide, fewer than 3 vertices), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_curvature_guides_create(uint32_t n_guides, uint32_t n_vertices,
                                                            const struct groom_context *context,
                                                            struct groom_curvature_guides **guides,
                                                            struct groom_diag *diag);
void groom_curvature_guides_destroy(struct groom_curvature_guides *guides); /* takes NULL */
/* points [n_g][m][3] -> parameters. Segments shorter than 1e-6 m get that length and the direction of
 * the segment before them (at the root: of the first that has one). All three: same bits for any pool. */
void groom_curvature_guides_from_points(const float (*points)[3], struct groom_curvature_guides *guides,
                                        const struct groom_context *context);
/* parameters -> points [n_g][m][3] */
void groom_curvature_guides_to_points(const struct groom_curvature_guides *guides, float (*points)[3],
                                      const struct groom_context *context);
/* d(loss)/d(points) -> d(loss)/d(angle, length, curvature); gradient's root and pole are left alone. */
void groom_curvature_guides_gradient(const struct groom_curvature_guides *guides,
                                     const float (*d_points)[3], struct groom_curvature_guides *gradient,
                                     const struct groom_context *context);

#ifdef __cplusplus
}
#endif
#endif
