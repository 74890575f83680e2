/* Retargeting: carry strands from one body to another so that they keep their look and stay outside of it
 * (Yu et al., "Shape Adaptation for 3D Hairstyle Retargeting"; numbers below are its equations).
 *
 *     groom_retarget_source_create(strands, body, skeleton, NULL, &options, context, &source, diag)  of the source alone
 *     groom_retarget_source_save / _load                                      kept with the strands
 *     groom_retarget_run(source, &target, &options, context, out, &report, diag)   once a target
 *     groom_retarget_groom(groom, ...)                                         a procedural groom
 *
 * Everything is in metres. The two bodies have the same triangles and similar poses; a body is closed or
 * open only at a cut, right side out. Results are the same bits for any pool. */
#ifndef GROOM_RETARGET_H
#define GROOM_RETARGET_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/io.h"
#include "groom/mesh.h"
#include "groom/skeleton.h"
#include "groom/strands.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom;

/* --- options ---------------------------------------------------------------- */

typedef enum groom_retarget_mode {
    GROOM_RETARGET_MULTISCALE, /* guides together, then every strand by itself (Section 5) */
    GROOM_RETARGET_GLOBAL      /* all strands together (Section 4.6) */
} groom_retarget_mode;

/* Table I and what it leaves open. One table (lib/retarget/options.c) makes defaults, parsing, printing and
 * the JSON Schema. */
struct groom_retarget_options {
    double alpha;        /* weight of the inter-strand term, Eq. 1 */
    double beta;         /* weight of the hair-body term, Eq. 1 */
    uint32_t neighbours; /* k of Eqs. 8 and 14 */
    double clearance;    /* epsilon_c of Eq. 13, metres */
    double discrepancy;  /* epsilon_s of Eq. 6 */
    uint32_t smoothing;  /* passes over the index set of Eq. 6; 0: until it is closed */
    double sigma_bone;   /* of Eq. 2 */
    double sigma_root;   /* of Eq. 20 */
    uint32_t guides;     /* strands of the coarse scale; all where there are no more */
    uint32_t iterations; /* in each scale, at most: steps of conjugate gradients down Eq. 1, or those of Section 4.6 */
    double tolerance;    /* mean movement that ends them, metres; 0: those of Section 4.6, all of them, each solved to the
                            last digits: what a reference is compared with */
    uint32_t sweeps;     /* rounds over the whole hairstyle after the fine scale: every particle between its own
                            neighbours, not the guides'; 0: none, as in the paper */
    groom_retarget_mode mode;
    uint64_t seed;       /* of the clustering that chooses guides */
};

void groom_retarget_options_init(struct groom_retarget_options *options);
/* Options from JSON ({"alpha":3000,"mode":"global",...}); what is absent has its default. n = 0: all defaults.
 * returns  GROOM_OK, GROOM_EINVAL with the JSON pointer of the member that was refused, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_retarget_options_parse(const char *json, size_t n,
                                                           struct groom_retarget_options *options,
                                                           struct groom_diag *diag);
/* All options, defaults filled in. malloc'd, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_retarget_options_print(const struct groom_retarget_options *options, char **json,
                                                           struct groom_diag *diag);
/* The JSON Schema (2020-12) of the options. malloc'd. */
GROOM_MUST_CHECK groom_status groom_retarget_options_schema(char **json, struct groom_diag *diag);

/* --- what depends on the source alone ------------------------------------------ */

struct groom_retarget_source; /* immutable; many threads may use it at once */

/* Where each particle is relative to bones and surface, the guides, the neighbours of every particle.
 * strands   borrowed until destroyed; at least 2 finite vertices each
 * body      borrowed until destroyed
 * skeleton  of the body; copied
 * regions   [body->n_triangles] bit b: the triangle may serve bone b (Lambda_b of Eq. 2); NULL: groom_skeleton_regions
 * options   neighbours, guides, sigma_bone, mode and seed are used here and kept; a groom_retarget_run takes the others
 * returns   GROOM_OK, GROOM_EINVAL, GROOM_EEMPTY (no strand), GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status groom_retarget_source_create(const struct groom_strands *strands,
                                                           const struct groom_mesh *body,
                                                           const struct groom_skeleton *skeleton,
                                                           const uint32_t *regions,
                                                           const struct groom_retarget_options *options,
                                                           const struct groom_context *context,
                                                           struct groom_retarget_source **source,
                                                           struct groom_diag *diag);
void groom_retarget_source_destroy(struct groom_retarget_source *source); /* takes NULL */

uint32_t groom_retarget_source_guides(const struct groom_retarget_source *source); /* how many strands are guides */
/* 1 for a guide. strand is in range. */
int groom_retarget_source_is_guide(const struct groom_retarget_source *source, uint32_t strand);

/* Versioned, checksummed, little-endian; names the strands and the body that it was made of.
 * returns  what the sink answers */
GROOM_MUST_CHECK groom_status groom_retarget_source_save(const struct groom_retarget_source *source,
                                                         struct groom_sink sink, struct groom_diag *diag);
/* strands, body, skeleton and options as they were given to groom_retarget_source_create.
 * returns  GROOM_OK; GROOM_ECONFLICT (made of other strands, another body, skeleton or options, or by another
 *          version: make it anew), GROOM_EFORMAT (damaged), GROOM_ETRUNCATED, GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_retarget_source_load(const struct groom_source *bytes,
                                                         const struct groom_strands *strands,
                                                         const struct groom_mesh *body,
                                                         const struct groom_skeleton *skeleton,
                                                         const uint32_t *regions,
                                                         const struct groom_retarget_options *options,
                                                         const struct groom_context *context,
                                                         struct groom_retarget_source **source,
                                                         struct groom_diag *diag);

/* --- once a target ---------------------------------------------------------------- */

struct groom_retarget_target {
    const struct groom_mesh *body;         /* the source body's triangles, other positions */
    const struct groom_skeleton *skeleton; /* the source's bones, in its order */
    const float (*roots)[3];               /* [n_strands] where a hairline edit put them, or NULL: where they are carried to */
};

/* The terms of Eq. 1 over all particles, with the neighbours of the scale that was solved last: those of the
 * whole hairstyle in the global mode and after sweeps, else guides among guides and the other strands against guides. */
struct groom_retarget_energy {
    double shape; /* Eq. 7 */
    double inter; /* Eqs. 10, 14, 21; without alpha */
    double body;  /* Eqs. 11, 21; without beta */
    double total; /* shape + alpha inter + beta body */
};

#define GROOM_RETARGET_MAX_HISTORY 64

/* One iteration. */
struct groom_retarget_step {
    struct groom_retarget_energy energy; /* after it */
    double mean_movement;                /* metres */
};

struct groom_retarget_inside {
    uint64_t vertices, segments;  /* inside the body: vertices but the roots, midpoints of segments */
    uint64_t near_vertices;       /* nearer than the clearance, those inside with them */
    double deepest;               /* metres, of vertices; 0 where none is inside */
};

/* How far vertices went from where the initial transfer has them. */
struct groom_retarget_movement {
    uint32_t strands;
    double mean, max; /* metres, of their vertices */
};

struct groom_retarget_report {
    uint32_t n_strands, n_guides;
    uint64_t n_vertices;
    uint64_t n_smoothed;              /* particles in the index set of Eq. 6 */
    uint64_t n_without_bone;          /* particles that no bone's ray reached: they moved with the nearest surface */
    struct groom_retarget_energy before, after; /* of the initial transfer, of the result */
    struct groom_retarget_energy two_scales;    /* with sweeps: what they started from, with the same neighbours as after */
    uint32_t iterations_coarse, iterations_fine, iterations_whole; /* the global mode's are coarse; whole: sweeps */
    struct groom_retarget_step coarse[GROOM_RETARGET_MAX_HISTORY]; /* [iterations_coarse], the first ones */
    struct groom_retarget_inside inside_before, inside_after;
    double length_ratio_min, length_ratio_median, length_ratio_max; /* of strands, result over source */
    double movement_mean, movement_max;                  /* of vertices from the initial transfer, metres */
    /* The same of strands that it has inside or too near somewhere, and of all others. A strand that it leaves where it
     * was (to 1e-6 m) and that keeps the clearance is unchanged to the bit, whatever its neighbours do. */
    struct groom_retarget_movement movement_conflict, movement_others;
    uint32_t n_unchanged;
    /* Strands shorter than the clearance: they stand up from their roots with their length kept, nearer than the
     * clearance; inside_after does not count that as too near. */
    uint32_t n_short;
    double seconds_initial, seconds_coarse, seconds_fine, seconds_whole, seconds_clearance, seconds_total;
};

/* Values a vertex for colours; each may be NULL. */
struct groom_retarget_values {
    float *movement;    /* [n_vertices] from the initial transfer, metres */
    float *depth;       /* [n_vertices] how far below the clearance the initial transfer was, metres; 0 elsewhere */
    float *stretch;     /* [n_vertices] length of the segment that ends there over the source's; 1 at roots */
};

/* Only the roots as they are carried to the target (Eq. 3), on its surface: what a hairline edit starts from.
 * roots    [n_strands]
 * returns  GROOM_OK, GROOM_EINVAL (the target has other triangles or bones), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_retarget_roots(const struct groom_retarget_source *source,
                                                   const struct groom_retarget_target *target,
                                                   const struct groom_context *context, float (*roots)[3],
                                                   struct groom_diag *diag);

/* Carry the strands over. The last pass is exact: whatever the iterations left inside is moved out, so that
 * but for roots and strands shorter than it no vertex is nearer to the body than the clearance, and no segment's middle is inside.
 * out      [n_vertices] in the layout of the source's strands; unspecified on error
 * report, values  may be NULL
 * returns  GROOM_OK, GROOM_EINVAL (other triangles, other bones, not finite), GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status groom_retarget_run(const struct groom_retarget_source *source,
                                                 const struct groom_retarget_target *target,
                                                 const struct groom_retarget_options *options,
                                                 const struct groom_context *context, float (*out)[3],
                                                 const struct groom_retarget_values *values,
                                                 struct groom_retarget_report *report, struct groom_diag *diag);

/* {"strands","vertices","guides","smoothed","without_bone","iterations_coarse","iterations_fine",
 *  "energy":{"before":{"shape","inter","body","total"},"after":...},
 *  "inside":{"before":{"vertices","segments","near_vertices","deepest"},"after":...},
 *  "length_ratio":{"min","median","max"},
 *  "movement":{"mean","max","in_conflict":{"strands","mean","max"},"others":{"strands","mean","max"}},"unchanged","shorter_than_clearance",
 *  "seconds":{"initial","coarse","fine","clearance","total"},"coarse":[{"energy","mean_movement"},...]}
 * malloc'd, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_retarget_report_print(const struct groom_retarget_report *report, char **json,
                                                          struct groom_diag *diag);

/* --- procedural grooms --------------------------------------------------------------- */

/* Carry a procedural groom over: its guides are the coarse scale and are adapted together; roots, guides and
 * scalp coordinates move, instancing, operators and their random numbers stay, so that curl and clump are as
 * before. A groom made of strands has these carried over in place of guides. Of layers, control points are
 * carried as particles are, frames with the box of the body, strands that are blended with as strands.
 * groom     borrowed
 * body, skeleton, regions  of the source, as for groom_retarget_source_create
 * target    roots: [n_strands + n_guides], the strands' and then the guides' (groom_retarget_groom_roots), or NULL
 * options   guides and mode count only for a groom made of strands
 * out       owned by the caller
 * report    of the guides (of the strands, where the groom is made of them), but for inside_after: of the strands as
 *           the operators make them (layers aside), which may bring some into the body that the guides are not in. May be NULL
 * returns   GROOM_OK, GROOM_EINVAL, GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status groom_retarget_groom(const struct groom *groom, const struct groom_mesh *body,
                                                   const struct groom_skeleton *skeleton, const uint32_t *regions,
                                                   const struct groom_retarget_target *target,
                                                   const struct groom_retarget_options *options,
                                                   const struct groom_context *context, struct groom **out,
                                                   struct groom_retarget_report *report, struct groom_diag *diag);

/* Only the roots as they are carried to the target, of the strands and then of the guides.
 * roots    [n_strands + n_guides] */
GROOM_MUST_CHECK groom_status groom_retarget_groom_roots(const struct groom *groom, const struct groom_mesh *body,
                                                         const struct groom_skeleton *skeleton, const uint32_t *regions,
                                                         const struct groom_retarget_target *target,
                                                         const struct groom_context *context, float (*roots)[3],
                                                         struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
